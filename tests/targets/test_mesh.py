"""Users' meshes, made and real: places, axes, units and formats, parts that turn, regions."""

import os
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.files.errors import InputError, InputWarning
from lowalt.targets import cloud as clouds
from lowalt.targets.mesh_files import read_mesh, suffixes
from lowalt.targets.record_schema import record_files
from lowalt.targets.records import read_records
from lowalt.targets.surfaces import volume
from meshes import ROOT, TABLE, box, car_record, made, plain, quad_record, saved, write_quad
from real_inputs import FOLDER, needs_inputs
from snakemake_runs import run


def test_places_senses_and_sizes_are_those_of_the_record(quad):
    cloud = made("DJI Mini 2", quad, **quad_record())
    factor = 0.2192 / np.hypot(0.2, 0.2)
    assert cloud.names[1:] == ("front left", "front right", "rear left", "rear right")
    # The file's x is the front, so its -y is the right.
    assert np.allclose(cloud.hinges[2, :2], np.array([0.1, 0.1]) * factor, atol=5e-4)
    assert np.allclose(cloud.axes[1:, 2], [-1, 1, 1, -1], atol=1e-3)
    assert np.ptp(cloud.points[cloud.part == 0], axis=0) == pytest.approx(
        np.array([0.12, 0.2, 0.06]) * factor, rel=3e-3
    )
    assert cloud.record["points_by_part"]["front right"] == np.sum(cloud.part == 2)
    assert np.sum(cloud.part > 0) / 171 == pytest.approx(cloud.record["moving_share"], abs=0.02)


def test_found_hinge_and_axis_are_those_given(quad):
    # A propeller tilted by 20 degrees about the file's y: the thinnest direction is its axis.
    record = quad_record()
    tilt = {"axis": "y", "deg": 20}
    record["parts"]["front left"]["meshes"] = [
        {"file": "prop.stl", "turn": tilt, "move": [0.1, 0.1, 0.04]}
    ]
    cloud = made("DJI Mini 2", quad, **record)
    # Turned by 20 degrees about y, the file's z leans to its x, the front; clockwise turns the axis
    # round.
    assert np.allclose(
        cloud.axes[1], -np.array([0, np.sin(np.radians(20)), np.cos(np.radians(20))]), atol=2e-3
    )


@given(
    up=st.sampled_from(["x", "-x", "y", "-y", "z", "-z"]),
    front=st.sampled_from(["x", "-x", "y", "-y", "z", "-z"]),
)
@settings(max_examples=12, deadline=None)
def test_axes_of_the_file_do_not_matter_if_the_record_names_them(up, front, tmp_path_factory):
    if up[-1] == front[-1]:
        return
    vectors = {
        axis: np.eye(3)["xyz".index(axis[-1])] * (-1 if axis[0] == "-" else 1)
        for axis in (up, front)
    }
    frame = np.stack([np.cross(vectors[front], vectors[up]), vectors[front], vectors[up]])
    folder = tmp_path_factory.mktemp("axes")
    shape = trimesh.util.concatenate(
        [box((0.1, 0.2, 0.05)), box((0.02, 0.02, 0.02), (0.03, 0.09, 0.1))]
    )
    shape.vertices = shape.vertices @ frame  # from body axes to the file's
    shape.export(folder / "body.obj")
    cloud = made("DJI Mini 2", folder, **plain("body.obj", up=up, front=front))
    assert np.ptp(cloud.points, axis=0) == pytest.approx([0.1, 0.2, 0.135], rel=1e-6)
    high = cloud.points[cloud.points[:, 2] > 0.03]
    assert (high[:, 0] > 0.01).all() and (
        high[:, 1] > 0.07
    ).all()  # the mast stands ahead on the right


@pytest.mark.parametrize(
    ("suffix", "unit", "metres"),
    [(suffix, "m", 1.0) for suffix in suffixes()]
    + [(suffix, "in", 0.0254) for suffix in (".stl", ".obj")],
)
def test_every_format_and_unit_gives_the_same_size(suffix, unit, metres, tmp_path):
    shape = box(np.array([0.1, 0.2, 0.05]) / metres)
    path = tmp_path / f"box{suffix}"
    shape.export(path)
    found = read_mesh(path, unit)
    assert len(found.faces) == 12 and found.closed.tolist() == [True]
    assert np.ptp(found.vertices, axis=0) == pytest.approx([0.1, 0.2, 0.05], rel=1e-6)
    assert volume(found) == pytest.approx(0.001, rel=1e-6)


