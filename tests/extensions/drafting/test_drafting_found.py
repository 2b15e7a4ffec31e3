"""What moves on a mesh without joints.

Rotors are found by name, hub and number, wings from the body; sizes that do not fit are refused.
"""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml
from PIL import Image

from lowalt.__main__ import main
from lowalt.extensions.drafting.inspection import inspect_mesh
from lowalt.extensions.drafting.new import Asked
from lowalt.files.errors import InputWarning
from lowalt.files.shipped import SHIPPED
from lowalt.targets.cloud import Cloud, read
from lowalt.targets.mesh_parts import Pool
from lowalt.targets.mesh_size import refuse_implausible
from lowalt.targets.records import load_table
from meshes import box, saved

pytestmark = pytest.mark.usefixtures("without_target_picture")
HUBS = np.array([(0.13, 0.11), (0.13, -0.11), (-0.13, 0.11), (-0.13, -0.11)])


def disc(at, radius: float = 0.1, height: float = 0.006) -> trimesh.Trimesh:
    """A flat disc around a place."""
    shape = trimesh.creation.cylinder(radius=radius, height=height, sections=24)
    shape.apply_translation(at)
    return shape


def draft(path: Path, *words: str) -> tuple[int, Path]:
    """Exit status of `target new` and the record it writes."""
    out = path.with_suffix(".yaml")
    return (
        main(["target", "new", str(path), "--inputs", str(path.parent), "--out", str(out), *words]),
        out,
    )


@pytest.fixture
def refused(tmp_path, capsys, monkeypatch):
    """A function of a file and words that returns why `target new` refuses it.

    Pictures go to the test's folder.
    """
    monkeypatch.chdir(tmp_path)

    def error(path: Path, *words: str) -> str:
        assert draft(path, *words)[0] == 2
        return capsys.readouterr().err

    return error


def cloud(out: Path) -> Cloud:
    """The cloud of a drafted record."""
    made = out.with_suffix(".npz")
    assert main(f"target make {out} --inputs {out.parent} --out {made}".split()) == 0
    return read(made)


def turned(shape: trimesh.Trimesh, angle: float, axis: list[int], at=(0, 0, 0)) -> trimesh.Trimesh:
    """A shape turned about an axis (rad) and then moved."""
    shape.apply_transform(trimesh.transformations.rotation_matrix(angle, axis))
    return shape.apply_translation(at)


def four(name: str, height: float = 0.06) -> dict[str, trimesh.Trimesh]:
    """Four discs over the hubs."""
    return {f"{name}{index}": disc((x, y, height)) for index, (x, y) in enumerate(HUBS)}


def hull() -> dict[str, trimesh.Trimesh]:
    """A body with arms, plates, skids, motor caps and screws, each of which comes in fours or twos."""
    shapes = {"hull": box((0.2, 0.12, 0.06))}
    for index, (x, y) in enumerate(HUBS):
        arm = turned(
            box((0.12, 0.02, 0.012)), np.arctan2(y, x), [0, 0, 1], (0.55 * x, 0.55 * y, 0.02)
        )
        shapes |= {
            f"arm{index}": arm,
            f"cap{index}": disc((x, y, 0.05), 0.015),
            f"screw{index}": disc((x, 0, 0), 0.004),
            f"plate{index}": disc((0.4 * x, 0.4 * y, 0.035), 0.036),
        }
    return shapes | {
        f"skid{side}": box((0.22, 0.012, 0.012), (0, side * 0.06, -0.08)) for side in (-1, 1)
    }


