"""Robots' own descriptions.

Each joint of a rotor or wheel becomes a part that turns about the right line.
"""

from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml

from lowalt.__main__ import main
from lowalt.extensions.drafting.robot_files import read_robot
from lowalt.extensions.drafting.robots import Joint, parts_of
from lowalt.files.errors import InputError, InputWarning
from lowalt.targets.cloud import Cloud, read
from made_robots import HUBS, MJCF, SDF, urdf

pytestmark = pytest.mark.usefixtures("without_target_picture")


def folder(tmp_path: Path) -> Path:
    """A folder of inputs with the package `craft` and its propeller."""
    (tmp_path / "craft" / "meshes").mkdir(parents=True)
    trimesh.creation.box((240, 20, 4)).export(tmp_path / "craft/meshes/prop.stl")
    return tmp_path


def joints(
    path: Path, inputs: Path, kind: str = "rotor"
) -> tuple[dict[str, Joint], dict[str, np.ndarray]]:
    """Joints and triangles of a description's parts."""
    return parts_of(read_robot(path, inputs), kind)


def made(path: Path, inputs: Path, *words: str) -> tuple[dict, Cloud]:
    """The record that `target new` drafts of a description, and the cloud of it."""
    out = inputs / "own.yaml"
    assert (
        main(["target", "new", str(path), "--inputs", str(inputs), "--out", str(out), *words]) == 0
    )
    assert main(f"target make {out} --inputs {inputs} --out {inputs}/own.npz".split()) == 0
    return yaml.safe_load(out.read_text()), read(inputs / "own.npz")


def test_a_urdf_s_rotors_turn_about_their_joints_without_a_question(tmp_path):
    inputs = folder(tmp_path)
    (inputs / "craft/craft.urdf").write_text(urdf())
    records, cloud = made(inputs / "craft/craft.urdf", inputs)
    (record,) = records.values()
    assert (
        list(records) == ["craft"]
        and record["row"]["size_m"] == pytest.approx(0.5)
        and record["front"] == "x"
    )
    assert cloud.kinds == ("body", *("rotor",) * 4) and cloud.names[1:] == tuple(HUBS)
    # x is the front and y the left, so right is -y.
    np.testing.assert_allclose(cloud.hinges[1:, :2], [(-y, x) for x, y in HUBS.values()], atol=1e-6)
    np.testing.assert_allclose(np.abs(cloud.axes[1:, 2]), 1, atol=1e-9)
    senses = np.sign(cloud.axes[1:, 2])
    assert senses[0] == senses[1] != senses[2] == senses[3]  # neighbours turn against each other
    for part in range(1, 5):
        blade = cloud.points[cloud.part == part] - cloud.hinges[part]
        assert np.linalg.norm(blade[:, :2], axis=1).max() == pytest.approx(0.12, rel=0.01)
        along = blade[np.argmax(np.linalg.norm(blade, axis=1))]
        turned = (
            np.degrees(np.arctan2(-along[0], along[1]) - (part - 1)) % 180
        )  # its joint's own turn, in radians
        assert min(turned, 180 - turned) < 6


def test_a_urdf_of_a_long_chain_that_hangs_on_an_undeclared_world_is_placed(tmp_path):
    links = "".join(f'<link name="l{n}"/>' for n in range(40))
    ends = [("world", "l0"), *((f"l{n}", f"l{n + 1}") for n in range(39))]
    fixed = "".join(
        f'<joint name="j{n}" type="fixed"><origin xyz="0 0 0.1"/><parent link="{parent}"/>'
        f'<child link="{child}"/></joint>'
        for n, (parent, child) in enumerate(ends)
    )
    turns = """<link name="prop"><visual><geometry><cylinder radius="0.1" length="0.01"/></geometry></visual></link>
<joint name="turn" type="continuous"><parent link="l39"/><child link="prop"/><axis xyz="0 0 1"/></joint>"""
    (tmp_path / "mast.urdf").write_text(f'<robot name="mast">{links}{fixed}{turns}</robot>')
    turning, surfaces = joints(tmp_path / "mast.urdf", tmp_path)
    assert list(turning) == ["prop"]
    assert surfaces["prop"].reshape(-1, 3)[:, 2].mean() == pytest.approx(4.0, abs=0.01)


