"""Users' meshes: every real one becomes a cloud of the published size, bad ones are refused by file and reason."""

import json
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st

from lowalt.common.errors import InputError, InputWarning
from lowalt.targets import cloud as clouds
from lowalt.targets import mesh
from lowalt.targets.make import make
from lowalt.targets.mesh_files import SUFFIXES, read_mesh
from lowalt.targets.records import load_table, merge, read_records
from real_inputs import FOLDER, needs_inputs

ROOT = Path(__file__).parents[1]
TABLE = load_table(ROOT / "config/targets.csv")
REAL = read_records(ROOT / "config/targets/real.yaml")
UNITS = {"hatchback.obj": "in", "prius_hybrid.obj": "cm", "prius_body.obj": "cm", "prius_wheel.obj": "cm",
         "cowbird_fly.obj": "cm"}  # fmt: skip


def made(subtype: str, folder: Path, seed: int = 1, **record) -> clouds.Cloud:
    merged = merge(TABLE[subtype], {"source": "mesh", **record}, subtype)
    return clouds.check(mesh.mesh_cloud(merged, folder, seed), subtype)


def plain(file: str, **changes) -> dict:
    """A record that takes a whole file as a UAV's body, any size."""
    record = {"unit": "m", "up": "z", "front": "y", "size_is": "largest extent", "scale": "none", "scale_limit": 1e6}
    return record | {"parts": {"body": {"kind": "body", "meshes": [{"file": file}]}}} | changes


def box(size, at=(0, 0, 0)) -> trimesh.Trimesh:
    shape = trimesh.creation.box(size)
    shape.apply_translation(at)
    return shape


@pytest.fixture
def quad(tmp_path):
    """A body with arms along its file's x (front), and a propeller with its hub at the origin."""
    box((0.2, 0.12, 0.06)).export(tmp_path / "body.stl")
    box((0.2, 0.02, 0.004)).export(tmp_path / "prop.stl")
    return tmp_path


def quad_record(**changes) -> dict:
    hubs = {"front right": (0.1, -0.1, "ccw"), "rear right": (-0.1, -0.1, "cw"), "rear left": (-0.1, 0.1, "ccw"),
            "front left": (0.1, 0.1, "cw")}  # fmt: skip
    parts = {"body": {"kind": "body", "meshes": [{"file": "body.stl"}]}}
    for name, (x, y, sense) in hubs.items():
        parts[name] = {"kind": "rotor", "meshes": [{"file": "prop.stl", "move": [x, y, 0.04]}], "sense": sense}
    return {"unit": "m", "up": "z", "front": "x", "size_is": "motor diagonal", "parts": parts} | changes


# --- the real ones ---


