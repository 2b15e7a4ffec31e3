"""Recordings as people have them: BVH, arrays of joints, CMU's clips.

AMC files come with other rates, cuts and marks.
"""

from itertools import pairwise

import numpy as np
import pytest

from lowalt.files.errors import InputError, InputWarning
from lowalt.targets.mocap_files import read_motion, read_skeleton
from lowalt.targets.mocap_joints import SMPL, moved, read_bvh, to_nodes
from lowalt.targets.mocap_motion import nodes_m, posed
from lowalt.targets.skeleton import NODES, PARENTS
from real_inputs import FOLDER, needs_inputs
from walkers import BVH, cloud_of, walk, write_files


@pytest.fixture
def files(tmp_path):
    return write_files(tmp_path)


def numbered(text: str, first: int) -> str:
    """The text of a motion whose frames are numbered from `first`."""
    return "\n".join(
        str(int(line) + first - 1) if line.isdecimal() else line for line in text.splitlines()
    )


def test_a_cut_clip_with_a_byte_order_mark_and_comments_is_the_same_clip(files):
    plain = read_motion(files / "m.amc", read_skeleton(files / "s.asf"))[0]
    text = (
        numbered(walk(260), 40)
        .replace("ltibia", "# a note\nltibia")
        .replace(":DEGREES", ":DEGREES # of angle")
    )
    (files / "m.amc").write_text("\ufeff" + text.replace("5 0\n", "5 0 # tired\n"))
    (files / "s.asf").write_text("\ufeff" + (files / "s.asf").read_text())
    found = read_motion(files / "m.amc", read_skeleton(files / "s.asf"))[0]
    for name, values in plain.items():
        np.testing.assert_array_equal(found[name], values)
    assert cloud_of(files).record["frames_used"][0] >= 40
    later = read_motion(files / "m.amc", read_skeleton(files / "s.asf"), 50, 59)[0]
    np.testing.assert_array_equal(later["root"], plain["root"][10:20])


def test_every_second_frame_of_a_walk_is_refused_with_the_rate_to_write(files):
    # Steps of 0.77 m, 1.85 a second, at 120 frames a second.
    (files / "m.amc").write_text(walk(400, period=130, speed=0.2))
    right = cloud_of(files, rate_hz=None).record
    (files / "m.amc").write_text(walk(400, period=65, speed=0.4))
    with pytest.raises(
        InputError,
        match=r"m\.amc: at 120 frames per second .* `rate_hz: 60`, or to insist `rate_hz: 120`",
    ):
        cloud_of(files, rate_hz=None)
    assert cloud_of(files, rate_hz=60).record["track_speed_mps"] == pytest.approx(
        right["track_speed_mps"], rel=0.02
    )
    (files / "m.amc").write_text(walk(800, period=260, speed=0.1))
    with pytest.raises(InputError, match="`rate_hz: 240`"):
        cloud_of(files, rate_hz=None)


@needs_inputs
@pytest.mark.parametrize("clip", ["02/02_01", "02/02_03", "05/05_01", "07/07_01", "09/09_01"])
def test_real_walks_and_runs_pass_at_their_rate_and_not_at_twice_it(clip, tmp_path):
    folder = clip.split("/")[0]
    text = (FOLDER / f"cmu/{clip}.amc").read_text().splitlines()
    (tmp_path / "s.asf").write_text((FOLDER / f"cmu/{folder}/{folder}.asf").read_text())
    frames = [index for index, line in enumerate(text) if line.isdecimal()] + [len(text)]
    half = [
        f"{n + 1}\n" + "\n".join(text[a + 1 : b])
        for n, (a, b) in enumerate(list(pairwise(frames))[::2])
    ]
    (tmp_path / "m.amc").write_text("\n".join(text))
    cloud_of(tmp_path, rate_hz=None)
    (tmp_path / "m.amc").write_text("\n".join([":DEGREES", *half]))
    with pytest.raises(InputError, match=r"`rate_hz: 60`|for a cycle of a walk"):
        cloud_of(tmp_path, rate_hz=None)


def test_a_long_recording_of_which_a_few_frames_are_used_says_which(files):
    (files / "m.amc").write_text(walk(1500, period=62, growth=1e-4))
    with pytest.warns(
        InputWarning, match=r"of 1500 frames \d+ to \d+ are used.*first_frame and last_frame"
    ):
        cloud_of(files)


