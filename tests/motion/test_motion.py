"""Motion: laws of rigid rotation, exact phases, and the places of parts and of recordings' nodes."""

import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from lowalt.files.errors import InputError
from lowalt.motion import poses, positions
from lowalt.motion.rotations import attitude, rodrigues, turns
from lowalt.targets.cloud import Cloud
from moving_clouds import recorded_cloud, rigid_cloud, row


def test_attitude_turns_about_z_then_x_then_y_as_published():
    quarter = math.pi / 2
    np.testing.assert_allclose(attitude(quarter, 0, 0) @ [0, 1, 0], [-1, 0, 0], atol=1e-15)
    np.testing.assert_allclose(attitude(0, quarter, 0) @ [0, 1, 0], [0, 0, 1], atol=1e-15)
    np.testing.assert_allclose(attitude(0, 0, quarter) @ [0, 0, 1], [1, 0, 0], atol=1e-15)
    whole = attitude(0.3, 0.5, 0.7)
    parts = (attitude(0.3, 0, 0), attitude(0, 0.5, 0), attitude(0, 0, 0.7))
    np.testing.assert_allclose(whole, parts[0] @ parts[1] @ parts[2], atol=1e-15)
    for part in parts:
        np.testing.assert_allclose(part @ part.T, np.eye(3), atol=1e-15)


def test_rodrigues_keeps_the_axis_and_adds_angles():
    axis = np.array([2.0, 3.0, 6.0]) / 7
    one, two, both = rodrigues(axis, np.array([0.4, 1.1, 1.5]))
    np.testing.assert_allclose(one @ axis, axis, atol=1e-15)
    np.testing.assert_allclose(one @ two, both, atol=1e-15)


@given(st.floats(0.1, 1000), st.integers(0, 10**6))
def test_turns_match_exact_arithmetic(rate, symbol):
    time = symbol * 2.5e-3
    with mpmath.workdps(60):
        exact = mpmath.mpf(rate) * mpmath.mpf(time)
        exact = exact - mpmath.nint(exact)
        found = turns(rate, np.array([time]))[0]
        difference = abs(mpmath.mpf(found) - exact)
        assert min(difference, abs(difference - 1)) < mpmath.mpf(2) ** -52


def test_parts_stay_rigid_and_do_not_drift_over_a_million_symbols():
    cloud = rigid_cloud("rotor", "UAV")
    motion = row(rate_hz=97.3, phase_0_rad=0.8, vx_mps=3.0, yaw_rad=1.0, pitch_rad=0.2)
    times = np.array([0, 1, 999_999]) * 2.5e-3
    found = positions(cloud, motion, times)
    for frame in found:
        moved = np.linalg.norm(frame[1:, None] - frame[None, 1:], axis=-1)
        still = np.linalg.norm(cloud.points[1:, None] - cloud.points[None, 1:], axis=-1)
        np.testing.assert_allclose(moved, still, atol=1e-12)
    with mpmath.workdps(40):
        angle = mpmath.mpf(motion["phase_0_rad"]) + 2 * mpmath.pi * mpmath.mpf(97.3) * mpmath.mpf(
            times[2]
        )
        turn = rodrigues(cloud.axes[1], np.array([float(mpmath.fmod(angle, 2 * mpmath.pi))]))[0]
    arm = cloud.points[1:] - cloud.hinges[1]
    expected = (arm @ turn.T + cloud.hinges[1]) @ attitude(1.0, 0.2, 0.0).T + [3.0 * times[2], 0, 0]
    np.testing.assert_allclose(found[2, 1:], expected, atol=1e-11)