@needs_inputs
@pytest.mark.parametrize("subtype", [name for name, record in REAL.items() if record["source"] == "mesh"])
def test_real_records_give_clouds_of_the_published_size(subtype):
    published = TABLE[subtype]
    cloud = made(subtype, FOLDER, **REAL[subtype])
    assert len(cloud.points) == published["points_in_published_cloud_approx"]
    assert np.isfinite(cloud.normals).all()
    moving = [kind for kind in cloud.kinds if kind != "body"]
    assert np.bincount(cloud.part).min() >= 8
    extent = np.ptp(cloud.points, axis=0)
    if cloud.category == "Vehicle":
        wanted = [published["wid_m"], published["len_m"], published["hgt_m"]]
        assert np.abs(extent / wanted - 1).max() < 0.02
        assert moving == ["wheel"] * 4
        assert cloud.record["wheel_diameter_m"] == published["wheel_diam_m"]
        # The wheels stand on the ground, two of them left and two ahead, and roll to the front.
        assert np.allclose(cloud.hinges[1:, 2] + cloud.record["origin_height_m"], published["wheel_diam_m"] / 2)
        assert sorted(np.sign(cloud.hinges[1:, 0])) == sorted(np.sign(cloud.hinges[1:, 1])) == [-1, -1, 1, 1]
        assert np.allclose(cloud.axes[1:], [-1, 0, 0], atol=0.02)
        # A car is lower over its bonnet than over its boot or hatch.
        ahead, behind = (
            cloud.points[np.abs(cloud.points[:, 1] - y * extent[1]) < 0.1 * extent[1], 2] for y in (0.4, -0.4)
        )
        assert ahead.max() < behind.max()
    elif cloud.category == "Bird":
        assert extent[1] == pytest.approx(published["size_m"], rel=0.02)
        assert cloud.parents.tolist() == [-1, -1, 1, -1, 3]
    else:
        hubs = cloud.hinges[1:, :2]
        assert np.linalg.norm(hubs[:, None] - hubs, axis=2).max() == pytest.approx(published["size_m"], rel=1e-9)
        assert moving == ["rotor"] * 4
        # Blades lie about their hub, in one plane, and neighbours turn in opposite senses.
        order = np.argsort(np.arctan2(hubs[:, 1], hubs[:, 0]))
        assert np.sign(cloud.axes[1:, 2])[order].tolist() in ([1, -1, 1, -1], [-1, 1, -1, 1])
        for part in range(1, 5):
            away = (cloud.points - cloud.hinges[part])[cloud.part == part]
            assert np.linalg.norm(away[:, :2].mean(axis=0)) < 0.25 * np.linalg.norm(away, axis=1).max()


@needs_inputs
def test_every_real_mesh_is_used_and_alone_becomes_a_valid_cloud():
    files = sorted((FOLDER / "meshes").rglob("*.*"))
    assert len(files) >= 18
    used = {file for record in REAL.values() for file in merged_files(record)}
    for path in files:
        name = str(path.relative_to(FOLDER))
        assert name in used
        cloud = made("DJI Mini 2", FOLDER, **plain(name, unit=UNITS.get(path.name, "m")))
        assert len(cloud.points) == 171
        assert np.ptp(cloud.points, axis=0).max() < 5.0


def merged_files(record: dict) -> list[str]:
    return mesh.record_files(record) if record["source"] == "mesh" else []


@needs_inputs
def test_inches_given_as_metres_are_caught_by_the_published_size():
    record = REAL["BYD Song L EV 2024"] | {"unit": "m"}
    with pytest.raises(
        InputError,
        match=r"BYD Song L EV 2024: parts.front left wheel.region .* 65.2362, 61.2816. m; is the unit 'm'",
    ):
        made("BYD Song L EV 2024", FOLDER, **record)


# --- laws ---


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
    record["parts"]["front left"]["meshes"] = [{"file": "prop.stl", "turn": tilt, "move": [0.1, 0.1, 0.04]}]
    cloud = made("DJI Mini 2", quad, **record)
    # Turned by 20 degrees about y, the file's z leans to its x, the front; clockwise turns the axis round.
    assert np.allclose(cloud.axes[1], -np.array([0, np.sin(np.radians(20)), np.cos(np.radians(20))]), atol=2e-3)


@given(up=st.sampled_from(["x", "-x", "y", "-y", "z", "-z"]), front=st.sampled_from(["x", "-x", "y", "-y", "z", "-z"]))
@settings(max_examples=12, deadline=None)
def test_axes_of_the_file_do_not_matter_if_the_record_names_them(up, front, tmp_path_factory):
    if up[-1] == front[-1]:
        return
    vectors = {axis: np.eye(3)["xyz".index(axis[-1])] * (-1 if axis[0] == "-" else 1) for axis in (up, front)}
    frame = np.stack([np.cross(vectors[front], vectors[up]), vectors[front], vectors[up]])
    folder = tmp_path_factory.mktemp("axes")
    shape = trimesh.util.concatenate([box((0.1, 0.2, 0.05)), box((0.02, 0.02, 0.02), (0.03, 0.09, 0.1))])
    shape.vertices = shape.vertices @ frame  # from body axes to the file's
    shape.export(folder / "body.ply")
    cloud = made("DJI Mini 2", folder, **plain("body.ply", up=up, front=front))
    assert np.ptp(cloud.points, axis=0) == pytest.approx([0.1, 0.2, 0.135], rel=1e-6)
    high = cloud.points[cloud.points[:, 2] > 0.03]
    assert (high[:, 0] > 0.01).all() and (high[:, 1] > 0.07).all()  # the mast stands ahead on the right


