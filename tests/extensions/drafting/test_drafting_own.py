"""Own targets: from a mesh to the right cloud.

A mesh is inspected, a record is drafted from it, and the draft becomes the right cloud at once.
"""

from pathlib import Path

import numpy as np
import pytest
import trimesh
import yaml
from PIL import Image

from lowalt.__main__ import main
from lowalt.extensions.drafting.guesses import guessed_axes, guessed_unit
from lowalt.extensions.drafting.inspection import described, inspect_mesh
from lowalt.files.errors import InputWarning
from lowalt.targets.cloud import read
from lowalt.targets.make import make
from lowalt.targets.records import load_table, merge, read_records
from meshes import box, quadrotor

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(("blades", "unit", "metres"), [(False, "in", 0.0254), (True, "mm", 0.001)])
def test_a_quadrotor_s_four_propellers_are_found_and_drafted(blades, unit, metres, tmp_path):
    quadrotor(blades, 1 / metres).export(tmp_path / "craft.stl")
    out = tmp_path / "craft.yaml"
    command = [
        "target",
        "new",
        str(tmp_path / "craft.stl"),
        "--subtype",
        "DJI Inspire 2",
        "--inputs",
        str(tmp_path),
    ]
    assert main([*command, "--unit", unit, "--out", str(out)]) == 0
    # The draft takes the shorter side for the front and marks that as a guess; the user knows
    # better.
    assert "front: y  # GUESSED" in out.read_text()
    out.write_text(out.read_text().replace("front: y", "front: x"))
    parts = yaml.safe_load(out.read_text())["DJI Inspire 2"]["parts"]
    assert sorted(parts) == [
        "body",
        "front left rotor",
        "front right rotor",
        "rear left rotor",
        "rear right rotor",
    ]
    made = tmp_path / "own.npz"
    assert main(f"target make {out} --inputs {tmp_path} --out {made}".split()) == 0
    cloud = read(made)
    factor = cloud.record["published"]["size_m"] / np.hypot(0.24, 0.2)
    # The file's x is the front, so its y is the left.
    places = sorted([x, y] for x in (-0.1, 0.1) for y in (-0.12, 0.12))
    found = sorted(np.round(cloud.hinges[1:, :2] / factor, 2).tolist())
    np.testing.assert_allclose(found, places, atol=1e-9)
    assert abs(cloud.axes[1:, 2]) == pytest.approx(1, abs=1e-3)
    assert Image.open(made.with_suffix(".png")).size[0] > 1000


def test_an_alike_plate_at_another_height_is_no_rotor(tmp_path):
    whole = trimesh.util.concatenate([quadrotor(False), box((0.12, 0.012, 0.004), (0, 0, -0.06))])
    whole.export(tmp_path / "craft.stl")
    rotors = [
        part
        for part in inspect_mesh(tmp_path / "craft.stl", "UAV").components
        if part.guess == "rotor"
    ]
    assert sorted(round(float(part.centre[2]), 3) for part in rotors) == [0.05] * 4


@pytest.mark.parametrize(
    ("sizes", "category", "unit"),
    [
        ([0.3, 0.3, 0.1], "UAV", "m"),
        ([300, 200, 80], "UAV", "mm"),
        ([70, 180, 55], "Vehicle", "in"),
        ([180, 460, 150], "Vehicle", "cm"),
        ([1.8, 4.6, 1.5], "Vehicle", "m"),
        ([0.16, 0.1, 0.05], "Bird", "m"),
        ([21.0, 32.0, 9], "Bird", "cm"),
        ([0.9, 2.1, 0.7], "Vehicle", "m"),
        ([250, 90, 320], "Vehicle", "cm"),
    ],
)
def test_units_are_guessed_from_the_usual_proportions(sizes, category, unit):
    assert guessed_unit(np.array(sizes), category) == unit


def bird(scale: float = 1.0) -> trimesh.Trimesh:
    """A body, two thin wings from 4 cm out and a tail that spreads wider than that.

    Its front is along y, and it is widest along x.
    """
    shapes = [box((0.08, 0.25, 0.08)), box((0.12, 0.08, 0.01), (0, -0.16, 0.03))]
    shapes += [box((0.3, 0.1, 0.01), (side * 0.18, 0.02, 0.03)) for side in (-1, 1)]
    whole = trimesh.util.concatenate(
        [shape.subdivide().subdivide().subdivide() for shape in shapes]
    )
    whole.apply_scale(scale)
    return whole


