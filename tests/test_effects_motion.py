"""Motion effects: what is added to a target's motion, read back from its poses, laws of the random processes."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest

from lowalt.config import load_yaml
from lowalt.errors import InputError
from lowalt.motion import Perturbation, poses
from lowalt.motion.sample import draw, region_polygon
from lowalt.streams import stream
from lowalt.targets.__main__ import make
from lowalt.targets.cloud import Cloud
from lowalt.targets.records import load_records

TIMES = np.arange(400) * 2.5e-3
QUAD, BIRD, CAR, WALKER = "DJI Mini 2", "Crow", "ZEEKR 001 2022", "Walking Pedestrian 2"


@lru_cache
def target(name: str) -> tuple[Cloud, dict]:
    """A built-in cloud and one motion model of it."""
    config = load_yaml("config/default.yaml")
    record = load_records(config["targets"]["table"], config["targets"]["records"])[name]
    cloud = make(record, None, config["seed"])
    masts = np.array([station["position_m"][:2] for station in config["network"]["stations"].values()])
    corners = region_polygon(masts, None)
    row = draw(stream(1, "motion", name, 0), cloud, record["published"], masts, corners, config["motion"])
    return cloud, {**row, "model": 0}


@pytest.mark.parametrize("name", [QUAD, BIRD, CAR, WALKER])
def test_nothing_added_leaves_every_bit_of_the_motion(name):
    plain = poses(*target(name), TIMES)
    for nothing in (None, Perturbation(), Perturbation({})):
        found = poses(*target(name), TIMES, nothing)
        assert found.rotation.tobytes() == plain.rotation.tobytes()
        assert found.translation.tobytes() == plain.translation.tobytes()


@pytest.mark.parametrize("name", [QUAD, BIRD, CAR, WALKER])
def test_offset_and_tilt_equal_the_row_changed_symbol_by_symbol(name):
    cloud, row = target(name)
    rng = np.random.default_rng(3)
    times = TIMES[::50]
    offset, tilt = rng.normal(size=(2, len(times), 3))
    found = poses(cloud, row, times, Perturbation(offset_m=offset, tilt_rad=tilt))
    for n, time in enumerate(times):
        changed = dict(row)
        for axis, more in zip("xyz", offset[n], strict=True):
            changed[f"{axis}_m"] += more
        for angle, more in zip(("yaw_rad", "pitch_rad", "roll_rad"), tilt[n], strict=True):
            changed[angle] += more
        slow = poses(cloud, changed, np.array([time]))
        np.testing.assert_allclose(found.rotation[n], slow.rotation[0], atol=1e-13)
        np.testing.assert_allclose(found.translation[n], slow.translation[0], atol=1e-10)


@pytest.mark.parametrize(("name", "kind"), [(QUAD, "rotor"), (CAR, "wheel")])
def test_an_added_angle_turns_its_own_part_and_no_other(name, kind):
    cloud, row = target(name)
    first, second = cloud.parts_of(kind)[:2]
    angle = np.linspace(0, 9, len(TIMES))
    found, plain = poses(cloud, row, TIMES, Perturbation({second: angle})), poses(cloud, row, TIMES)
    np.testing.assert_allclose(found.rotation[:, first], plain.rotation[:, first], atol=1e-13)
    for n in (0, 17, 399):
        slow = poses(cloud, {**row, "phase_1_rad": row["phase_1_rad"] + angle[n]}, TIMES[n : n + 1])
        np.testing.assert_allclose(found.rotation[n, second], slow.rotation[0, second], atol=1e-12)
        np.testing.assert_allclose(found.translation[n, second], slow.translation[0, second], atol=1e-10)


def test_an_added_angle_of_an_inner_wing_carries_the_outer_one():
    cloud, row = target(BIRD)
    inner = [part for part in cloud.parts_of("wing") if cloud.parents[part] < 0]
    found = poses(cloud, row, TIMES, Perturbation(dict.fromkeys(inner, np.full(len(TIMES), math.radians(7)))))
    flap = cloud.record["flap"]
    higher = replace(cloud, record={**cloud.record, "flap": {**flap, "mean_deg": flap["mean_deg"] + 7}})
    slow = poses(higher, row, TIMES)
    np.testing.assert_allclose(found.rotation, slow.rotation, atol=1e-12)
    np.testing.assert_allclose(found.translation, slow.translation, atol=1e-10)


@pytest.mark.parametrize("name", [QUAD, WALKER])
def test_turning_a_part_that_does_not_move_is_refused(name):
    with pytest.raises(InputError, match=r"angles added to parts \[0\]"):
        poses(*target(name), TIMES, Perturbation({0: TIMES}))