STATING = (".dae", ".glb")  # formats that state their unit; trimesh writes metres


@pytest.mark.parametrize(
    ("suffix", "unit", "metres"),
    [(suffix, "m", 1.0) for suffix in SUFFIXES]
    + [(s, u, f) for s in SUFFIXES if s not in STATING for u, f in (("in", 0.0254), ("mm", 0.001))],
)
def test_every_format_and_unit_gives_the_same_size(suffix, unit, metres, tmp_path):
    shape = box(np.array([0.1, 0.2, 0.05]) / metres)
    path = tmp_path / f"box{suffix}"
    shape.export(path)
    found = read_mesh(path, unit)
    assert len(found.faces) == 12 and found.closed.tolist() == [True]
    assert np.ptp(found.vertices, axis=0) == pytest.approx([0.1, 0.2, 0.05], rel=1e-6)


def test_a_record_s_unit_overrides_the_file_s_with_a_warning(tmp_path):
    (tmp_path / "box.glb").write_bytes(box((1, 1, 1)).export(file_type="glb"))
    with pytest.warns(InputWarning, match=r"box.glb: the file states a unit of 1 m, the record says in"):
        found = read_mesh(tmp_path / "box.glb", "in")
    assert np.ptp(found.vertices, axis=0) == pytest.approx([0.0254] * 3)
    plain_dae = box((100, 200, 50)).export(file_type="dae")
    stating = plain_dae.replace(b"<asset>", b'<asset><unit name="half" meter="0.5"/>')
    (tmp_path / "box.dae").write_bytes(stating)
    with pytest.warns(InputWarning, match=r"box.dae: the file states a unit of 0.5 m, the record says 0.001"):
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
        shape.triangles.reshape(-1, 3), np.arange(3 * len(shape.faces)).reshape(-1, 3), process=False
    )
    soup.export(tmp_path / "open.obj")
    cloud = made("DJI Mini 2", tmp_path, **plain("open.obj"))
    assert cloud.record["closed_share"] == 0
    assert len(cloud.points) == 171
    top = cloud.points[:, 2] > 0.0249
    assert (np.abs(cloud.points[top][:, :2]) > [0.0499, 0.0999]).any(axis=1).all()  # only the rim is that high


@pytest.fixture
def bird(tmp_path):
    """A body with flat wings to both sides, and a stand below, in centimetres; front y, up z."""
    shapes = [box((4, 16, 4)), box((30, 6, 0.4), (0, 2, 0)), box((1, 1, 6), (0, 0, -6))]
    trimesh.util.concatenate(shapes).export(tmp_path / "bird.obj")
    parts = {"body": {"kind": "body", "meshes": [{"file": "bird.obj"}]}}
    for side, sign in (("right", 1), ("left", -1)):
        edges = sorted([sign * 0.021, sign * 0.08])
        inner = [[edges[0], None, -0.01], [edges[1], None, 0.01]]
        outer = [[0.08, None, None], [None, None, None]] if sign > 0 else [[None, None, None], [-0.08, None, None]]
        parts[f"{side} inner"] = {"kind": "wing", "region": {"box": inner}, "hinge": [sign * 0.02, 0, 0]}
        parts[f"{side} outer"] = {"kind": "wing", "region": {"box": outer}, "hinge": [sign * 0.08, 0, 0]}
        parts[f"{side} outer"]["parent"] = f"{side} inner"
    record = {"unit": "cm", "up": "z", "front": "y", "size_is": "length", "parts": parts}
    return tmp_path, record | {"drop": [{"box": [[None, None, None], [None, None, -0.0205]]}]}


