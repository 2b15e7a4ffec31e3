"""Cycles of recordings: found, closed without a jump, and turned to the front.

They are refused where they close badly.
"""

import tracemalloc

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.files.errors import InputError
from lowalt.targets.gallery import caption
from lowalt.targets.mocap_files import read_skeleton
from lowalt.targets.mocap_motion import Motion, closed, find_cycle, nodes_m
from lowalt.targets.skeleton import LIMBS, NODES, PARENTS, rotation
from walkers import asf, cloud_of, walk, write_files


@pytest.fixture
def files(tmp_path):
    return write_files(tmp_path)


def test_cycle_is_found_closed_and_rigid(files):
    cloud = cloud_of(files, scale="none")
    record = cloud.record
    track = cloud.track
    assert len(track) in (100, 200)  # whole periods of the made-up walk
    assert record["loop_mismatch_m"] < 1e-9
    assert record["track_speed_mps"] == pytest.approx(0.2 * 120 * 0.0254 / 0.45)
    skeleton = read_skeleton(files / "s.asf")
    lengths = np.linalg.norm(track[:, 1:] - track[:, list(PARENTS[1:])], axis=2)
    assert (
        np.abs(lengths - np.linalg.norm(skeleton.bones[1:], axis=1) * skeleton.unit_m).max() < 1e-12
    )
    assert np.abs(track[:, 0].mean(axis=0)).max() < 1e-12
    assert record["origin_height_m"] == pytest.approx(-track[..., 2].min())
    assert np.ptp(track[:, 0, 2]) == pytest.approx(0.3 * 0.0254 / 0.45, rel=1e-3)  # the bob is kept


@given(turn=st.floats(-180, 180), first=st.integers(1, 60))
@settings(max_examples=6, deadline=None)
def test_turning_a_recording_about_the_vertical_changes_nothing(turn, first, tmp_path_factory):
    folder = tmp_path_factory.mktemp("turned")
    rng = np.random.default_rng(6)
    (folder / "s.asf").write_text(asf({name: rng.normal(size=3) for name in LIMBS}))
    (folder / "m.amc").write_text(walk(230, growth=1e-3))
    straight = cloud_of(folder, first_frame=first)
    (folder / "m.amc").write_text(walk(230, turn_deg=turn, growth=1e-3))
    assert np.abs(cloud_of(folder, first_frame=first).track - straight.track).max() < 1e-9


@given(frames=st.integers(8, 140), period=st.floats(60, 130), seed=st.integers(0, 99))
@settings(max_examples=25, deadline=None)
def test_any_recording_goes_round_without_a_jump(frames, period, seed):
    # A smooth motion that does not repeat within the recording, down to 67 ms: the seam must still
    # be smooth.
    rng = np.random.default_rng(seed)
    time = np.arange(frames)
    angle = 0.5 * np.sin(2 * np.pi * time / period + rng.uniform(0, 6)) + 0.1 * np.sin(
        2 * np.pi * time / 41
    )
    turned = rotation("x", angle[:, None] * rng.uniform(-1, 1, len(NODES)))
    root = np.stack([0 * time, 0.012 * time, 0.03 * np.sin(time / 9)], axis=1)
    motion = Motion(root, turned, rng.normal(size=(31, 3)) * 0.1, 120.0)
    start, end, fade, _ = find_cycle(motion)
    cycle, drift = closed(motion, start, end, fade)
    track = nodes_m(cycle)
    assert drift[1] == pytest.approx(0.012 * 120)
    # From the last frame to the first the cycle takes the very step that the recording takes at its
    # end.
    told = nodes_m(
        Motion(root - (time - start)[:, None] * [0, 0.012, 0], turned, motion.bones_m, 120.0)
    )
    assert np.abs((track[0] - track[-1]) - (told[end] - told[end - 1])).max() < 1e-12
    # The fade's weights have slope zero at both ends, so the change of speed there stays within
    # their curvature.
    gap = np.abs(told[end : end + fade] - told[start : start + fade]).max()
    change = np.abs(np.diff(np.concatenate([track[-2:], track, track[:2]]), n=2, axis=0)).max()
    usual = np.abs(np.diff(told, n=2, axis=0)).max()
    speeds = np.abs(np.diff(told, axis=0)).max()
    assert change <= usual + 8 * gap / fade**2 + 6 * speeds / fade + 8 * gap**2 + 1e-12


def test_a_cycle_that_closes_badly_is_refused_with_its_mismatch(files):
    (files / "m.amc").write_text(walk(260, growth=0.02))
    with pytest.raises(
        InputError, match=r"frames \d+ to \d+, closes to 0\.\d+ m .* max_mismatch_m = 0.01 m"
    ):
        cloud_of(files, max_mismatch_m=0.01)
    kept = cloud_of(files, max_mismatch_m=5)
    gap = kept.record["loop_mismatch_m"]
    assert gap > 0.01 and f"31 points, mocap (closes to {100 * gap:.2g} cm), " in caption(kept)


@pytest.mark.slow
def test_a_long_recording_is_searched_in_little_memory():
    rng = np.random.default_rng(1)
    frames = 3000
    time = np.arange(frames)
    turned = np.broadcast_to(np.eye(3), (frames, len(NODES), 3, 3))
    root = np.stack([0 * time, 0.012 * time, 0.03 * np.sin(time / 9)], axis=1)
    motion = Motion(root, turned, rng.normal(size=(31, 3)) * 0.1, 120.0)
    tracemalloc.start()
    find_cycle(motion)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # One matrix of all pairs would take 8 * 3000^2 bytes, 72 MB, and the search held several.
    assert peak < 60e6
