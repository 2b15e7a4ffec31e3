"""Each column of the motion table: its range, its distribution, and independent draws."""

import itertools
import math

import numpy as np
import pytest
from scipy import stats

from builtin_records import CONFIG, TABLE
from lowalt.config.classes import AIRBORNE
from lowalt.motion.drawing import draw, region_polygon
from lowalt.motion.poses import poses
from lowalt.motion.table import NUMBERS, SCALE
from lowalt.numerics.streams import stream
from lowalt.targets.cloud import extent
from lowalt.targets.make import make
from lowalt.targets.records import load_records
from moving_clouds import SETTINGS, recorded_cloud

ROWS = 600
SQUARE = [[0.0, 0.0], [400.0, 0.0], [400.0, 300.0], [0.0, 300.0]]
"""A region whose sides lie along the axes, so that x and y are uniform and independent; the mast is
far away.
"""
MAST = np.array([[-500.0, -500.0]])
MOTION = SETTINGS | {
    "region": {"polygon_m": SQUARE, "mast_clearance_m": 10.0},
    "sizes_m": {"UAV": [0.2, 3.0], "Vehicle": [2.0, 8.0]},
}
NAMES = {
    "UAV": "DJI Mavic 3 Pro",
    "Bird": "Crow",
    "Vehicle": "AITO M9 2024",
    "Pedestrian": "recorded",
}
WALK = {"speed_lo": 0.2, "speed_hi": 1.5}


def cloud_of_class(category):
    """A built-in target of a class.

    Pedestrians' nodes need the published recordings, so they come from a small one.
    """
    if category == "Pedestrian":
        return recorded_cloud(origin_height_m=0.9, track_speed_mps=1.25), WALK
    kinds = [CONFIG / f"targets/{kind}.yaml" for kind in ("uav", "bird", "vehicle", "pedestrian")]
    return make(load_records(CONFIG / "targets.csv", kinds)[NAMES[category]], None, 1), TABLE[
        NAMES[category]
    ]


def drawn(category):
    """A class's cloud, its published ranges and the columns (ROWS,) of as many motion models."""
    cloud, ranges = cloud_of_class(category)
    corners = region_polygon(MAST, SQUARE)
    rows = [
        draw(stream(3, "motion", cloud.subtype, n), cloud, ranges, MAST, corners, MOTION)
        for n in range(ROWS)
    ]
    columns = {name: np.array([row[name] for row in rows]) for name in (*NUMBERS, SCALE)}
    return (
        cloud,
        ranges,
        {name: column for name, column in columns.items() if not np.isnan(column).all()},
    )