def test_wings_are_cut_in_two_and_a_positive_angle_raises_the_tip(bird):
    folder, record = bird
    cloud = made("Crow", folder, **record)
    scale = TABLE["Crow"]["size_m"] / 0.16
    assert cloud.parents.tolist() == [-1, -1, 1, -1, 3]
    assert cloud.record["flap"]["amplitude_deg"] == 40
    assert np.ptp(cloud.points[:, 2]) == pytest.approx(0.04 * scale, rel=0.02)  # the stand is dropped
    for part in range(1, 5):
        points, sign = cloud.points[cloud.part == part], -1 if part < 3 else 1
        low, high = (0.021, 0.08) if part % 2 else (0.08, 0.15)
        assert (points[:, 0] * sign >= low * scale * 0.999).all() and (
            points[:, 0] * sign <= high * scale * 1.001
        ).all()
        turned = points + 0.01 * np.cross(cloud.axes[part], points - cloud.hinges[part])  # a small positive angle
        assert turned[:, 2].mean() > points[:, 2].mean()
        assert cloud.hinges[part, 0] == pytest.approx(sign * (0.02 if part % 2 else 0.08) * scale)


def car_record(**wheel) -> dict:
    parts = {"body": {"kind": "body", "meshes": [{"file": "car.obj"}]}}
    for name, x, y in (("fl", -0.8, 1.4), ("fr", 0.8, 1.4), ("rl", -0.8, -1.4), ("rr", 0.8, -1.4)):
        region = {"box": [[x - 0.2, y - 0.4, -0.1], [x + 0.2, y + 0.4, 0.7]], "whole": True}
        parts[name] = {"kind": "wheel", "region": region}
        if wheel:
            parts[name] = {"kind": "wheel", "wheel": wheel, "hinge": [x, y, 0.33]}
    return {"unit": "m", "up": "z", "front": "y", "parts": parts, "points": 400}


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
        assert cloud.hinges[part, 2] == pytest.approx(-cloud.record["origin_height_m"] + diameter / 2, abs=1e-9)
        # Rolling to the front at v = pi D F the lowest point stands still: axis x down = -front.
        assert np.allclose(np.cross(cloud.axes[part], [0, 0, -1]), [0, -1, 0], atol=0.02)
    tyres = made("Audi A6L 2019", tmp_path, **record, wheel_size="mesh").record["wheel_diameter_m"]
    assert tyres == pytest.approx(0.66 * np.sqrt(5.0 / 4.5 * 1.5 / 1.4), rel=0.01)


def test_regions_take_whole_components_only_where_asked(tmp_path):
    shapes = [box((1, 1, 0.02)), box((0.1, 0.1, 0.1), (0.3, 0, 0.2)), box((0.1, 0.1, 1), (-0.3, 0, 0.6))]
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
        assert bool((taken[:, 0] - taken[:, 0].max() < -0.4).any()) is tall  # the tall post is cut, not whole inside
        assert np.array_equal(cloud.axes[1], [0, 0, 1])


# --- the order of parts, and parts that cannot be what they are called ---


@pytest.mark.parametrize("names", [("front right", "body"), ("arm 1", "zebra"), ("back left wheel", "Aaa"), ("1", "0")])
def test_the_order_and_the_names_of_parts_mean_nothing(names, quad):
    """Settings reach a job with sorted keys, so a record must give the same cloud however its parts are sorted."""
    first, body = names
    record = quad_record()
    given_parts = {first: record["parts"].pop("front right"), body: record["parts"].pop("body"), **record.pop("parts")}
    if body != "body":
        given_parts[body] = given_parts[body] | {"kind": "body"}
    merged = merge(TABLE["DJI Mini 2"], {"source": "mesh", **record, "parts": given_parts}, "own")
    found = [
        make(json.loads(json.dumps(settings, sort_keys=keys)), quad, 1)
        for settings, keys in ((merged, False), (merged, True), (merged | {"parts": given_parts}, False))
    ]
    assert found[0].kinds == ("body", "rotor", "rotor", "rotor", "rotor")
    assert found[0].names == (body, *sorted(set(given_parts) - {body}))
    for other in found[1:]:
        assert other.names == found[0].names
        np.testing.assert_array_equal(other.points, found[0].points)