@pytest.mark.parametrize("up", [2, 0])
def test_four_discs_that_nearly_touch_are_four_rotors_whatever_is_up_and_nothing_else_is(
    up, tmp_path
):
    shapes = hull() | four("part")
    for shape in shapes.values() if up == 0 else ():
        turned(shape, -np.pi / 2, [0, 1, 0])  # z becomes -x
    path = saved(tmp_path / "craft.obj", shapes)
    status, out = draft(path, "--subtype", "DJI Mavic 3 Pro")
    assert status == 0 and f"up: {'z' if up == 2 else '-x'}  # GUESSED" in out.read_text()
    found = cloud(out)
    assert found.kinds.count("rotor") == 4 and "warnings" not in found.record
    factor = found.record["published"]["size_m"] / np.hypot(0.26, 0.22)
    hubs = np.sort(np.abs(found.hinges[1:, :2]), axis=1)
    np.testing.assert_allclose(hubs, np.tile([0.11, 0.13], (4, 1)) * factor, rtol=0.05)
    order = np.argsort(np.arctan2(found.hinges[1:, 1], found.hinges[1:, 0]))
    assert np.sign(found.axes[1:, 2])[order].tolist() in ([1, -1, 1, -1], [-1, 1, -1, 1])


def test_blades_far_from_one_another_are_taken_together_where_the_number_is_known(tmp_path):
    shapes = hull()
    for index, (x, y) in enumerate(HUBS):
        for blade in range(3):
            shape = box((0.06, 0.012, 0.003), (0.05, 0, 0))
            shapes[f"b{index}{blade}"] = turned(
                shape, 2 * np.pi * blade / 3 + index, [0, 0, 1], (x, y, 0.07)
            )
    path = saved(tmp_path / "craft.obj", shapes)
    groups = inspect_mesh(path, "UAV", "m", {"n_rotors_or_wings": 4}).groups
    assert [len(group) for group in groups] == [3, 3, 3, 3]
    for group in groups:
        middle = np.mean([part.centre[:2] for part in group], axis=0)
        assert np.linalg.norm(HUBS - middle, axis=1).min() < 0.01


def test_arms_are_no_rotors_where_propellers_are_missing(tmp_path, refused):
    shapes = {name: shape for name, shape in hull().items() if "plate" not in name}
    assert "0 rotors found, expected 4" in refused(
        saved(tmp_path / "craft.obj", shapes), "--subtype", "DJI Mavic 3 Pro"
    )
    # Two alike pieces may be two blades of one rotor.
    two = {"hull": box((0.4, 0.1, 0.1)), "a": disc((0.3, 0, 0.1)), "b": disc((-0.3, 0, 0.1))}
    assert "0 rotors found, expected at least one" in refused(
        saved(tmp_path / "two.obj", two), "--category", "UAV"
    )
    # Motors are none either, where their names say so.
    part, mount = (
        saved(tmp_path / f"{kind}.obj", {"hull": box((0.2, 0.12, 0.06))} | four(kind, 0.02))
        for kind in ("part", "MotorMount.")
    )
    assert draft(part, "--category", "UAV", "--rotors", "4")[0] == 0
    assert "0 rotors found, expected 4" in refused(mount, "--category", "UAV", "--rotors", "4")


def test_names_tell_rotors_of_any_size_and_axis_and_skids_are_none(tmp_path):
    tail = turned(disc((0, 0, 0), 0.08), np.pi / 2, [1, 0, 0], (-0.6, 0.03, 0.1))
    shapes = {"hull": box((0.4, 0.15, 0.2)), "boom": box((0.5, 0.03, 0.03), (-0.4, 0, 0.05)),
              "helicopter-propeller-main": disc((0, 0, 0.16), 0.4), "helicopter-propeller-small": tail,
              "skid1": box((0.3, 0.02, 0.02), (0, 0.08, -0.15)),
              "skid2": box((0.3, 0.02, 0.02), (0, -0.08, -0.15))}  # fmt: skip
    path = saved(tmp_path / "heli.obj", shapes)
    assert draft(path, "--category", "UAV")[0] == 0
    parts = yaml.safe_load(path.with_suffix(".yaml").read_text())["heli"]["parts"]
    assert [part["kind"] for part in parts.values()].count("rotor") == 2
    found = cloud(path.with_suffix(".yaml"))
    assert (
        np.abs(found.axes[1:, 2]).round(2).tolist().count(1.0) == 1
    )  # the tail rotor's axis points sideways