def test_a_record_s_unit_overrides_the_file_s_with_a_warning(tmp_path):
    plain_dae = box((100, 200, 50)).export(file_type="dae")
    stating = plain_dae.replace(b"<asset>", b'<asset><unit name="half" meter="0.5"/>')
    (tmp_path / "box.dae").write_bytes(stating)
    with pytest.warns(
        InputWarning, match=r"box.dae: the file states a unit of 0.5 m, the record says 0.001"
    ):
        found = read_mesh(tmp_path / "box.dae", 0.001)
    assert np.ptp(found.vertices, axis=0) == pytest.approx([0.1, 0.2, 0.05])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        read_mesh(tmp_path / "box.dae", 0.5)
        (tmp_path / "plain.dae").write_bytes(plain_dae)
        read_mesh(tmp_path / "plain.dae", "in")


def test_equal_record_and_seed_give_equal_bytes(quad, tmp_path):
    for name, seed in (("a", 1), ("b", 1), ("c", 2)):
        clouds.write(tmp_path / f"{name}.npz", made("DJI Mini 2", quad, seed, **quad_record()))
    first, second, other = ((tmp_path / f"{name}.npz").read_bytes() for name in "abc")
    assert first == second != other


def test_normals_point_outward_also_where_the_file_is_inside_out_or_mirrored(tmp_path):
    shape = box((0.1, 0.2, 0.05), (0.3, 0, 0))
    shape.invert()
    shape.export(tmp_path / "inside_out.stl")
    for item in (
        {"file": "inside_out.stl"},
        {"file": "inside_out.stl", "mirror": "x", "turn": {"axis": "z", "deg": 90}},
    ):
        parts = {"body": {"kind": "body", "meshes": [item]}}
        cloud = made("DJI Mini 2", tmp_path, **plain("", parts=parts))
        assert (np.einsum("ij,ij->i", cloud.normals, cloud.points) > 0).all()


def test_open_surface_is_sampled_as_triangle_soup(tmp_path):
    shape = box((0.1, 0.2, 0.05))
    shape.update_faces(shape.face_normals[:, 2] < 0.5)  # the lid is gone
    soup = trimesh.Trimesh(
        shape.triangles.reshape(-1, 3),
        np.arange(3 * len(shape.faces)).reshape(-1, 3),
        process=False,
    )
    soup.export(tmp_path / "open.obj")
    cloud = made("DJI Mini 2", tmp_path, **plain("open.obj"))
    assert cloud.record["closed_share"] == 0
    assert len(cloud.points) == 171
    top = cloud.points[:, 2] > 0.0249
    assert (
        (np.abs(cloud.points[top][:, :2]) > [0.0499, 0.0999]).any(axis=1).all()
    )  # only the rim is that high


def test_wings_are_cut_in_two_and_a_positive_angle_raises_the_tip(bird):
    folder, record = bird
    cloud = made("Crow", folder, **record)
    scale = TABLE["Crow"]["size_m"] / 0.16
    assert cloud.parents.tolist() == [-1, -1, 1, -1, 3]
    assert cloud.record["flap"]["amplitude_deg"] == 40
    assert np.ptp(cloud.points[:, 2]) == pytest.approx(
        0.04 * scale, rel=0.02
    )  # the stand is dropped
    for part in range(1, 5):
        points = cloud.points[cloud.part == part]
        sign = -1 if part < 3 else 1
        low, high = (0.021, 0.08) if part % 2 else (0.08, 0.15)
        assert (points[:, 0] * sign >= low * scale * 0.999).all() and (
            points[:, 0] * sign <= high * scale * 1.001
        ).all()
        turned = points + 0.01 * np.cross(
            cloud.axes[part], points - cloud.hinges[part]
        )  # a small positive angle
        assert turned[:, 2].mean() > points[:, 2].mean()
        assert cloud.hinges[part, 0] == pytest.approx(sign * (0.02 if part % 2 else 0.08) * scale)


@pytest.mark.parametrize("wheels", ["components", "made"])
def test_wheels_stay_round_touch_the_ground_and_have_the_published_diameter(wheels, tmp_path):
    shapes = [box((1.8, 4.5, 1.0), (0, 0, 0.9))]
    if wheels == "components":
        for x, y in ((-0.8, 1.4), (0.8, 1.4), (-0.8, -1.4), (0.8, -1.4)):
            shape = trimesh.creation.cylinder(radius=0.33, height=0.2, sections=64)
            shape.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
            shape.apply_translation((x, y, 0.33))
            shapes.append(shape)
    trimesh.util.concatenate(shapes).export(tmp_path / "car.obj")
    record = car_record() if wheels == "components" else car_record(diameter_m=0.66, width_m=0.2)
    cloud = made("Audi A6L 2019", tmp_path, **record)
    diameter = TABLE["Audi A6L 2019"]["wheel_diam_m"]
    assert np.ptp(cloud.points, axis=0) == pytest.approx([1.9, 5.0, 1.5], rel=0.01)
    assert cloud.record["origin_height_m"] == pytest.approx(0.75, rel=0.01)
    for part in range(1, 5):
        away = (cloud.points - cloud.hinges[part])[cloud.part == part]
        assert np.hypot(*away[:, 1:].T).max() == pytest.approx(diameter / 2, rel=0.02)
        assert cloud.hinges[part, 2] == pytest.approx(
            -cloud.record["origin_height_m"] + diameter / 2, abs=1e-9
        )
        # Rolling to the front at v = pi D F the lowest point stands still: axis x down = -front.
        assert np.allclose(np.cross(cloud.axes[part], [0, 0, -1]), [0, -1, 0], atol=0.02)
    tyres = made("Audi A6L 2019", tmp_path, **record, wheel_size="mesh").record["wheel_diameter_m"]
    assert tyres == pytest.approx(0.66 * np.sqrt(5.0 / 4.5 * 1.5 / 1.4), rel=0.01)