def test_a_child_may_sort_before_its_parent(bird):
    folder, record = bird
    renamed = {"right inner": "right wing", "right outer": "right outer wing"}
    parts = {renamed.get(name, name): dict(part) for name, part in reversed(record["parts"].items())}
    parts["right outer wing"]["parent"] = "right wing"
    cloud = make(json.loads(json.dumps(merge(TABLE["Crow"], {"source": "mesh", **record, "parts": parts}, "own"),
                                       sort_keys=True)), folder, 1)  # fmt: skip
    assert cloud.names == ("body", "left inner", "left outer", "right wing", "right outer wing")
    assert cloud.parents.tolist() == [-1, -1, 1, -1, 3]


def test_parents_in_a_circle_two_bodies_and_none_are_refused(bird):
    folder, record = bird
    for change, words in (
        ({"right inner": {"parent": "right outer"}}, "parent is 'right outer', which hangs on 'right inner' itself"),
        ({"right inner": {"kind": "body"}}, "2 of kind body"),
        ({"body": {"kind": "wing"}}, "0 of kind body"),
    ):
        parts = {name: part | change.get(name, {}) for name, part in record["parts"].items()}
        with pytest.raises(InputError, match=words):
            made("Crow", folder, **record | {"parts": parts})


def test_regions_that_take_the_same_surface_are_refused_whatever_their_order(bird):
    folder, record = bird
    wide = {"box": [[0.03, None, -0.01], [None, None, 0.01]]}
    for order in (1, -1):
        parts = dict(list(record["parts"].items())[::order])
        parts["right outer"] = parts["right outer"] | {"region": wide}
        with pytest.raises(InputError, match="parts 'right inner' and 'right outer' take the same surface"):
            made("Crow", folder, **record | {"parts": parts})


def wheeled(tmp_path, axis=0, centre=0.33, count=4) -> dict:
    """Write a car with separate wheels whose thin direction is `axis` and return its record."""
    box((1.8, 4.5, 1.0), (0, 0, 0.9)).export(tmp_path / "car.obj")
    turn = trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0] if axis == 0 else [1, 0, 0])
    shape = trimesh.creation.cylinder(radius=0.33, height=0.2, sections=64)
    shape.apply_transform(turn)
    shape.export(tmp_path / "wheel.obj")
    record = car_record()
    places = (("fl", -0.8, 1.4), ("fr", 0.8, 1.4), ("rl", -0.8, -1.4), ("rr", 0.8, -1.4))[:count]
    body = record["parts"]["body"]
    record["parts"] = {
        name: {"kind": "wheel", "meshes": [{"file": "wheel.obj", "move": [x, y, centre]}]} for name, x, y in places
    } | {"body": body}
    return record


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"centre": 1.3}, "fl: its centre lies 0.9 m above the lowest point of a body 1 m high.*is `up` reversed"),
        ({"axis": 1}, "fl: it measures 0.66 m along its axis and 0.2 x 0.66 m across"),
    ],
)
def test_wheels_that_cannot_roll_are_refused_with_their_measures(changes, words, tmp_path):
    made("Audi A6L 2019", tmp_path, **wheeled(tmp_path))
    with pytest.raises(InputError, match=words):
        made("Audi A6L 2019", tmp_path, **wheeled(tmp_path, **changes))


def test_a_wheel_axis_along_the_car_is_refused(tmp_path):
    record = wheeled(tmp_path)
    record["parts"]["rr"]["axis"] = [0, 1, 0]
    with pytest.raises(InputError, match=r"rr: its axis is .*1.0, -?0.0. .right, front, up., expected right or left"):
        made("Audi A6L 2019", tmp_path, **record)