def rover(name: str, size: tuple, x: float, y: float) -> dict[str, trimesh.Trimesh]:
    """A hull with four wheels of this name, their axes along x."""
    places = [(x, y, 0), (x, -y, 0), (-x, y, 0), (-x, -y, 0)]
    wheels = [turned(disc((0, 0, 0), 0.2, 0.1), np.pi / 2, [0, 1, 0], place) for place in places]
    return {"hull": box(size, (0, 0, 0.4))} | {
        f"{name}{index}": wheel for index, wheel in enumerate(wheels)
    }


def test_wheels_tell_the_front_of_a_vehicle_that_is_wider_than_long(tmp_path):
    path = saved(tmp_path / "rover.obj", rover("wheel", (2.4, 1.2, 0.3), 0.8, 0.5))
    assert draft(path, "--category", "Vehicle", "--unit", "m", "--up", "z")[0] == 0
    assert np.abs(cloud(path.with_suffix(".yaml")).axes[1:, 0]) == pytest.approx(1)


def test_wheels_that_mirror_one_another_need_no_number_and_others_are_asked_for(tmp_path, refused):
    shapes = rover("drum", (1.2, 2.4, 0.3), 0.5, 0.8)
    words = (
        saved(tmp_path / "rover.obj", shapes),
        "--category",
        "Vehicle",
        "--unit",
        "m",
        "--up",
        "z",
    )
    assert draft(*words)[0] == 0
    assert cloud(tmp_path / "rover.yaml").kinds.count("wheel") == 4
    del shapes["drum3"]
    three = saved(tmp_path / "three.obj", shapes)
    assert "3 wheels found, expected --wheels 3 where that is all" in refused(three, *words[1:])
    assert draft(three, *words[1:], "--wheels", "3")[0] == 0
    bare = saved(tmp_path / "bare.obj", {"hull": shapes["hull"]})
    assert "0 wheels found" in refused(bare, *words[1:])
    assert draft(bare, *words[1:], "--wheels", "0")[0] == 0


def test_another_number_of_rotors_is_refused_with_a_picture_whose_numbers_help(tmp_path, refused):
    path = saved(tmp_path / "craft.obj", hull() | four("part"))
    error = refused(path, "--subtype", "DJI Matrice 600 Pro")
    assert (
        "0 rotors found, expected 6" in error
        and "craft-pieces.png" in error
        and "--moving 3 5+6" in error
    )
    assert Image.open(tmp_path / "craft-pieces.png").size[0] > 1000
    assert not path.with_suffix(".yaml").exists()
    parts = inspect_mesh(path, "UAV", "m").components
    numbers = [str(n) for n, part in enumerate(parts, 1) if part.piece.startswith("part")]
    assert draft(path, "--category", "UAV", "--unit", "m", "--moving", *numbers)[0] == 0
    assert cloud(path.with_suffix(".yaml")).kinds.count("rotor") == 4
    assert "--moving is '99'" in refused(path, "--category", "UAV", "--moving", "99")


def without_a_side(shape: trimesh.Trimesh, axis: int) -> trimesh.Trimesh:
    """A shape without the triangles that lie lowest along an axis."""
    heights = shape.triangles[:, :, axis]
    return trimesh.Trimesh(
        shape.vertices, shape.faces[(heights > heights.min() + 1e-9).any(axis=1)]
    )


def test_one_half_of_a_craft_is_refused_and_a_whole_one_on_one_side_of_the_file_s_axes_is_not(
    tmp_path, refused
):
    shapes = hull() | four("rotor")
    right = {name: shape for name, shape in shapes.items() if shape.bounds[0, 1] > -1e-9}
    closed = right | {"hull": box((0.2, 0.06, 0.06), (0, 0.03, 0))}
    open_half = right | {"hull": without_a_side(closed["hull"], 1)}
    away = {name: shape.copy().apply_translation([0, 0.3, 0]) for name, shape in open_half.items()}
    for name, half in (("closed", closed), ("open", open_half), ("away", away)):
        assert f"{name}.obj: one half of a target, cut off along y" in refused(
            saved(tmp_path / f"{name}.obj", half), "--category", "UAV"
        )
    corner = {
        name: shape.copy().apply_translation([0.23, 0.21, 0.1]) for name, shape in shapes.items()
    }
    assert draft(saved(tmp_path / "corner.obj", corner), "--category", "UAV")[0] == 0
    van = {"hull": without_a_side(box((4, 2, 2)), 0)}
    words = (
        saved(tmp_path / "van.obj", van),
        "--category",
        "Vehicle",
        "--unit",
        "m",
        "--up",
        "z",
        "--wheels",
        "0",
    )
    assert "or give --front x where" in refused(*words)
    assert draft(*words, "--front", "x")[0] == 0