def test_regions_take_whole_components_only_where_asked(tmp_path):
    shapes = [
        box((1, 1, 0.02)),
        box((0.1, 0.1, 0.1), (0.3, 0, 0.2)),
        box((0.1, 0.1, 1), (-0.3, 0, 0.6)),
    ]
    trimesh.util.concatenate(shapes).export(tmp_path / "body.stl")
    cylinder = {"centre": [0, 0, 0.2], "axis": "z", "radius": 0.5, "half_length": 0.08}
    for whole, tall in ((False, True), (True, False)):
        region = {"cylinder": cylinder, "whole": whole}
        parts = {
            "body": {"kind": "body", "meshes": [{"file": "body.stl"}]},
            "r": {"kind": "rotor", "region": region, "hinge": [0.3, 0, 0.2], "axis": [0, 0, 2]},
        }
        cloud = made("DJI Mini 2", tmp_path, **plain("", parts=parts))
        taken = cloud.points[cloud.part == 1]
        assert (
            bool((taken[:, 0] - taken[:, 0].max() < -0.4).any()) is tall
        )  # the tall post is cut, not whole inside
        assert np.array_equal(cloud.axes[1], [0, 0, 1])


# An extension reads GLB; where it is missing, OBJ stands for scenes.
@pytest.mark.parametrize("suffix", ["o", "g", *(name for name in suffixes() if name == ".glb")])
def test_parts_are_chosen_by_the_names_of_instances_objects_and_groups(suffix, tmp_path):
    hubs = {
        name: part["meshes"][0]["move"]
        for name, part in quad_record()["parts"].items()
        if part["kind"] == "rotor"
    }
    hull = box((0.2, 0.12, 0.06))
    prop = box((0.2, 0.02, 0.004))
    name = "craft.obj" if suffix in "og" else f"craft{suffix}"
    if suffix in "og":
        props = {hub: prop.copy().apply_translation(at) for hub, at in hubs.items()}
        saved(tmp_path / name, {"hull": hull, **props}, suffix)
    else:
        scene = trimesh.Scene()
        scene.add_geometry(hull, node_name="hull", geom_name="hull shape")
        for hub, place in hubs.items():
            matrix = trimesh.transformations.translation_matrix(place)
            scene.add_geometry(prop, node_name=hub, geom_name="prop", transform=matrix)
        scene.export(tmp_path / name)
    record = quad_record()
    for word, part in record["parts"].items():
        part["meshes"] = [{"file": name, "geometry": ["hull" if word == "body" else word]}]
    hull.export(tmp_path / "body.stl")
    prop.apply_scale(1000).export(tmp_path / "prop.stl")
    separate = quad_record()
    for part in separate["parts"].values():
        part["meshes"][0] |= {"unit": "mm"} if part["kind"] == "rotor" else {}
    one, other = (made("DJI Mini 2", tmp_path, **own) for own in (record, separate))
    np.testing.assert_allclose(one.hinges, other.hinges, atol=5e-4)
    np.testing.assert_allclose(np.ptp(one.points, axis=0), np.ptp(other.points, axis=0), rtol=1e-3)


@pytest.mark.slow
def test_the_workflow_s_rule_makes_the_cloud_of_meshes_with_odd_names(tmp_path):
    inputs = tmp_path / "inputs"
    copy = tmp_path / "checkout"
    record = quad_record()
    for part in record["parts"].values():
        part["meshes"][0]["file"] = "odd folder/my craft (1), " + part["meshes"][0]["file"]
    (inputs / "odd folder").mkdir(parents=True)
    for path in write_quad(tmp_path).glob("*.stl"):
        path.rename(inputs / f"odd folder/my craft (1), {path.name}")
    (tmp_path / "own.yaml").write_text(yaml.safe_dump({"DJI Mini 2": {"source": "mesh", **record}}))
    targets = {"own": {"odd": str(tmp_path / "own.yaml")}, "select": ["DJI Mini 2"]}
    (tmp_path / "overlay.yaml").write_text(yaml.safe_dump({"run": "odd", "targets": targets}))
    copy.mkdir()
    for name in (
        "Snakefile",
        "workflow",
        "config",
        "src",
        "profiles",
        "envs",
        "pyproject.toml",
        "README.md",
    ):
        (copy / name).symlink_to(ROOT / name)
    environment = {**os.environ, "LOWALT_INPUTS": str(inputs), "PYTHONPATH": str(ROOT / "src")}
    line = ["--cores", "2", "--configfile", str(tmp_path / "overlay.yaml"), "--", "clouds"]
    status, said = run(copy, line, environment)
    assert status == 0 and "from files: DJI Mini 2" in said, said[-3000:]
    seed = yaml.safe_load((ROOT / "config/default.yaml").read_text())["seed"]
    cloud = clouds.read(copy / "results/odd/clouds/dji-mini-2.npz")
    np.testing.assert_array_equal(cloud.points, made("DJI Mini 2", inputs, seed, **record).points)


