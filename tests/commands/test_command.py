"""What the stages' command lines share: settings as JSON or a file, clear words, exit status 2."""

import errno
import json
import os
import runpy
import subprocess
import sys

import pytest

from lowalt.__main__ import main
from lowalt.config.command import error_sentence, pick, run, settings
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError


def test_settings_come_as_json_or_as_a_file(tmp_path):
    path = tmp_path / "settings.json"
    path.write_text(json.dumps({"a": [1, "inf"]}))
    assert settings(f"@{path}") == settings('{"a": [1, "inf"]}') == {"a": [1, "inf"]}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{", "not settings, expected a JSON object"),
        # Of a long text the first 80 characters are shown.
        ("{" + 90 * "a", rf"^--settings '{{{79 * 'a'}': not settings"),
        (f'["{90 * "1"}"]', rf"^--settings '\[\"{78 * '1'}': not settings \(list, expected"),
        ("[1]", "list, expected a JSON object"),
        ("@none.json", "no file at none.json"),
    ],
)
def test_bad_settings_are_refused(text, words):
    with pytest.raises(InputError, match=words):
        settings(text)


def test_pick_wants_exactly_its_keys():
    assert pick({"b": 2, "a": 1}, "a", "b") == [1, 2]
    with pytest.raises(InputError, match=r"missing \['b'\], unknown \['c'\]"):
        pick({"a": 1, "c": 3}, "a", "b")


@pytest.mark.parametrize("stage", ["targets", "motion", "echo", "noise", "tiles", "report"])
def test_a_stage_says_what_is_wrong_and_ends_with_2(stage, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["", "--settings", "@nowhere.json"])
    monkeypatch.delitem(sys.modules, f"lowalt.{stage}.__main__", raising=False)
    with pytest.raises(SystemExit) as stopped:
        runpy.run_module(f"lowalt.{stage}", None, "__main__")
    said = capsys.readouterr()
    assert (stopped.value.code, said.out) == (2, "")
    assert "no file at nowhere.json" in said.err and "Traceback" not in said.err


def test_a_path_that_the_system_refuses_is_named_in_one_line(tmp_path, monkeypatch, capsys):
    file = tmp_path / "file"
    file.write_text("")
    monkeypatch.setattr(sys, "argv", ["stage"])
    with pytest.raises(SystemExit) as stopped:
        run(lambda arguments: (file / "below").write_text("x"))
    said = capsys.readouterr().err
    assert (
        stopped.value.code == 2
        and said.startswith(f"error: {file}/below: Not a directory")
        and said.count("\n") == 1
    )
    assert (
        error_sentence(OSError(errno.ENOSPC, "no space", "a"))
        == "a: no space, expected room to write"
    )
    with pytest.raises(OSError, match="broken"):
        error_sentence(OSError(errno.EIO, "broken", "file"))


def test_a_package_that_is_not_installed_is_named_with_the_command_that_installs_it(
    tmp_path, monkeypatch, capsys
):
    sample = tmp_path / "sample.png"
    sample.write_bytes(b"")
    for module in [name for name in sys.modules if name.startswith("lowalt.recognition.predict")]:
        monkeypatch.delitem(sys.modules, module)
    monkeypatch.setitem(sys.modules, "torch", None)
    assert main(["predict", "results/zoo/default-seen.safetensors", str(sample)]) == 2
    assert capsys.readouterr().err == (
        "error: the package torch is not installed, expected `pip install torch torchvision timm`\n"
    )
    with pytest.raises(ModuleNotFoundError, match="nowhere"):
        error_sentence(ModuleNotFoundError("nowhere", name="nowhere"))


def test_a_reader_that_has_enough_ends_a_command_without_a_traceback():
    reading, writing = os.pipe()
    os.close(reading)
    ended = subprocess.run(
        [sys.executable, "-m", "lowalt", "completion"], stdout=writing, stderr=subprocess.PIPE
    )
    os.close(writing)
    assert (ended.returncode, ended.stderr) == (141, b"")


def test_a_failed_write_leaves_nothing_and_keeps_what_was(tmp_path):
    path = tmp_path / "table.csv"
    path.write_text("old")
    with pytest.raises(RuntimeError), replacing(path) as temporary:
        temporary.write_text("half")
        raise RuntimeError
    assert [item.name for item in tmp_path.iterdir()] == ["table.csv"]
    assert path.read_text() == "old"
    with replacing(path) as temporary:
        temporary.write_text("new")
    assert path.read_text() == "new"
