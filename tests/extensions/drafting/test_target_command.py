"""The command `lowalt target`: from a mesh to a picture, and from a record with its row to a cloud."""

import argparse
from functools import partial
from pathlib import Path

import pytest
import yaml

from command_lines import assert_help_with_example, completions
from json_answers import answered
from lowalt.__main__ import main
from lowalt.extensions.drafting import mesh_picture, target
from lowalt.report.figures import target_picture
from lowalt.targets.cloud import read
from meshes import quadrotor

ROOT = Path(__file__).parents[3]
BUS = yaml.safe_load((ROOT / "config/targets/more.yaml").read_text())["City bus"]


@pytest.fixture
def answer(capsys):
    """A function that runs a command line with --json; returns its answer and exit status."""
    return partial(answered, capsys)


def records(folder, content, name="mine"):
    """A file of these records; returns its path."""
    path = folder / f"{name}.yaml"
    path.write_text(yaml.safe_dump(content))
    return str(path)


def test_targets_answer_from_mesh_to_picture(answer, tmp_path, monkeypatch):
    quadrotor(False, 1000).export(tmp_path / "craft.stl")
    monkeypatch.chdir(tmp_path)
    # The pictures have tests of their own.
    monkeypatch.setattr(mesh_picture, "inspection_picture", lambda found: b"picture")
    monkeypatch.setattr(target_picture, "target_picture", lambda cloud: b"picture")
    found, status = answer("target", "inspect", "craft.stl")
    assert status == 0 and len(found["components"]) == 5 and found["triangles"] == 60
    assert Path(found["picture"]).is_file()
    draft = ["target", "new", "craft.stl", "--subtype", "DJI Inspire 2"]
    found, _ = answer(*draft)
    assert found["file"] is None and yaml.safe_load(found["text"]) and found["moving_parts"] == 4
    assert found["marked_lines"] == found["text"].count("GUESSED")
    assert answer(*draft, "--out", "craft.yaml")[0]["file"] == "craft.yaml"
    found, _ = answer("target", "make", "craft.yaml", "--out", "craft.npz")
    assert found["points"] > 0 and len(found["parts"]) == 5 and Path(found["picture"]).is_file()
    assert answer("target", "show", "craft.npz") == ({"picture": "craft.png"}, 0)


def test_a_unit_is_a_name_or_metres():
    assert [target._unit(text) for text in ("mm", "0.3048", "1e6")] == ["mm", 0.3048, 1e6]
    for wrong in ("yard", "0", "-1", "1000001", "nan"):
        with pytest.raises(argparse.ArgumentTypeError, match="or metres"):
            target._unit(wrong)


def test_the_command_makes_a_record_with_its_row(tmp_path, monkeypatch):
    monkeypatch.setattr(target, "_picture", lambda cloud, out: str(out))
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "bus.npz"
    own = records(tmp_path, {"My bus": BUS})
    assert main(["target", "make", own, "--out", str(out)]) == 0
    assert read(out).record["published"]["len_m"] == 11.95
    bare = records(
        tmp_path, {"My bus": {key: value for key, value in BUS.items() if key != "row"}}, "bare"
    )
    assert main(["target", "make", bare, "--out", str(out)]) != 0


def test_every_action_has_help_with_an_example_that_parses(capsys, monkeypatch):
    for action in ("inspect", "new", "make", "show"):
        assert_help_with_example(["target", action], capsys, monkeypatch)


@pytest.mark.parametrize(
    ("words", "current", "wanted"),
    [
        (["lowalt", "target"], "ma", ["make"]),
        (["lowalt", "target", "make"], "--inp", ["--inputs"]),
    ],
)
def test_a_shell_completes_actions_and_their_options(words, current, wanted, capsys):
    for found in completions(words, current, capsys):
        assert found == wanted