def test_a_car_on_two_wheels_is_made_with_a_warning_that_its_cloud_keeps(tmp_path):
    with pytest.warns(InputWarning, match="2 wheels, expected at least 3"):
        cloud = made("Audi A6L 2019", tmp_path, **wheeled(tmp_path, count=2))
    assert cloud.record["warnings"] == ["Audi A6L 2019: 2 wheels, expected at least 3"]
    assert "warnings" not in made("Audi A6L 2019", tmp_path, **wheeled(tmp_path)).record


def test_a_hub_far_from_its_blades_and_a_rotor_of_a_millimetre_are_refused(quad):
    record = quad_record()
    record["parts"]["front left"]["hinge"] = [5.0, 0.1, 0.04]
    with pytest.raises(InputError, match=r"front left: its hinge lies 4.9 m from the middle of its surface"):
        made("DJI Mini 2", quad, **record)
    box((0.012, 0.002, 0.001)).export(quad / "prop.stl")
    with pytest.raises(InputError, match=r"rotor front left has a diameter of 0.0095 m at the final size"):
        made("DJI Mini 2", quad, **quad_record())


def test_wings_hinged_at_the_tip_or_on_one_side_only(bird):
    folder, record = bird
    parts = {name: dict(part) for name, part in record["parts"].items()}
    parts["right inner"]["hinge"] = [0.2, 0, 0]
    with pytest.raises(InputError, match=r"right inner: its hinge lies 0.2 m and its surface 0.05 m right"):
        made("Crow", folder, **record | {"parts": parts})


# --- bad ones ---


def written(folder: Path, name: str, text: str | bytes) -> str:
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    return name


TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


@pytest.mark.parametrize(
    ("name", "text", "reason"),
    [
        ("empty.stl", b"", "no triangle|not a readable"),
        ("empty.obj", "", "no triangle|not a readable"),
        ("points.obj", "v 0 0 0\nv 1 0 0\n", "no triangle|not a readable"),
        ("one.obj", TRIANGLE, "1 triangles with an area"),
        ("nan.obj", TRIANGLE.replace("v 0 1 0", "v 0 nan 0") * 4, "NaN"),
        ("inf.obj", TRIANGLE.replace("v 0 1 0", "v 0 inf 0") * 4, "NaN, infinite"),
        ("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n" * 5, "0 triangles with an area|no triangle"),
        ("text.stl", "this is no mesh at all", "no triangle|not a readable"),
        ("bytes.ply", bytes(range(256)) * 4, "no triangle|not a readable"),
        ("bytes.glb", bytes(range(256)) * 4, "no triangle|not a readable"),
        ("bytes.dae", bytes(range(256)) * 4, "no triangle|not a readable"),
        ("mesh.fbx", b"Kaydara FBX", "format '.fbx', expected one of"),
        ("gone.stl", None, "no file"),
    ],
)
def test_bad_files_are_refused_by_name_and_reason(name, text, reason, tmp_path):
    if text is not None:
        written(tmp_path, name, text)
    with pytest.raises(InputError, match=reason) as error:
        made("DJI Mini 2", tmp_path, **plain(name))
    assert name in str(error.value)


def test_nan_in_binary_stl_is_refused(tmp_path):
    shape = trimesh.creation.icosphere(2)
    shape.vertices[7] = np.nan
    (tmp_path / "nan.stl").write_bytes(shape.export(file_type="stl"))
    with pytest.raises(InputError, match=r"nan.stl: a triangle has a NaN"):
        read_mesh(tmp_path / "nan.stl", "m")


def test_a_machine_without_pymeshlab_is_told_what_to_install(quad, monkeypatch):
    monkeypatch.setitem(sys.modules, "pymeshlab", None)
    with pytest.raises(InputError, match=r"mesh records need pymeshlab.*libgl1"):
        read_mesh(quad / "body.stl", "m")