def joints_of(track: np.ndarray, names: dict[str, str]) -> np.ndarray:
    """Joint positions (F, J, 3) in SMPL's order from nodes (F, 31, 3).

    Spine and collars lie on straight lines.
    """
    at = {name: track[:, NODES.index(node)] for name, node in names.items()}
    spine = at["neck"] - at["pelvis"]
    at |= {f"spine{k}": at["pelvis"] + k / 4 * spine for k in (1, 2, 3)}
    at |= {f"{side}collar": at["neck"] for side in ("left", "right")}
    return np.stack([at[name] for name in SMPL], axis=1)


SAME = {"pelvis": "root", "neck": "thorax", "head": "upperneck"} | {
    f"{side}{joint}": side[0] + node
    for side in ("left", "right")
    for joint, node in {
        "hip": "hipjoint",
        "knee": "femur",
        "ankle": "tibia",
        "toe": "foot",
        "shoulder": "clavicle",
        "elbow": "humerus",
        "wrist": "radius",
    }.items()
}


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 2, 0]])
def test_joint_positions_of_a_walk_make_the_walk(order, files, tmp_path):
    skeleton = read_skeleton(files / "s.asf")
    track = nodes_m(posed(skeleton, read_motion(files / "m.amc", skeleton)[0], 120))
    np.savez(
        tmp_path / "walk.npz", joints=joints_of(track, SAME)[..., order], mocap_framerate=120.0
    )
    cloud = cloud_of(tmp_path, skeleton=None, motion="walk.npz", scale="none")
    same = cloud_of(files, scale="none")
    assert cloud.record["track_speed_mps"] == pytest.approx(
        same.record["track_speed_mps"], rel=0.02
    )
    assert len(cloud.track) == len(same.track)
    legs = [
        NODES.index(side + name) for side in "lr" for name in ("hipjoint", "femur", "tibia", "foot")
    ]
    # The cycles may begin a frame apart.
    away = [np.sort(found.track[:, legs] - found.track[:, :1], axis=0) for found in (cloud, same)]
    np.testing.assert_allclose(*away, atol=0.01)


def test_a_motion_of_positions_puts_every_node_where_it_was():
    rng = np.random.default_rng(3)
    bones = rng.normal(loc=[0, 0, 0.3], size=(31, 3))
    bones[:, 2] += 2.0 * np.array(
        [1 if name in ("head", "thorax", "lowerneck") else 0 for name in NODES]
    )
    turn = np.cumsum(rng.normal(scale=0.02, size=(20, 31, 3)), axis=0)
    steps = bones + np.cross(turn, bones)
    steps *= (np.linalg.norm(bones, axis=1) / np.linalg.norm(steps, axis=2))[..., None]
    track = np.zeros((20, 31, 3))
    for node in range(1, 31):
        track[:, node] = track[:, PARENTS[node]] + steps[:, node]
    motion = moved(track, 100, None, "a")
    axis = int(
        np.abs(
            np.mean(track[:, NODES.index("head")] - track[:, NODES.index("ltibia")], axis=0)
        ).argmax()
    )
    found = nodes_m(motion)
    np.testing.assert_allclose(
        np.linalg.norm(found, axis=2), np.linalg.norm(track, axis=2), atol=1e-9
    )
    np.testing.assert_allclose(np.abs(found[..., 2]), np.abs(track[..., axis]), atol=1e-9)