def test_a_craft_made_with_another_number_of_rotors_than_its_row_says_so(tmp_path):
    path = saved(tmp_path / "a.obj", hull())
    out = tmp_path / "a.yaml"
    parts = {"body": {"kind": "body", "meshes": [{"file": path.name}]}}
    record = {
        "source": "mesh",
        "unit": "m",
        "up": "z",
        "front": "x",
        "size_is": "largest extent",
        "parts": parts,
    }
    out.write_text(yaml.safe_dump({"DJI Mini 2": record}))
    with pytest.warns(InputWarning, match="0 rotors, expected the 4 of its row"):
        assert cloud(out).record["warnings"]


def test_a_target_of_its_own_takes_its_size_from_the_file_and_a_given_size_sets_the_unit(tmp_path):
    path = saved(tmp_path / "mine.obj", hull() | four("prop"))
    status, out = draft(path, "--category", "UAV", "--size", "4.6", "--front=-x", "--up", "z")
    assert status == 0
    record = yaml.safe_load(out.read_text())["mine"]
    unit = 4.6 / 0.46
    assert (
        record["unit"] == pytest.approx(unit)
        and record["front"] == "-x"
        and "GUESSED" not in str(record["up"])
    )
    assert record["row"]["size_m"] == pytest.approx(unit * np.hypot(0.26, 0.22), rel=1e-3)
    assert record["row"]["n_rotors_or_wings"] == 4
    assert np.ptp(cloud(out).points[:, 1]) == pytest.approx(4.6, rel=0.02)


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (1000.0, r"write `unit: mm` \(--unit mm\), with which it measures 0.46"),
        (0.1, "no unit fits: write `unit: [0-9.]+` .*--size [0-9.]+`, .*`row: {size_m: 0.034"),
        (1 / 0.0254, "write `unit: in`"),
    ],
)
def test_a_size_that_does_not_fit_is_refused_with_the_line_to_write_which_is_accepted(
    factor, words, tmp_path, capsys
):
    shapes = {"hull": box((0.2, 0.12, 0.06))} | four("prop")
    for shape in shapes.values():
        shape.apply_scale(factor)
    path = saved(tmp_path / "a.obj", shapes)
    status, out = draft(path, "--subtype", "DJI Mavic 3 Pro", "--unit", "m")
    assert status == 2 and not out.exists()
    error = capsys.readouterr().err
    assert "is the unit 'm' right?" in error
    assert re.search(words, error)
    proposed = re.search(r"--size ([0-9.]+)`", error)
    if proposed:
        assert draft(path, "--subtype", "DJI Mavic 3 Pro", "--size", proposed[1])[0] == 0
        assert cloud(out).record["published"]["size_m"] == pytest.approx(0.38, abs=0.1)
    assert bool(proposed) == ("no unit fits" in error)