def test_a_bird_s_wings_are_drafted_where_its_body_ends(tmp_path):
    bird(100).export(tmp_path / "bird.ply")
    found = inspect_mesh(tmp_path / "bird.ply", "Bird")
    assert (found.unit, found.up, found.front) == (
        "cm",
        "z",
        "y",
    ) and found.shoulder_m == pytest.approx(0.04, abs=0.01)
    assert "wings    may begin 0.0" in described(found)
    out = tmp_path / "bird.yaml"
    assert (
        main(
            f"target new {tmp_path}/bird.ply --subtype Crow --inputs {tmp_path} --out {out}".split()
        )
        == 0
    )
    assert out.read_text().count("kind: wing") == out.read_text().count("wing: {kind") == 2
    row = load_table(ROOT / "config/targets.csv")["Crow"]
    cloud = make(merge(row, read_records(out)["Crow"], "here"), tmp_path, 1)
    sides = {
        name: np.sign(cloud.points[cloud.part == part, 0]) for part, name in enumerate(cloud.names)
    }
    assert (sides["right wing"] == 1).all() and (sides["left wing"] == -1).all()
    # The tail stays with the body.
    factor = np.ptp(cloud.points[:, 0]) / 0.66
    assert cloud.points[cloud.part > 0, 1].min() > (-0.05 - 0.005) * factor


def test_inspection_leaves_a_picture(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    quadrotor(False).export(tmp_path / "own {craft}.stl")
    assert main(["target", "inspect", "own {craft}.stl"]) == 0
    assert "picture  own {craft}-inspect.png" in capsys.readouterr().out
    picture = Image.open(tmp_path / "own {craft}-inspect.png")
    assert picture.size[0] > 1000 and len(picture.convert("RGB").getcolors(1 << 24)) > 20


@pytest.mark.usefixtures("without_target_picture")
def test_a_car_without_wheels_is_asked_for_them_then_made_and_shown_with_a_warning(
    tmp_path, capsys, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    box((1.8, 4.5, 1.4), (0, 0, 0.7)).subdivide().export(tmp_path / "car.stl")
    out = tmp_path / "car.yaml"
    made = tmp_path / "car.npz"
    command = [
        "target",
        "new",
        str(tmp_path / "car.stl"),
        "--subtype",
        "AITO M9 2024",
        "--inputs",
        str(tmp_path),
    ]
    assert main([*command, "--out", str(out)]) == 2 and not out.exists()
    assert (
        "car.stl: 0 wheels found, expected 4; otherwise name each wheel's pieces"
        in capsys.readouterr().err
    )
    assert main([*command, "--out", str(out), "--wheels", "0"]) == 0
    with pytest.warns(InputWarning, match="0 wheels, expected at least 3"):
        assert main(f"target make {out} --inputs {tmp_path} --out {made}".split()) == 0
    assert made.with_suffix(".png").exists() and read(made).kinds == ("body",)


def test_axes_are_guessed_from_the_extents():
    assert guessed_axes(np.array([1.8, 1.5, 4.5]), "Vehicle") == ("y", "z")
    assert guessed_axes(np.array([0.3, 0.3, 0.1]), "UAV") == ("z", "x")
    assert guessed_axes(np.array([0.3, 0.05, 0.2]), "Bird") == ("y", "z")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (
            ["new", "{folder}/craft.stl", "--subtype", "Dodo", "--inputs", "{folder}"],
            "--subtype is 'Dodo'",
        ),
        (
            ["new", "{folder}/craft.stl", "--subtype", "Crow", "--inputs", "{folder}/other"],
            "expected --inputs with it",
        ),
        (
            [
                "new",
                "{folder}/craft.stl",
                "--subtype",
                "Walking Pedestrian 1",
                "--inputs",
                "{folder}",
            ],
            "a pedestrian",
        ),
        (["inspect", "{folder}/nothing.stl"], "no file at"),
        (
            ["new", "{folder}/nothing.stl", "--subtype", "Crow", "--inputs", "{folder}"],
            "no file at",
        ),
        (
            ["make", "{folder}/two.yaml", "--inputs", "{folder}"],
            "--subtype is None, expected one of",
        ),
        (["show", "{folder}/craft.stl"], "not a cloud file"),
    ],
)
def test_wrong_commands_end_in_one_line_and_leave_nothing(arguments, words, tmp_path, capsys):
    quadrotor(False).export(tmp_path / "craft.stl")
    (tmp_path / "two.yaml").write_text("Crow: {source: builtin}\nOwl: {source: builtin}\n")
    before = sorted(tmp_path.iterdir())
    assert main(["target", *(word.format(folder=tmp_path) for word in arguments)]) == 2
    error = capsys.readouterr().err
    assert words in error and error.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before
