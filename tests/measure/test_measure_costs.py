"""What the cost tables of `lowalt.measure` hold: methods, clocks and samples are made up, so all
follows by hand.
"""

import copy
from dataclasses import replace

import numpy as np
import pytest

from craft import NETWORK, craft
from lowalt.config.network import Network
from lowalt.echo import echo_signal
from lowalt.measure import echo_cost

PUBLISHED = {"vx_abs_max": 5, "vy_abs_max": 5, "vz_abs_max": 2, "freq_lo_hz": 60, "freq_hi_hz": 100}
MOTION = {
    "region": {
        "polygon_m": [[0, -400], [400, -400], [400, 400], [0, 400]],
        "mast_clearance_m": 10.0,
    },
    "height_m": {"UAV": [30, 150]},
    "tilt_deg": 20.0,
    "cadence": "free",
}


def network(height_m=25.0):
    """The craft's network, its first station at a place of its own."""
    settings = copy.deepcopy(NETWORK)
    first = settings["stations"][next(iter(settings["stations"]))]
    first["position_m"], first["normal_deg"] = [30.0, -20.0, height_m], 40.0
    return Network.from_settings(settings)


@pytest.mark.parametrize("height_m", [25.0, 500.0])
def test_a_sample_starts_at_its_distance_in_front_of_the_first_station_and_never_steeper_than_nine_tenths(
    height_m,
):
    """Craft fly at 30 to 150 m: 20 m away they are too high for a mast of 25 m, and too low for one
    of 500 m.
    """
    radar = network(height_m)
    turns = []
    station = radar.stations[0]
    for seed in range(60):
        _, _, aim = echo_cost.sample(craft(), PUBLISHED, radar, MOTION, seed, 20.0, 9)
        way = aim - station.position_m
        assert np.linalg.norm(way) == pytest.approx(20.0) and abs(way[2]) <= 18.0 + 1e-9
        turns.append(np.arctan2(way[1], way[0]) - station.normal_rad)
        if height_m == 500.0:
            assert way[2] == pytest.approx(-18.0)
    assert -0.8 <= min(turns) < -0.6 and 0.6 < max(turns) <= 0.8


def test_a_sample_s_points_stand_by_part_with_their_own_cross_sections():
    cloud = craft()
    order = np.random.default_rng(2).permutation(len(cloud.points))
    mixed = replace(
        cloud,
        points=cloud.points[order],
        part=cloud.part[order],
        rcs_m2=1.0 + np.arange(len(order)),
    )
    own = {
        tuple(point): rcs for point, rcs in zip(mixed.points.tolist(), mixed.rcs_m2, strict=True)
    }
    for count in (7, 400):
        moved, rcs, aim = echo_cost.sample(mixed, PUBLISHED, network(), MOTION, 1, 150.0, count)
        assert len(rcs) == len(moved.points) == count and (np.diff(moved.part) >= 0).all()
        assert [own[tuple(point)] for point in moved.points.tolist()] == rcs.tolist()
        again = echo_cost.sample(mixed, PUBLISHED, network(), MOTION, 1, 150.0, count)
        assert (again[1] == rcs).all() and (again[2] == aim).all()
    starts = [
        echo_cost.sample(mixed, PUBLISHED, network(), MOTION, 1, 150.0, count)[2]
        for count in (400, 7)
    ]
    assert (starts[0] != starts[1]).any()


def given(points=12):
    """A sample of the craft: radar, and its motion, cross sections and aim."""
    radar = network()
    return radar, echo_cost.sample(craft(), PUBLISHED, radar, MOTION, 1, 150.0, points)


def test_the_truth_is_the_value_of_the_strongest_cell_at_two_symbols_and_the_deepest_fade():
    radar, sample = given()
    exact = echo_signal(radar, radar.stations[0], *sample)
    judged = [echo_cost.truths(radar, sample, exact.signal, exact.cell, seed) for seed in (1, 2)]
    for found in judged:
        assert int(np.argmin(abs(exact.signal))) in found and 2 <= len(found) <= 3
        assert all(
            complex(value) == pytest.approx(exact.signal[n], rel=1e-9) for n, value in found.items()
        )
    assert set(judged[0]) != set(judged[1])


def test_the_table_has_every_method_and_its_error():
    pytest.importorskip("finufft")
    block = {
        "motion": MOTION,
        "seed": 1,
        "distance_m": 150.0,
        "points": [6, 40],
        "tolerances": [1e-3, 1e-15],
        "repeats": 1,
    }
    rows = echo_cost.measure(network(), [craft()] * 2, {"DJI Mini 2": PUBLISHED}, block)
    assert all(tuple(row) == echo_cost.COLUMNS and row["seconds"] > 0 for row in rows)
    # float64 keeps no tolerance of 1e-15, so no row says so.
    named = [
        ("NumPy, float32", ""),
        ("NumPy, float64", ""),
        ("NUFFT", ""),
        ("lowalt", "exact"),
        ("lowalt", 1e-3),
    ]
    wanted = [(method, tolerance, points) for points in (6, 40) for method, tolerance in named]
    assert [(row["method"], row["tolerance"], row["points"]) for row in rows] == wanted
    single, double, transform, exact, loose = (row["relative_error"] for row in rows[5:])
    assert (
        1e-6 < single < 1e-1
        and double < 1e-10
        and transform < 1e-8
        and exact < 1e-13
        and loose < 1e-3
    )