def drawn_quantities(cloud, ranges, columns):
    """The drawn quantities (ROWS,), each with its range, and the columns that they decide.

    A velocity on the ground is that of a speed ahead; a resized target's rate falls as its size
    grows.
    """
    circle = (0, 2 * math.pi)
    tilt = (-math.radians(20), math.radians(20))
    found = {
        "x_m": (columns["x_m"], 0, 400),
        "y_m": (columns["y_m"], 0, 300),
        "yaw_rad": (columns["yaw_rad"], *circle),
    }
    moving = (
        len(cloud.parts_of("rotor")) + len(cloud.parts_of("wheel")) + bool(cloud.parts_of("wing"))
    )
    found |= {f"phase_{n}_rad": (columns[f"phase_{n}_rad"], *circle) for n in range(moving)}
    scale = columns[SCALE]
    decided = {"playback"}
    if cloud.category in MOTION["sizes_m"]:
        low_m, high_m = MOTION["sizes_m"][cloud.category]
        found[SCALE] = np.log(scale * extent(cloud)), math.log(low_m), math.log(high_m)
    else:
        assert (scale == 1).all()
        decided.add(SCALE)
    if cloud.category in AIRBORNE:
        found |= {"z_m": (columns["z_m"], *MOTION["height_m"][cloud.category])}
        found |= {f"{angle}_rad": (columns[f"{angle}_rad"], *tilt) for angle in ("pitch", "roll")}
        found["rate_hz"] = columns["rate_hz"] * scale, ranges["freq_lo_hz"], ranges["freq_hi_hz"]
        for axis in "xyz":
            bound = ranges[f"v{axis}_abs_max"]
            found[f"v{axis}_mps"] = columns[f"v{axis}_mps"], -bound, bound
        return found, decided
    speed = np.hypot(columns["vx_mps"], columns["vy_mps"])
    np.testing.assert_allclose(columns["vx_mps"], -speed * np.sin(columns["yaw_rad"]), atol=1e-12)
    np.testing.assert_allclose(columns["vy_mps"], speed * np.cos(columns["yaw_rad"]), atol=1e-12)
    np.testing.assert_allclose(columns["z_m"], cloud.record["origin_height_m"] * scale)
    for name in ("vz_mps", "pitch_rad", "roll_rad"):
        assert not columns[name].any()
    found["speed"] = speed, ranges["speed_lo"], ranges["speed_hi"]
    if "rate_hz" in columns:
        np.testing.assert_allclose(
            columns["rate_hz"] * scale * math.pi * cloud.record["wheel_diameter_m"], speed
        )
    if "start_s" in columns:
        found["start_s"] = columns["start_s"], 0, len(cloud.track) / cloud.record["track_rate_hz"]
        assert (columns["playback"] == 1).all()
    return found, decided | {
        "vx_mps",
        "vy_mps",
        "vz_mps",
        "z_m",
        "pitch_rad",
        "roll_rad",
        "rate_hz",
    }


@pytest.fixture(scope="module", params=NAMES)
def quantities(request):
    cloud, ranges, columns = drawn(request.param)
    found, decided = drawn_quantities(cloud, ranges, columns)
    # Every column of the table has a law.
    assert set(columns) <= set(found) | decided
    return found


def test_each_quantity_is_uniform_over_its_range(quantities):
    for name, (values, low, high) in quantities.items():
        assert values.min() >= low - 1e-9, name
        assert values.max() <= high + 1e-9, name
        # Kolmogorov-Smirnov: of a thousand such tests one fails by chance, and the seed is fixed.
        assert stats.kstest(values, "uniform", (low, high - low)).pvalue > 1e-3, name


def test_each_quantity_is_drawn_independently_of_the_others_and_of_other_models(quantities):
    bound = 4.5 / math.sqrt(ROWS)
    ranked = {name: stats.rankdata(values) for name, (values, _, _) in quantities.items()}
    for (one, first), (other, second) in itertools.combinations(ranked.items(), 2):
        assert abs(np.corrcoef(first, second)[0, 1]) < bound, (one, other)
    for name, ranks in ranked.items():
        assert abs(np.corrcoef(ranks[1:], ranks[:-1])[0, 1]) < bound, name
        assert len(np.unique(ranks)) == ROWS, name


@pytest.mark.parametrize("category", NAMES)
def test_a_larger_yaw_turns_all_parts_to_the_left_about_the_origin(category):
    cloud, ranges = cloud_of_class(category)
    corners = region_polygon(MAST, SQUARE)
    row = draw(stream(4, "motion", category), cloud, ranges, MAST, corners, MOTION)
    row["model"] = 0
    row["vx_mps"] = row["vy_mps"] = 0.0
    turned = row | {"yaw_rad": row["yaw_rad"] + 0.8}
    times_s = np.linspace(0.0, 0.1, 5)
    before = poses(cloud, row, times_s)
    after = poses(cloud, turned, times_s)
    left = np.array(
        [[math.cos(0.8), -math.sin(0.8), 0], [math.sin(0.8), math.cos(0.8), 0], [0, 0, 1]]
    )
    origin = np.array([row["x_m"], row["y_m"], 0.0])
    expected = (before.translation - origin) @ left.T + origin
    np.testing.assert_allclose(after.rotation, left @ before.rotation, atol=1e-12)
    np.testing.assert_allclose(after.translation, expected, atol=1e-10)