@pytest.mark.parametrize(
    ("path", "value", "names"),
    [
        (["unit"], "inch", "unit"), (["up"], "up", "up"), (["front"], "-z", "two different axes"),
        (["size_is"], "tall", "size_is"),
        (["colour"], "red", "colour"), (["scale"], 2, "scale"), (["moving_share"], 1, "moving_share"),
        (["parts", "front right", "hinge"], [0, 0], "front right"),
        (["parts", "front right", "kind"], "wheel", "expected rotor"),
        (["parts", "front right", "axis"], [0, 0, 0], "axis is zero"),
        (["parts", "front right", "parent"], "body", "parent"),
        (["parts", "front right", "region"], {"box": [[0, 0, 0], [1, 1, 1]]}, "front right"),
        (["parts", "body", "meshes", 0, "file"], "/etc/body.stl", "inside the folder"),
        (["parts", "body", "meshes", 0, "file"], "../body.stl", "inside the folder"),
        (["parts", "body", "meshes", 0, "geometry"], ["seat"], "geometry .'seat'. is not in it"),
        (["parts", "body", "meshes", 0, "unit"], "furlong", "furlong"), (["points"], 4, "leave none for the body"),
        (["unit"], "in", "part front left measures 0.00508 m in a mesh of 0.205 m.* is the unit"),
        (["parts", "front right", "meshes", 0, "unit"], "in", "part front right measures .* is the unit"),
        (["parts", "front right"], {"kind": "body"}, "front right"),
    ],
)  # fmt: skip
def test_bad_records_are_refused_by_key_and_value(path, value, names, quad):
    record = quad_record()
    at = record
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    with pytest.raises(InputError, match=names) as error:
        made("DJI Mini 2", quad, **record)
    assert "DJI Mini 2" in str(error.value) or "body.stl" in str(error.value)


def test_regions_that_hold_nothing_or_everything_are_refused(quad):
    for low, high, names in (
        ([5, 5, 5], [6, 6, 6], "holds nothing"),
        ([-5, -5, -5], [6, 6, 6], "leave nothing of body"),
    ):
        parts = {
            "body": {"kind": "body", "meshes": [{"file": "body.stl"}]},
            "r": {"kind": "rotor", "region": {"box": [low, high]}, "hinge": [0, 0, 0], "axis": [0, 0, 1]},
        }
        with pytest.raises(InputError, match=names):
            made("DJI Mini 2", quad, **plain("", parts=parts))


@pytest.mark.slow
def test_two_million_triangles_take_bounded_memory(tmp_path):
    side = 1000
    x, y = np.meshgrid(np.linspace(-1, 1, side + 1), np.linspace(-1, 1, side + 1))
    vertices = np.stack([x.ravel(), y.ravel(), 0.1 * np.sin(9 * x * y).ravel()], axis=1)
    at = np.arange(side * (side + 1)).reshape(side, side + 1)[:, :-1].ravel()
    faces = np.concatenate([np.stack([at, at + 1, at + side + 2], 1), np.stack([at, at + side + 2, at + side + 1], 1)])
    trimesh.Trimesh(vertices, faces, process=False).export(tmp_path / "big.stl")
    code = """
import resource, sys
from lowalt.targets.mesh import check_record, mesh_cloud
extra = {"unit": "m", "up": "z", "front": "y", "size_is": "length",
         "parts": {"body": {"kind": "body", "meshes": [{"file": "big.stl"}]}}}
record = {"source": "mesh", "subtype": "Crow", "category": "Bird", "published": {"size_m": 2.0}, "points": 169,
          "rcs_m2_per_point": 1.0, **extra}
cloud = mesh_cloud(check_record(record, extra, "Crow"), sys.argv[1], 1)
print(len(cloud.points), resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)
"""
    run = subprocess.run([sys.executable, "-c", code, str(tmp_path)], capture_output=True, text=True, check=True)
    points, peak_mib = map(int, run.stdout.split())
    assert points == 169 and peak_mib < 1500