def turning_cloud(kind: str, points: list, hinges: list, axes: list, **more) -> Cloud:
    """A body of one point and parts of one kind, a point each.

    `more` are names or parents, and facts of the record.
    """
    count = len(points) + 1
    nothing = [np.nan] * 3
    fields = {key: more.pop(key) for key in ("names", "parents") if key in more}
    cloud = rigid_cloud(kind, "UAV", more)
    return replace(
        cloud,
        points=np.array([[0.0, 0, 0], *points]),
        part=np.arange(count),
        kinds=("body", *[kind] * len(points)),
        hinges=np.array([nothing, *hinges], float),
        axes=np.array([nothing, *axes], float),
        normals=np.full((count, 3), np.nan),
        rcs_m2=np.ones(count),
        **{"names": tuple(map(str, range(count))), "parents": np.full(count, -1)} | fields,
    )


def two_rotors(factors: dict) -> Cloud:
    """A body and two rotors of one point each, with rate factors by part."""
    return turning_cloud("rotor", [[0.5, 0, 0], [-0.5, 0, 0]], [[0.3, 0, 0], [-0.5, 0.1, 0]], [[0, 0, 1], [1, 0, 0]],
                         names=("body", "main", "tail"), rate_factors=factors)  # fmt: skip


def test_each_rotor_turns_at_its_own_factor_of_the_rate():
    times = np.arange(400) * 2.5e-3
    line = row(rate_hz=6.4, phase_0_rad=0.3, phase_1_rad=1.1)
    plain = poses(two_rotors({}), line, times)
    own = poses(two_rotors({"tail": 5.4}), line, times)
    faster = poses(two_rotors({}), {**line, "rate_hz": 6.4 * 5.4}, times)
    np.testing.assert_array_equal(own.rotation[:, 1], plain.rotation[:, 1])
    np.testing.assert_array_equal(own.rotation[:, 2], faster.rotation[:, 2])
    assert abs(own.rotation[:, 2] - plain.rotation[:, 2]).max() > 1
    assert np.ptp(poses(two_rotors({"main": 0}), line, times).rotation[:, 1], axis=0).max() == 0
    ones = poses(two_rotors({"main": 1, "tail": 1.0}), line, times)
    assert all(one.tobytes() == other.tobytes() for one, other in zip(plain, ones, strict=True))


def test_an_outer_wing_rides_on_the_inner_one():
    flap = {"mean_deg": 15, "amplitude_deg": 40, "fold_amplitude_deg": 30, "fold_lag_deg": 90}
    cloud = turning_cloud("wing", [[1, 0, 0], [2, 0, 0]], [[0, 0, 0], [1, 0, 0]], [[0, -1, 0]] * 2,
                          parents=np.array([-1, -1, 1]), flap=flap)  # fmt: skip
    times = np.linspace(0, 0.25, 7)
    found = positions(cloud, row(rate_hz=4.0, phase_0_rad=0.3), times)
    beat = 0.3 + 2 * np.pi * 4 * times
    inner = np.radians(15 + 40 * np.cos(beat))
    outer = inner + np.radians(30 * np.cos(beat - np.pi / 2))
    elbow = np.stack([np.cos(inner), 0 * inner, np.sin(inner)], axis=1)
    np.testing.assert_allclose(found[:, 1], elbow, atol=1e-14)
    tip = elbow + np.stack([np.cos(outer), 0 * outer, np.sin(outer)], axis=1)
    np.testing.assert_allclose(found[:, 2], tip, atol=1e-14)


def test_a_recording_is_cyclic_and_linear_between_frames():
    cloud = recorded_cloud()
    track = cloud.track
    motion = row(start_s=11 / 120, playback=1.0)
    found = positions(cloud, motion, np.array([0.0, 0.25 / 120, 1 / 120, 12 / 120]))
    np.testing.assert_allclose(found[0], track[11], atol=1e-12)
    np.testing.assert_allclose(found[1], 0.75 * track[11] + 0.25 * track[0], atol=1e-12)
    np.testing.assert_allclose(found[2], track[0], atol=1e-12)
    np.testing.assert_allclose(found[3], track[11], atol=1e-12)


def test_a_missing_rate_is_refused_by_part_name():
    with pytest.raises(InputError, match=r"rotor 0"):
        poses(rigid_cloud("rotor", "UAV"), row(), np.arange(3) * 2.5e-3)