@pytest.mark.parametrize("subtype", ["DJI Mavic 3 Pro", "EH 216 S"])
def test_inspect_and_new_find_the_same_unit_of_a_published_target(
    subtype, tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    shapes = hull() | four("prop")
    for shape in shapes.values():
        shape.apply_scale(35.0)
    path = saved(tmp_path / "a.obj", shapes)
    assert main(["target", "inspect", str(path), "--subtype", subtype]) == 0
    inspected = re.search(r"^unit +(\S+)", capsys.readouterr().out, re.M)[1]
    asked = Asked(path, tmp_path, load_table(SHIPPED / "config/targets.csv"), subtype)
    drafted = inspect_mesh(path, "UAV", asked.unit, asked.row).unit
    assert inspected == str(drafted)
    assert main(f"target inspect {path} --subtype Dog".split()) == 2
    assert "--subtype is 'Dog', expected one of" in capsys.readouterr().err


@pytest.mark.parametrize("aside", [-5.0, 0.0, 5.0])
def test_both_wings_are_found_wherever_the_origin_of_a_file_lies(aside):
    more = {"normals": np.ones((2, 3)), "component": np.zeros(2, int), "corners": 2, "area": 1.0}
    body = Pool(np.array([[aside - 0.04, -0.2, 0.0], [aside + 0.04, 0.2, 0.1]]), **more)
    pools = {"body": body}
    kinds = {"body": "body"}
    for name, side in (("left", -1), ("right", 1)):
        points = np.array([[0.05 * side + aside, 0.0, 0.0], [0.5 * side + aside, 0.1, 0.01]])
        hinge = np.array([0.05 * side + aside, 0.0, 0.0])
        pools[name] = Pool(points, **more, hinge=hinge, axis=np.array([0.0, 1.0, 0.0]))
        kinds[name] = "wing"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        refuse_implausible(pools, kinds, {}, "Bird", "gull")
    del pools["left"]
    pools["other"] = pools["right"]
    kinds["other"] = "wing"
    with pytest.warns(InputWarning, match="every wing is on one side"):
        refuse_implausible(pools, kinds, {}, "Bird", "gull")


def test_blades_by_name_of_which_some_stand_alone_are_asked_for_by_number(tmp_path, refused):
    shapes = {"hull": box((0.2, 0.12, 0.06))}
    for index, (x, y) in enumerate(HUBS):
        for side in (-1, 1):
            shape = box((0.1, 0.01, 0.004), (side * 0.055, 0, 0))
            shapes[f"blade{index}{side}"] = turned(
                shape, np.pi / 4 * (index == 0), [0, 0, 1], (x, y, 0.06)
            )
    path = saved(tmp_path / "craft.obj", shapes)
    assert draft(path, "--category", "UAV")[0] == 0
    assert path.with_suffix(".yaml").read_text().count("kind: rotor") == 4
    del shapes["blade0-1"]
    words = (saved(tmp_path / "seven.obj", shapes), "--category", "UAV")
    assert "4 rotors found, expected --rotors 4 where that is all" in refused(*words)
    assert draft(*words, "--rotors", "4")[0] == 0


def bird(tmp_path: Path, long: float, lean: float = 0.0) -> Path:
    """A bird longer or shorter than its span, its wings bent down from 4 cm out.

    `lean` moves them apart.
    """
    shapes = {"trunk": trimesh.creation.icosphere(3)}
    shapes["trunk"].apply_scale([0.045, long / 2, 0.04])
    for side in (-1, 1):
        wing = box((0.2, 0.1, 0.01)).subdivide().subdivide().subdivide()
        wing.vertices[:, 2] -= 0.5 * np.abs(wing.vertices[:, 0] + side * 0.1)
        wing.vertices[:, 2] += 0.6 * wing.vertices[:, 1]  # its slices are higher than half a trunk
        wing.apply_translation([side * 0.14, 0.02 + lean * side, 0.03])
        shapes[f"w{side}"] = wing
    return saved(tmp_path / "bird.obj", shapes)


@pytest.mark.parametrize("long", [0.3, 0.65])
def test_wings_reach_the_body_of_a_bird_whether_it_is_longer_than_its_span_or_not(long, tmp_path):
    status, out = draft(bird(tmp_path, long), "--category", "Bird", "--unit", "m")
    assert status == 0
    found = cloud(out)
    assert found.kinds == ("body", "wing", "wing")
    wings = found.points[found.part > 0]
    assert np.abs(wings[:, 0]).min() < 0.05 and np.abs(wings[:, 0]).max() == pytest.approx(
        0.24, rel=0.03
    )
    np.testing.assert_allclose(np.abs(found.hinges[1:, 0]), 0.04, atol=0.015)
    assert np.ptp(found.points[:, 1]) == pytest.approx(long, rel=0.03)


def test_a_glb_s_bird_is_y_up_and_one_wing_or_a_span_that_no_bird_has_is_refused(tmp_path, refused):
    shape = trimesh.load(bird(tmp_path, 0.3), force="mesh", process=False)
    shape.apply_transform(
        trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0])
    )  # z up becomes y up
    whole, half, spread = (tmp_path / f"{name}.glb" for name in ("whole", "half", "spread"))
    shape.export(whole)
    assert draft(whole, "--category", "Bird")[0] == 0
    text = whole.with_suffix(".yaml").read_text()
    assert "up: y  # as the file's format defines it" in text and "the mirror plane" in text
    wings = cloud(whole.with_suffix(".yaml"))
    assert np.sign(wings.hinges[1:, 0]).tolist() == [-1, 1]
    kept = shape.triangles_center[:, 0] > -0.05
    trimesh.Trimesh(shape.vertices, shape.faces[kept], process=False).export(half)
    assert "half.glb: its sides along x do not mirror one another" in refused(
        half, "--category", "Bird"
    )
    shape.apply_scale([9, 1, 1])
    shape.apply_scale(0.3)
    shape.export(spread)
    assert "expected a span of 0.7 to 6.0 lengths" in refused(spread, "--category", "Bird")