REAL = read_records(ROOT / "config/targets/real.yaml")
UNITS = {
    "hatchback.obj": "in",
    "prius_hybrid.obj": "cm",
    "prius_body.obj": "cm",
    "prius_wheel.obj": "cm",
    "cowbird_fly.obj": "cm",
}


@needs_inputs
@pytest.mark.parametrize(
    "subtype", [name for name, record in REAL.items() if record["source"] == "mesh"]
)
def test_real_records_give_clouds_of_the_published_size(subtype):
    published = TABLE[subtype]
    cloud = made(subtype, FOLDER, **REAL[subtype])
    assert len(cloud.points) == published["points_in_published_cloud_approx"]
    assert np.isfinite(cloud.normals).all()
    kind = {"UAV": "rotor", "Bird": "wing", "Vehicle": "wheel"}[cloud.category]
    assert cloud.kinds == ("body", *[kind] * 4) and np.bincount(cloud.part).min() >= 8
    extent = np.ptp(cloud.points, axis=0)
    if cloud.category == "Vehicle":
        wanted = [published["wid_m"], published["len_m"], published["hgt_m"]]
        assert np.abs(extent / wanted - 1).max() < 0.02
        assert cloud.record["wheel_diameter_m"] == published["wheel_diam_m"]
        # The wheels stand on the ground, two of them left and two ahead, and roll to the front.
        assert np.allclose(
            cloud.hinges[1:, 2] + cloud.record["origin_height_m"], published["wheel_diam_m"] / 2
        )
        assert (
            sorted(np.sign(cloud.hinges[1:, 0]))
            == sorted(np.sign(cloud.hinges[1:, 1]))
            == [-1, -1, 1, 1]
        )
        assert np.allclose(cloud.axes[1:], [-1, 0, 0], atol=0.02)
        # A car is lower over its bonnet than over its boot or hatch.
        along = cloud.points[:, 1] / extent[1]
        assert cloud.points[along > 0.3, 2].max() < cloud.points[along < -0.3, 2].max()
    elif cloud.category == "Bird":
        assert extent[1] == pytest.approx(published["size_m"], rel=0.02)
        assert cloud.parents.tolist() == [-1, -1, 1, -1, 3]
    else:
        hubs = cloud.hinges[1:, :2]
        assert np.linalg.norm(hubs[:, None] - hubs, axis=2).max() == pytest.approx(
            published["size_m"], rel=1e-9
        )
        # Blades lie about their hub, in one plane, and neighbours turn in opposite senses.
        order = np.argsort(np.arctan2(hubs[:, 1], hubs[:, 0]))
        assert np.sign(cloud.axes[1:, 2])[order].tolist() in ([1, -1, 1, -1], [-1, 1, -1, 1])
        for part in range(1, 5):
            away = (cloud.points - cloud.hinges[part])[cloud.part == part]
            assert (
                np.linalg.norm(away[:, :2].mean(axis=0)) < 0.25 * np.linalg.norm(away, axis=1).max()
            )


@needs_inputs
def test_every_real_mesh_is_used_and_alone_becomes_a_valid_cloud():
    files = {str(path.relative_to(FOLDER)) for path in (FOLDER / "meshes").rglob("*.*")}
    assert len(files) >= 18 and files <= {
        file for record in REAL.values() for file in record_files(record)
    }
    for name in files:
        cloud = made("DJI Mini 2", FOLDER, **plain(name, unit=UNITS.get(Path(name).name, "m")))
        assert len(cloud.points) == 171 and np.ptp(cloud.points, axis=0).max() < 5.0


@needs_inputs
def test_inches_given_as_metres_are_caught_by_the_published_size():
    record = REAL["BYD Song L EV 2024"] | {"unit": "m"}
    with pytest.raises(
        InputError, match=r"parts.front left wheel.region .* 65\.2, 61\.3\] m; is the unit 'm'"
    ):
        made("BYD Song L EV 2024", FOLDER, **record)
