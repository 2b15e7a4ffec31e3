"""Motion models: the table's round trip, ranges of draws, streams and the region.

The region lies between the masts, and streams are found by name.
"""

import math

import numpy as np
import pytest

from builtin_records import CONFIG, TABLE
from lowalt.files.errors import InputError
from lowalt.motion import positions, read_table, write_table
from lowalt.motion.drawing import draw, region_polygon
from lowalt.motion.rotations import attitude
from lowalt.motion.table import NUMBERS
from lowalt.numerics.streams import stream
from lowalt.targets.make import make
from lowalt.targets.records import load_records
from moving_clouds import SETTINGS, recorded_cloud, rigid_cloud, row

KINDS = "uav", "bird", "vehicle", "pedestrian"
MASTS = np.array([[0.0, 0.0], [500.0, 0.0], [250.0, 433.0127018922193]])


def test_the_table_reads_back_the_same_bits(tmp_path):
    rng = np.random.default_rng(2)
    rows = [
        row(**{name: float(rng.normal()) for name in NUMBERS}, model=index) for index in range(5)
    ]
    rows[1]["start_s"] = math.nan
    path = tmp_path / "motion.csv"
    write_table(path, rows)
    back = read_table(path)
    for was, now in zip(rows, back, strict=True):
        assert all(
            was[name] == now[name] or (was[name] != was[name] and now[name] != now[name])
            for name in was
        )


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("x_m", "x_km", 1), "columns"),
        (lambda text: text.replace("0.0", "zero", 1), "line 2, column x_m: 'zero'"),
        (lambda text: text.rsplit(",", 1)[0] + "\n", "cells"),
    ],
)
def test_a_broken_table_is_refused_with_its_place(tmp_path, change, words):
    path = tmp_path / "motion.csv"
    write_table(path, [row()])
    path.write_text(change(path.read_text()))
    with pytest.raises(InputError, match=words):
        read_table(path)


def test_places_are_uniform_over_the_triangle_of_masts_and_clear_of_them():
    corners = region_polygon(MASTS, None)
    cloud = rigid_cloud("rotor", "UAV")
    rows = [
        draw(stream(7, "motion", "test", i), cloud, TABLE["DJI Mini 2"], MASTS, corners, SETTINGS)
        for i in range(300)
    ]
    places = np.array([[drawn["x_m"], drawn["y_m"]] for drawn in rows])
    x, y = places.T
    assert np.linalg.norm(places[:, None] - MASTS, axis=2).min() >= 10
    assert (y >= 0).all()
    assert (y <= math.sqrt(3) * np.minimum(x, 500 - x) + 1e-9).all()
    # The mean stands at the centroid, within five standard errors.
    assert np.abs(places.mean(axis=0) - corners.mean(axis=0)).max() < 5 * 125 / math.sqrt(300)


@pytest.mark.parametrize(
    "name", ["NIO ET5T 2023", "Xiaomi SU7 2024", "Walking Pedestrian 1", "Running Pedestrian 1"]
)
def test_ground_targets_move_to_their_front_and_their_wheels_roll(name):
    records = load_records(
        CONFIG / "targets.csv", [CONFIG / f"targets/{kind}.yaml" for kind in KINDS]
    )
    cloud = make(records[name], None, 1)
    corners = region_polygon(MASTS, None)
    for index in range(4):
        drawn = draw(stream(1, name, index), cloud, TABLE[name], MASTS, corners, SETTINGS)
        velocity = np.array([drawn[f"v{axis}_mps"] for axis in "xyz"])
        speed = float(np.linalg.norm(velocity))
        assert TABLE[name]["speed_lo"] <= speed <= TABLE[name]["speed_hi"]
        front = attitude(drawn["yaw_rad"], 0.0, 0.0) @ [0.0, 1.0, 0.0]
        np.testing.assert_allclose(velocity, speed * front, atol=1e-12)
        # A rolling wheel stands still on the road, and its top has twice the car's speed.
        mine = np.isin(cloud.part, cloud.parts_of("wheel"))
        before, now, after = positions(cloud, drawn | {"model": 0}, np.array([-1e-6, 0.0, 1e-6]))[
            :, mine
        ]
        along = (after - before) @ front / 2e-6
        rad_per_m = 2.0 / cloud.record.get("wheel_diameter_m", 1.0)
        np.testing.assert_allclose(along, speed * rad_per_m * now[:, 2], atol=1e-5 * speed)


def test_the_hull_of_many_stations_is_the_region_and_bad_polygons_are_refused():
    square = np.array([[0, 0], [0, 10], [10, 0], [10, 10], [4, 5]], dtype=float)
    assert sorted(map(tuple, region_polygon(square, None))) == sorted(map(tuple, square[:4]))
    for masts, polygon, words in (
        (MASTS[:2], None, "polygon_m"),
        (square, square.tolist(), "not convex"),
        (square, [[0, 0], [1, 1], [2, 2]], "flat"),
    ):
        with pytest.raises(InputError, match=words):
            region_polygon(masts, polygon)


@pytest.mark.parametrize(("cadence", "tied"), [("free", False), ("tied", True)])
def test_cadence_follows_speed_only_where_tied(cadence, tied):
    cloud = recorded_cloud(origin_height_m=0.9, track_speed_mps=1.25)
    settings = SETTINGS | {"cadence": cadence}
    ranges = {"speed_lo": 0.2, "speed_hi": 1.5}
    drawn = draw(stream(1, "m"), cloud, ranges, MASTS, region_polygon(MASTS, None), settings)
    speed = math.hypot(drawn["vx_mps"], drawn["vy_mps"])
    assert 0.2 <= speed <= 1.5
    # On the ground nothing tilts.
    assert drawn["z_m"] == 0.9 and drawn["pitch_rad"] == drawn["roll_rad"] == 0
    assert 0 <= drawn["start_s"] < 12 / 120
    assert drawn["playback"] == pytest.approx(speed / 1.25 if tied else 1.0)
