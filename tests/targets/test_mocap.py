"""Recordings: nodes against an independent conversion to BVH, and faults named by file and frame."""

import math
import re

import numpy as np
import pytest

from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.targets.mocap_files import read_motion, read_skeleton
from lowalt.targets.mocap_joints import read_bvh, to_nodes
from lowalt.targets.mocap_motion import FROM_FILE, nodes_m, posed
from lowalt.targets.skeleton import NODES
from real_inputs import FOLDER, needs_inputs
from tables import rows
from walkers import CHANNELS, PUBLISHED, cloud_of, walk, write_files


@pytest.fixture
def files(tmp_path):
    return write_files(tmp_path)


@needs_inputs
def test_a_motion_s_nodes_are_the_joints_of_an_independent_conversion_to_bvh():
    folder = FOLDER / "cmu" / "131"
    skeleton = read_skeleton(folder / "131.asf")
    channels = read_motion(folder / "131_01.amc", skeleton)[0]
    joints, rate = read_bvh(folder / "131_01.bvh")
    assert rate == pytest.approx(120, rel=1e-5)
    unit = 0.0254 / 0.45
    names = load_yaml("tests/data/tables/cmu_joints.yaml")
    same = names["below the thorax"]
    above = names["above the thorax"]
    positions = nodes_m(posed(skeleton, channels, 120)) @ FROM_FILE
    assert positions.shape == (994, 31, 3)
    for node, joint in same.items():
        assert np.abs(positions[:, NODES.index(node)] - joints[joint] * unit).max() < 5e-5, node
    legs = [
        NODES.index(side + name)
        for side in "lr"
        for name in ("hipjoint", "femur", "tibia", "foot", "toes")
    ]
    assert np.abs((to_nodes(joints, "131_01.bvh") * unit - positions)[:, legs]).max() < 5e-5
    # The conversion leaves the bone `thorax` out: without its length what hangs on it agrees too.
    skeleton.bones[NODES.index("thorax")] = 0
    positions = nodes_m(posed(skeleton, channels, 120)) @ FROM_FILE
    for node, joint in (same | above).items():
        assert np.abs(positions[:, NODES.index(node)] - joints[joint] * unit).max() < 5e-5, node


def test_rest_pose_and_one_turned_joint_are_exact(files):
    skeleton = read_skeleton(files / "s.asf")
    channels = {"root": np.zeros((2, 6))}
    channels |= {name: np.zeros((2, len(dofs.split()))) for name, dofs in CHANNELS.items()}
    channels["root"][1] = [1, 2, 3, 0, 90, 0]
    channels["lfemur"][1] = [90, 0, 0]
    positions = nodes_m(posed(skeleton, channels, 120)) / (0.0254 / 0.45)
    # Rest: the sum of the bones; x left, y up, z front becomes -x, z, y.
    hip = NODES.index("lhipjoint")
    knee = NODES.index("lfemur")
    left, up, ahead = skeleton.bones[hip]
    assert np.allclose(positions[0, hip], [-left, ahead, up], atol=1e-12)
    assert np.allclose(positions[0, knee] - positions[0, hip], [0, 0, -7], atol=1e-12)
    # Root at (1, 2, 3) turned by 90 degrees about up: file z goes to file x, so the hip's bone
    # turns with it.
    assert np.allclose(positions[1, 0], [-1, 3, 2], atol=1e-12)
    assert np.allclose(positions[1, hip] - positions[1, 0], [-ahead, -left, up], atol=1e-12)
    # The thigh turned by 90 degrees about x points along the file's -z, which the root has turned
    # to -x.
    assert np.allclose(positions[1, knee] - positions[1, hip], [7, 0, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("pattern", "text", "times", "record", "words"), rows("recordings", "motions")
)
def test_faults_are_named_by_file_and_frame(pattern, text, times, record, words, files):
    motion = files / "m.amc"
    changed, count = re.subn(pattern, text, motion.read_text(), count=times)
    assert count == (times or 1)
    motion.write_text(changed)
    with pytest.raises(InputError, match=rf"m\.amc.*{words}"):
        cloud_of(files, **record)


def test_a_person_who_stands_still_is_refused(files):
    (files / "m.amc").write_text(walk(200, speed=0.0))
    with pytest.raises(InputError, match=r"m\.amc.*moves 0\.000 m/s"):
        cloud_of(files)


def test_frames_with_faults_may_be_left_out(files):
    text = re.sub("root .*", "root 0 0 0 0 0 0", (files / "m.amc").read_text(), count=4)
    (files / "m.amc").write_text(text[: text.rindex("ltibia")])
    first, last = cloud_of(files, first_frame=5, last_frame=259).record["frames_used"]
    assert 5 <= first < last <= 259


@pytest.mark.parametrize(
    ("old", "new", "names"),
    rows("recordings", "skeletons"),
)
def test_bad_skeletons_are_refused_by_file(files, old, new, names):
    text = (files / "s.asf").read_text()
    assert old in text
    (files / "s.asf").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=names) as error:
        read_skeleton(files / "s.asf")
    assert "s.asf" in str(error.value)


@pytest.mark.parametrize(
    ("changes", "names"),
    rows("recordings", "records"),
)
def test_bad_records_are_refused_by_name(files, changes, names):
    with pytest.raises(InputError, match=names):
        cloud_of(files, **changes)


def test_angles_in_radians_give_the_same_track(files):
    expected = cloud_of(files).track
    lines = []
    for line in (files / "m.amc").read_text().split("\n"):
        words = line.split()
        if len(words) > 1 and not words[0].startswith((":", "#")):
            first = 4 if words[0] == "root" else 1
            words[first:] = [repr(math.radians(float(word))) for word in words[first:]]
        lines.append(" ".join(words))
    text = "\n".join(lines)
    assert ":DEGREES" in text
    (files / "m.amc").write_text(text.replace(":DEGREES", ":RADIANS"))
    assert np.abs(cloud_of(files).track - expected).max() < 1e-12


def test_height_is_the_published_one_unless_the_record_says_none(files):
    scaled = cloud_of(files)
    plain = cloud_of(files, scale="none")
    factor = PUBLISHED["hgt_m"] / plain.record["recorded_stature_m"]
    assert np.allclose(scaled.track, plain.track * factor, atol=1e-12)
    assert scaled.record["track_speed_mps"] == pytest.approx(
        plain.record["track_speed_mps"] * factor
    )
