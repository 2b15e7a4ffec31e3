"""The built-in pedestrians: what the published model says, rigid bones, a seamless cycle.

People differ.
"""

from pathlib import Path

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.targets import cloud as clouds
from lowalt.targets import gait, gait_walk
from lowalt.targets.records import load_table, merge, read_records
from lowalt.targets.skeleton import FEET, NODES, PARENTS, stature_m
from tables import rows

ROOT = Path(__file__).parents[2]
TABLE = {
    name: row
    for name, row in load_table(ROOT / "config/targets.csv").items()
    if row["category"] == "Pedestrian"
}
HEIGHTS = {name: row["hgt_m"] for name, row in TABLE.items()}
RECORDS = read_records(ROOT / "config/targets/pedestrian.yaml")


def built(name: str, **changes) -> clouds.Cloud:
    return clouds.check(gait.gait_cloud(merge(TABLE[name], RECORDS[name] | changes, name), 0), name)


@pytest.fixture(scope="module")
def people() -> dict[str, clouds.Cloud]:
    return {name: built(name) for name in RECORDS}


def test_cycle_length_and_duration_are_the_published_ones():
    # Boulic et al. 1990: R_c = 1.346 sqrt(RV), T_c = R_c / RV, T_s = 0.752 T_c - 0.143.
    assert gait_walk.timing(1.0) == pytest.approx((1.346, 1.346, (0.752 * 1.346 - 0.143) / 1.346))
    assert gait_walk.timing(2.25)[0] == pytest.approx(1.346 * 1.5)


@pytest.mark.parametrize(
    ("rv", "phase", "degrees"),
    rows("gaits", "points"),
)
def test_leg_passes_through_the_published_control_points(rv, phase, degrees):
    for found, wanted in zip(gait_walk.leg(rv, np.array([phase])), degrees, strict=True):
        if wanted is not None:
            assert np.degrees(found[0]) == pytest.approx(wanted)


@pytest.mark.parametrize("rv", [0.5, 1.3])
def test_the_three_speed_ranges_join_without_a_step(rv):
    phase = np.linspace(0, 1, 101)
    below = rv - 1e-9
    above = rv + 1e-9
    for curve in (gait_walk.leg, gait_walk.arm):
        for left, right in zip(curve(below, phase), curve(above, phase), strict=True):
            # At 1.3 one control point of the hip becomes two, which bends the curve between points
            # by 0.6 degrees.
            assert np.abs(left - right).max() < (
                0.012 if rv == 1.3 and curve is gait_walk.leg else 1e-5
            )
    assert np.abs(gait_walk.shift(below, phase) - gait_walk.shift(above, phase)).max() < 1e-6


def test_stature_and_length_of_every_bone_hold_in_every_frame(people):
    assert set(people) == set(HEIGHTS)
    for name, cloud in people.items():
        bones = gait.bones_m(HEIGHTS[name])
        assert stature_m(bones) == pytest.approx(HEIGHTS[name], rel=1e-12)
        parents = list(PARENTS[1:])
        lengths = np.linalg.norm(cloud.track[:, 1:] - cloud.track[:, parents], axis=2)
        assert np.abs(lengths - np.linalg.norm(bones[1:], axis=1)).max() < 1e-13
        if name.startswith("Walking"):
            assert np.abs(np.ptp(cloud.track[..., 2], axis=1) / HEIGHTS[name] - 1).max() < 0.02


def test_cycle_closes_in_position_and_velocity(people):
    for cloud in people.values():
        # The step over the seam and its change look like every other step and change.
        steps = np.linalg.norm(np.diff(cloud.track, axis=0, append=cloud.track[:1]), axis=2)
        turns = np.diff(cloud.track, n=2, axis=0, append=cloud.track[:2])
        change = np.linalg.norm(turns, axis=2).max(axis=1)
        assert steps[-1].max() < 1.2 * steps[:-1].max()
        assert change[-2:].max() <= 1.2 * change[:-2].max()


def test_left_side_is_the_right_side_half_a_cycle_later():
    track, _, _ = gait.cycle_m("walk", 1.7, 1.3, 200)
    mirrored = np.roll(track, 100, axis=0) * [-1, 1, 1]
    paired = [
        name for name in NODES if name[0] in "lr" and name not in ("root", "lowerback", "lowerneck")
    ]
    swap = [
        NODES.index("lr"[name[0] == "l"] + name[1:]) if name in paired else NODES.index(name)
        for name in NODES
    ]
    assert np.abs(mirrored[:, swap] - track).max() < 1e-9


def test_walkers_foot_stands_while_the_body_passes(people):
    for cloud in people.values():
        fastest = (
            np.linalg.norm(np.diff(cloud.track[:, FEET], axis=0), axis=2).max()
            * cloud.record["track_rate_hz"]
        )
        assert cloud.record["stance_foot_speed_mps"] < 0.65 < 0.25 * fastest


def test_the_record_s_facts_are_those_of_the_cycle(people):
    for name, cloud in people.items():
        record = cloud.record
        assert record["stride_m"] / record["cycle_s"] == pytest.approx(record["speed_mps"])
        assert record["track_rate_hz"] == pytest.approx(len(cloud.track) / record["cycle_s"])
        assert record["origin_height_m"] == pytest.approx(-cloud.track[..., 2].min())
        usual = (85, 125) if name.startswith("Walking") else (169.5, 169.7)
        assert usual[0] < record["cadence_steps_per_min"] < usual[1]


def test_runner_flies_and_walker_never_does():
    for kind, speed, flies in (("run", 3.0, True), ("walk", 1.3, False)):
        track, _, _ = gait.cycle_m(kind, 1.7, speed, 200)
        lowest = track[..., 2].min(axis=1) - track[..., 2].min()
        assert bool(lowest.max() > 0.06) is flies


@pytest.mark.parametrize(
    ("changes", "names"),
    rows("gaits", "records"),
)
def test_bad_records_are_refused_by_name(changes, names):
    with pytest.raises(InputError, match=names) as error:
        built("Walking Pedestrian 1", **changes)
    assert "Walking Pedestrian 1" in str(error.value)