def test_a_bvh_s_channels_turn_in_their_order(tmp_path):
    (tmp_path / "a.bvh").write_text("\ufeff" + BVH)
    joints, rate = read_bvh(tmp_path / "a.bvh")
    assert rate == 50
    np.testing.assert_allclose(joints["Hips"], [[1, 2, 3], [0, 0, 0]])
    np.testing.assert_allclose(joints["Spine"], [[-1, 2, 3], [0, 2, 0]], atol=1e-12)
    np.testing.assert_allclose(joints["Spine/end"], [[-1, 2, 6], [-3, 2, 0]], atol=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (BVH.replace("0.02", "0"), "not a readable BVH"),
        (BVH.replace("Frames: 2", "Frames: 3"), "expected 3 frames of 9"),
        (BVH.replace("90 0\n0", "90 nan\n0"), "not a readable BVH"),
        ("", "not a readable BVH"),
        (BVH, "no joint is called a left ankle, expected .'ankle', 'foot'."),
    ],
)
def test_a_bvh_that_is_wrong_or_of_no_person_is_refused_by_name(text, words, tmp_path):
    (tmp_path / "a.bvh").write_text(text)
    with pytest.raises(InputError, match=rf"a\.bvh: .*{words}"):
        to_nodes(read_bvh(tmp_path / "a.bvh")[0], str(tmp_path / "a.bvh"))


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"poses": np.zeros((5, 156))}, "expected `joints`"),
        ({"joints": np.zeros((5, 9, 3))}, r"shape \(5, 9, 3\)"),
        ({"joints": np.full((5, 22, 3), np.nan)}, "says no rate"),
        ({"joints": np.full((5, 22, 3), np.nan), "fps": 30.0}, "not finite"),
    ],
)
def test_an_array_of_joints_that_is_wrong_is_refused_by_name(arrays, words, tmp_path):
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(InputError, match=rf"a\.npz: .*{words}"):
        cloud_of(tmp_path, skeleton=None, rate_hz=None, motion="a.npz")


FAULTS = {
    "07/07_12": ("frame 245 lacks .'ltoes'", {"last_frame": 244}),
    "09/09_10": ("frame 1 has an all-zero root", {"first_frame": 5}),
    "35/35_01": ("frame (99|100|101): .*(foot|toes|tibia) accelerates", {"first_frame": 104}),
    # It starts, walks and stops: no two frames are alike enough.
    "131/131_01": ("the best cycle, .* closes to 0.281 m", {"max_mismatch_m": 0.3}),
}
"""Recordings that are refused as they are, why, and the keys with which they become clouds."""


@needs_inputs
def test_every_real_recording_that_walks_or_runs_becomes_a_cloud_where_its_known_faults_are_left_out():
    paths = sorted((FOLDER / "cmu").glob("*/*.amc"))
    assert len(paths) >= 15
    for path in paths:
        subject = path.parent.name
        name = f"{path.parent.name}/{path.stem}"
        record = {"skeleton": f"cmu/{subject}/{subject}.asf", "motion": f"cmu/{name}.amc"}
        message, trim = FAULTS.get(name, ("", {}))
        if message:
            with pytest.raises(InputError, match=rf"{path.name}: {message}"):
                cloud_of(FOLDER, **record)
        cloud = cloud_of(FOLDER, **record, **trim)
        assert 0.7 < cloud.record["track_speed_mps"] < 4.5
        track = cloud.track
        ahead = track[:, NODES.index("ltoes"), 1] - track[:, NODES.index("ltibia"), 1]
        assert (
            ahead.mean() > 0 and track[:, NODES.index("lhipjoint"), 0].mean() < 0
        )  # faces front, left is left
        assert track[:, NODES.index("head"), 2].mean() > 0.5
    bvh = cloud_of(
        FOLDER, skeleton=None, rate_hz=None, motion="cmu/131/131_01.bvh", max_mismatch_m=0.4
    )
    assert np.ptp(bvh.points[:, 2]) == pytest.approx(1.75, rel=0.1)


def test_a_person_without_a_neck_or_toes_and_with_shins_is_the_same_person():
    rng = np.random.default_rng(3)
    names = (
        "Hips",
        "Head",
        *(
            f"{side}{part}"
            for side in ("Left", "Right")
            for part in ("Hip", "Knee", "Ankle", "Toe", "Shoulder", "Elbow", "Wrist")
        ),
    )
    joints = {name: rng.normal(size=(4, 3)) for name in names}
    neck = (joints["LeftShoulder"] + joints["RightShoulder"]) / 2
    expected = to_nodes(joints | {"Neck": neck}, "a")
    np.testing.assert_array_equal(to_nodes(joints, "a"), expected)
    for old, new in (("Hip", "Leg"), ("Knee", "Shin"), ("Ankle", "Foot")):
        joints |= {f"{side}{new}": joints.pop(f"{side}{old}") for side in ("Left", "Right")}
    np.testing.assert_array_equal(to_nodes(joints, "a"), expected)
    joints |= {f"{side}Foot/end": joints.pop(f"{side}Toe") for side in ("Left", "Right")}
    np.testing.assert_array_equal(to_nodes(joints, "a"), expected)