def test_an_sdf_s_includes_frames_and_joint_poses_are_followed(tmp_path):
    (tmp_path / "base").mkdir()
    (tmp_path / "top").mkdir()
    undeclared = '<surface><fdir1 gz:expressed_in="hull">1 1 0</fdir1></surface></model>'
    (tmp_path / "base/base.sdf").write_text(SDF.replace("</model>", undeclared))
    (tmp_path / "base/model.config").write_text("<model><sdf version='1.9'>base.sdf</sdf></model>")
    top = """<sdf version="1.9"><model name="top"><include merge="true"><uri>model://base</uri></include>
    <link name="lift"><pose relative_to="pusher">0 0 0 0 0 0</pose><visual name="v"><geometry><sphere>
    <radius>0.05</radius></sphere></geometry></visual></link>
    <joint name="lift_rotor" type="continuous"><pose relative_to="hull">0.1 0 0.2 0 0 0</pose><parent>hull</parent>
    <child>lift</child><axis><xyz expressed_in="hull">0 0 -2</xyz></axis></joint>
    <plugin><jointName>lift_rotor</jointName><turningDirection>ccw</turningDirection></plugin>
    <include><name>eye</name><uri>base</uri><pose>0 0 5 0 0 0</pose></include></model></sdf>"""
    (tmp_path / "top/top.sdf").write_text(top)
    found, triangles = joints(tmp_path / "top/top.sdf", tmp_path)
    assert set(found) == {"pusher", "lift", "eye pusher"}
    # The link's own turn by a quarter about y takes its z, and the joint's shift along it, to the
    # front.
    np.testing.assert_allclose(found["pusher"].hinge, [-0.28, 0, 1], atol=1e-9)
    np.testing.assert_allclose(found["pusher"].axis, [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(found["eye pusher"].hinge, [-0.28, 0, 5], atol=1e-9)
    np.testing.assert_allclose(found["lift"].hinge, [0.1, 0, 1.2], atol=1e-9)
    np.testing.assert_allclose(found["lift"].axis, [0, 0, -1], atol=1e-9)
    np.testing.assert_allclose(triangles["pusher"].mean(axis=(0, 1))[:2], [-0.3, 0], atol=1e-9)
    np.testing.assert_allclose(
        np.ptp(triangles["pusher"].reshape(-1, 3), axis=0), [0.01, 0.2, 0.2], atol=1e-3
    )
    assert triangles["body"].reshape(-1, 3)[:, 1].max() == pytest.approx(0.3)  # the aileron is held
    at_its_hinge = top.replace('"pusher">0 0 0 0 0 0', '"hull">0.1 0 0.2 0 0 0').replace(
        "0 0 5 0", "0 0 1.2 0"
    )
    (tmp_path / "top/top.sdf").write_text(at_its_hinge)
    words = f"{tmp_path}/top/top.sdf --inputs {tmp_path} --out {tmp_path}/a".split()
    assert main(["target", "new", *words]) == 0
    parts = yaml.safe_load((tmp_path / "a").read_text())["top"]["parts"]
    assert parts["lift"]["sense"] == "cw"  # anticlockwise about an axis that points down
    (tmp_path / "old.sdf").write_text(SDF.replace('version="1.9"', 'version="1.4"'))
    found, _ = joints(tmp_path / "old.sdf", tmp_path)
    np.testing.assert_allclose(found["pusher"].axis, [0, 0, 1], atol=1e-9)  # along the model's axes


def test_an_mjcf_s_classes_angles_and_hinges_are_followed(tmp_path):
    trimesh.creation.box((24, 2, 0.4)).export(tmp_path / "prop.stl")
    (tmp_path / "a.xml").write_text(MJCF)
    found, triangles = joints(tmp_path / "a.xml", tmp_path)
    assert set(found) == {"rotor_a", "rotor_b"}
    np.testing.assert_allclose(found["rotor_a"].hinge, [0.4, 0, 0.5], atol=1e-9)
    np.testing.assert_allclose(found["rotor_a"].axis, [1, 0, 0], atol=1e-9)
    np.testing.assert_allclose(found["rotor_b"].axis, [0, 0, -1], atol=1e-9)
    np.testing.assert_allclose(
        np.ptp(triangles["rotor_a"].reshape(-1, 3), axis=0), [0.004, 0.02, 0.24], atol=1e-9
    )
    body = triangles["body"].reshape(-1, 3)
    assert np.ptp(body, axis=0)[0] == pytest.approx(0.3) and body[:, 1].max() == pytest.approx(
        0.21, abs=1e-6
    )


@pytest.mark.parametrize(
    ("version", "flag", "in_model"),
    [
        ("1.4", 0, True),
        ("1.6", 0, False),
        ("1.6", 1, True),
        ("1.7", 1, False),
        ("1.9", 0, False),
        ("1.10", 0, False),
        ("1.11", 0, False),
    ],
)
def test_an_sdf_s_axis_is_in_the_frame_that_its_version_says(version, flag, in_model, tmp_path):
    text = SDF.replace('version="1.9"', f'version="{version}"')
    text = text.replace(
        "<xyz>0 0 1</xyz>",
        f"<xyz>0 0 1</xyz><use_parent_model_frame>{flag}</use_parent_model_frame>",
    )
    (tmp_path / "a.sdf").write_text(text)
    found, _ = joints(tmp_path / "a.sdf", tmp_path)
    np.testing.assert_allclose(
        found["pusher"].axis, [0, 0, 1] if in_model else [1, 0, 0], atol=1e-9
    )


def test_a_namespace_an_optional_variable_and_macros_of_sensors_change_nothing(tmp_path):
    inputs = folder(tmp_path)
    plain = inputs / "craft/craft.urdf"
    other = inputs / "craft/other.urdf"
    plain.write_text(urdf())
    more = (
        '<gazebo reference="base"><a b="${c}"/></gazebo><link name="imu"/><joint name="imu"'
        ' type="fixed"><origin '
    )
    more += 'xyz="$(optenv IMU_XYZ 0.19 0 0.149)"/><parent link="base"/><child link="imu"/></joint>'
    other.write_text(urdf(more).replace("<robot ", '<robot xmlns="http://drake.mit.edu" '))
    expected = joints(plain, inputs)[0]
    found = joints(other, inputs)[0]
    assert list(found) == list(expected) == list(HUBS)
    for name in HUBS:
        np.testing.assert_array_equal(found[name].hinge, expected[name].hinge)
    other.write_text(urdf('<link name="a"><visual><origin xyz="${x} 0 0"/></visual></link>'))
    with pytest.raises(InputError, match="it holds macros"):
        joints(other, inputs)


def test_a_package_of_another_folder_s_name_is_found_where_one_file_fits(tmp_path):
    inputs = folder(tmp_path)
    (inputs / "craft").rename(inputs / "clone-of-craft")
    path = inputs / "craft.urdf"
    path.write_text(urdf())
    with pytest.warns(InputWarning, match=r"prop.stl' is taken from clone-of-craft/meshes/prop"):
        found, triangles = joints(path, inputs)
    assert list(found) == list(HUBS) and len(triangles["rotor_0"]) == 12
    (inputs / "second/meshes").mkdir(parents=True)
    (inputs / "second/meshes/prop.stl").write_bytes(
        (inputs / "clone-of-craft/meshes/prop.stl").read_bytes()
    )
    with pytest.raises(
        InputError, match=r"2 files below the folder of inputs fit \(.*\), expected one"
    ):
        joints(path, inputs)


def test_geoms_of_an_mjcf_that_are_named_rotors_are_rotors(tmp_path):
    geoms = "".join(
        f'<geom name="rotor{n}" type="ellipsoid" size=".13 .13 .01" pos="{x} {y} .08"/>'
        for n, (x, y) in enumerate(HUBS.values())
    )
    body = f'<body name="q"><freejoint/><geom type="box" size=".16 .04 .02"/>{geoms}</body>'
    (tmp_path / "x2.xml").write_text(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    _, cloud = made(tmp_path / "x2.xml", tmp_path)
    assert cloud.kinds == ("body", *("rotor",) * 4)
    hubs = np.sort(np.abs(cloud.hinges[1:, :2]), axis=1)
    np.testing.assert_allclose(hubs, np.tile([0.15, 0.2], (4, 1)), atol=0.01)


def test_a_plane_with_one_wheel_and_a_motor_is_asked_for_its_category_and_a_surface_must_have_triangles(
    tmp_path,
):
    turning = "".join(
        f'<link name="{name}"><visual><geometry><box'
        f' size="{size}"/></geometry></visual></link><joint name="{name}_joint"'
        f' type="continuous"><origin xyz="{at}"/><parent link="base"/><child link="{name}"/><axis'
        f' xyz="{axis}"/></joint>'
        for name, size, at, axis in (
            ("main_wheel", "0.1 0.03 0.1", "0 0 -0.1", "0 1 0"),
            ("motor", "0.01 0.2 0.02", "0.4 0 0", "1 0 0"),
        )
    )
    base = (
        '<link name="base"><visual><geometry><box size="0.6 1.2 0.08"/></geometry></visual></link>'
    )
    path = tmp_path / "plane.urdf"
    path.write_text(f'<robot name="p">{base}{turning}</robot>')
    words = f"target new {path} --inputs {tmp_path} --out {tmp_path}/a.yaml".split()
    assert main(words) == 2
    assert main([*words, "--category", "UAV"]) == 0
    assert list(yaml.safe_load((tmp_path / "a.yaml").read_text())["plane"]["parts"]) == [
        "body",
        "motor",
    ]
    (tmp_path / "empty.obj").write_text("v 0 0 0\n")
    path.write_text(
        path.read_text().replace('<box size="0.6 1.2 0.08"/>', '<mesh filename="empty.obj"/>')
    )
    with pytest.raises(InputError, match=r"'empty\.obj' has no triangle, expected a surface"):
        read_robot(path, tmp_path)


def test_a_rover_s_cylinders_become_wheels_with_a_row_of_its_size(tmp_path, capsys):
    wheels = "".join(
        f'<link name="wheel_{index}"><visual><origin rpy="1.5708 0 0"/><geometry><cylinder'
        f' radius="0.1" length="0.06"/></geometry></visual></link><joint name="axle_{index}"'
        f' type="continuous"><origin xyz="{x} {y} 0.1"/><parent link="base"/><child'
        f' link="wheel_{index}"/><axis xyz="0 1 0"/></joint>'
        for index, (x, y) in enumerate([(0.3, 0.2), (0.3, -0.2), (-0.3, 0.2), (-0.3, -0.2)])
    )
    text = (
        '<robot name="r"><link name="base"><visual><origin xyz="0 0 0.25"/><geometry><box size="0.8'
        ' 0.3 0.2"/>'
    )
    (tmp_path / "rover.urdf").write_text(f"{text}</geometry></visual></link>{wheels}</robot>")
    records, cloud = made(tmp_path / "rover.urdf", tmp_path)
    row = records["rover"]["row"]
    assert row["category"] == "Vehicle" and row["wheel_diam_m"] == pytest.approx(0.2, rel=0.01)
    assert cloud.kinds == ("body", *("wheel",) * 4)
    np.testing.assert_allclose(np.ptp(cloud.points, axis=0), [0.46, 0.8, 0.35], rtol=0.02)
    path = tmp_path / "two.urdf"
    path.write_text((tmp_path / "rover.urdf").read_text().replace("continuous", "fixed", 2))
    before = sorted(tmp_path.rglob("*"))
    assert (
        main(["target", "new", str(path), "--inputs", str(tmp_path), "--subtype", "AITO M9 2024"])
        == 2
    )
    assert "2 wheels turn, expected 4 for AITO M9 2024: leave --subtype" in capsys.readouterr().err
    assert sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("name", "seen"), [("drum_", "neither rotors nor wheels"), ("wheel_", "both rotors and wheels")]
)
def test_a_description_whose_names_tell_no_category_is_refused_until_it_is_given(
    name, seen, tmp_path, capsys
):
    path = folder(tmp_path) / "craft/craft.urdf"
    path.write_text(urdf().replace("rotor_", name, -1 if name == "drum_" else 6))
    command = f"target new {path} --inputs {tmp_path} --out {tmp_path}/a.yaml".split()
    assert main(command) == 2
    error = capsys.readouterr().err
    assert seen in error and "--category Vehicle" in error and error.count("\n") == 1
    assert main([*command, "--category", "UAV"]) == 0


def test_a_description_whose_propellers_are_fixed_is_looked_at_like_a_mesh(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    inputs = folder(tmp_path)
    path = inputs / "craft/craft.urdf"
    path.write_text(urdf().replace("continuous", "fixed"))
    command = f"target new {path} --inputs {inputs} --out".split()
    assert main([*command, "named.yaml"]) == 0  # the links' names tell their number
    path.write_text(urdf().replace("continuous", "fixed").replace("rotor_", "disc_"))
    assert main([*command, "a.yaml"]) == 2
    error = capsys.readouterr().err
    assert (
        "its category cannot be seen" in error
        and "--category UAV" in error
        and "with --rotors N" in error
    )
    assert main([*command, "a.yaml", "--category=UAV"]) == 0
    for name in ("named", "a"):
        parts = yaml.safe_load((inputs / f"{name}.yaml").read_text())["craft"]["parts"]
        assert len(parts) == 5 and (inputs / f"{name}.glb").exists()


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            urdf(blade="package://craft/meshes/gone.stl"),
            "'package://craft/meshes/gone.stl' is not there",
        ),
        (urdf(blade="../../outside.stl"), "lies outside the folder of inputs"),
        (urdf(blade="/etc/passwd"), "lies outside the folder of inputs"),
        (urdf(blade="meshes/link.stl"), "lies outside the folder of inputs"),
        (urdf(blade="file:///etc/passwd"), "lies outside the folder of inputs"),
        (urdf(blade="https://example.org/a.stl"), "is no file of the folder of inputs"),
        (urdf(base='<box size="a b c"/>'), "not a readable description"),
        (urdf(base="<box/>"), "expected 3 finite numbers"),
        (
            '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]>' + urdf(),
            "it declares a document type",
        ),
        (
            urdf('<xacro:a xmlns:xacro="http://x/xacro"/>'),
            "it holds macros, expected what they expand to: xacro FILE",
        ),
        ("<html/>", "<html>, expected one of"),
        ('<robot name="a"><link name="b"/></robot>', "no surface of finite places"),
        (
            '<sdf><model name="a"><include><uri>self.urdf</uri></include></model></sdf>',
            "in a circle|at most 200",
        ),
        (
            (
                '<sdf><model name="a"><link name="l"><pose relative_to="l">0 0 0 0 0'
                " 0</pose><visual "
                'name="v"><geometry>'
                "<sphere><radius>1</radius></sphere></geometry></visual></link></model></sdf>"
            ),
            "hangs on itself",
        ),
    ],
)
def test_a_description_that_is_wrong_or_reaches_outside_is_refused_by_name(text, words, tmp_path):
    (tmp_path / "outside.stl").write_bytes(trimesh.creation.box().export(file_type="stl"))
    inputs = folder(tmp_path / "inputs")
    (inputs / "craft/meshes/link.stl").symlink_to(tmp_path / "outside.stl")
    (inputs / "craft/self.urdf").write_text(text)
    with pytest.raises(InputError, match=rf"self\.urdf: .*({words})"):
        read_robot(inputs / "craft/self.urdf", inputs)
    (inputs / "b.urdf.xacro").write_text("")
    with pytest.raises(
        InputError, match=r"is a template, expected what it .* xacro b.urdf.xacro > robot.urdf"
    ):
        read_robot(inputs / "b.urdf.xacro", inputs)