def test_georeferenced_coordinates_keep_all_their_digits(tmp_path):
    shapes = hull() | four("prop")
    away = {
        name: shape.copy().apply_translation([465999.8, 5246999.9, 400.0])
        for name, shape in shapes.items()
    }
    clouds = []
    for name, one in (("near", shapes), ("away", away)):
        status, out = draft(
            saved(tmp_path / f"{name}.obj", one),
            "--category",
            "UAV",
            "--subtype",
            "a",
            "--unit",
            "m",
        )
        assert status == 0
        clouds.append(cloud(out))
    np.testing.assert_allclose(clouds[1].hinges[1:], clouds[0].hinges[1:], atol=2e-4)
    np.testing.assert_allclose(
        np.ptp(clouds[1].points, axis=0), np.ptp(clouds[0].points, axis=0), atol=1e-4
    )


def test_unusual_sizes_are_questioned_and_a_glb_whose_unit_cannot_be_metres_is_recognised(
    tmp_path, refused
):
    shapes = rover("wheel", (0.9, 2.1, 0.5), 0.35, 0.7)
    toy = saved(tmp_path / "toy.obj", shapes)
    vehicle = ("--category", "Vehicle")
    assert "measures 2.1 m in the unit 'm' (guessed from the size), expected 2.5" in refused(
        toy, *vehicle
    )
    assert draft(toy, *vehicle, "--size", "4.2")[0] == 0
    whole = trimesh.Scene()
    for name, shape in rover("wheel", (1.8, 4.4, 0.9), 0.75, 1.3).items():
        turned(shape, -np.pi / 2, [1, 0, 0])
        shape.apply_scale(100)
        whole.add_geometry(shape, node_name=name, geom_name=name)
    whole.export(tmp_path / "car.glb")
    assert draft(tmp_path / "car.glb", *vehicle)[0] == 0
    text = (tmp_path / "car.yaml").read_text()
    assert (
        "unit: cm  # GUESSED" in text
        and "up: y  #" in text
        and "front: z  # the wheel axles" in text
    )


def test_a_bird_whose_sides_size_or_kind_cannot_be_seen_is_asked_for(tmp_path, refused):
    path = bird(tmp_path, 0.3, lean=0.07)
    axes = ("--category", "Bird", "--up", "z", "--front", "y")
    assert "left and right of the bird cannot be seen, expected --up" in refused(
        path, "--category", "Bird"
    )
    assert "expected 0.08 to 2.5 m for a Bird: give --unit or --size" in refused(
        path, *axes, "--size", "717"
    )
    corner = trimesh.Trimesh(
        [[9, 9, 9], [10, 9, 9], [9, 10, 9], [9, 9, 10]],
        [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
    )
    one_sided = saved(tmp_path / "a.obj", {"a": corner})
    assert "a.obj: its sides along x do not mirror one another" in refused(
        one_sided, *axes, "--unit", "m"
    )
    assert "bird.obj: its category cannot be seen: expected --category UAV" in refused(path)
    assert "bird.obj: its sides along x do not mirror one another" in refused(path, *axes)
    assert not path.with_suffix(".yaml").exists()
