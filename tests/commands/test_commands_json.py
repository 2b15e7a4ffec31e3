"""Answers of `lowalt --json`: valid JSON with the keys that the reference names, and the plain
command's status.
"""

import json
import re
from functools import partial
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from json_answers import PAGE, answered
from lowalt.__main__ import main
from lowalt.commands import workflow
from lowalt.commands.command_line import as_json
from lowalt.commands.command_table import COMMANDS
from lowalt.config.layers import load, plain
from lowalt.files.atomic import replacing
from lowalt.machine.progress import Reporter
from lowalt.scene import explanation
from lowalt.scene.effects import PLACES
from lowalt.workflow.board import Board, Job
from lowalt.workflow.status import FOLDER, PLANNED_JOBS

ROOT = Path(__file__).parents[2]
CONFIG = ROOT / "config/default.yaml"
SCHEMA = ROOT / "workflow/schemas/config.schema.yaml"
STATION = {"method", "decisions", "rms_change", "other_cells"}


@pytest.fixture
def answer(capsys):
    """A function that runs a command line with --json; returns its answer and exit status."""
    return partial(answered, capsys)


def test_explain_takes_out_together_what_needs_each_other_and_a_target_without_surfaces(
    answer, tmp_path, monkeypatch
):
    steps = []
    monkeypatch.setattr(Reporter, "__call__", lambda self, done: steps.append((done, self._unit)))
    overlay = tmp_path / "scene.yaml"
    effects = (
        "effects: {clutter: {}, canceller: {kind: pulse}}, targets: {own: {more:"
        " config/targets/more.yaml}}"
    )
    overlay.write_text(
        f"{{run: a, network: {{symbols: 32}}, spectra: {{vrp: {{window: 16}}}}, {effects}}}"
    )
    found, status = answer("explain", str(overlay), "--sample", "Road cyclist:0")
    changes = {change["effect"]: change for change in found["changes"]}
    assert status == 0 and not changes["clutter"]["refused"] and changes["clutter"]["signal"] > 0.01
    assert (
        changes["clutter"]["also"] == "and without canceller" and changes["canceller"]["also"] == ""
    )
    assert (
        changes["receiver_noise"]["also"] == "at no set SNR"
        and changes["receiver_noise"]["signal"] > 0
    )
    assert "surfaces" in changes["occlusion"]["refused"]
    assert steps == [(done, "effects") for done in range(1, len(changes) + 1)], (
        "trying every effect takes a minute"
    )


def test_explain_answers_with_findings_and_changes(answer, capsys, tmp_path):
    overlay = tmp_path / "scene.yaml"
    mine = tmp_path / "mine.yaml"
    effects = "effects: {iq_imbalance: {}, adc: {bits: 24, backoff_db: 40.0}}"
    overlay.write_text(
        f"{{run: a, network: {{symbols: 32}}, spectra: {{vrp: {{window: 16}}}}, {effects}}}"
    )
    scene = ["explain", str(overlay), "--sample", "Crow:3"]
    model = str(ROOT / "results/zoo/default-unseen.safetensors")
    found, status = answer(*scene, "--suggest", "1e-3", "--out", str(mine), "--model", model)
    assert status == 0 and [one["station"] for one in found["findings"]] == ["A", "B", "C"]
    assert all(one["right"] > 0.99 and one["subtype"] == "Crow" for one in found["findings"])
    changes = {one["effect"]: one for one in found["changes"]}
    assert set(changes) == set(PLACES) and [one["effect"] for one in found["changes"]][:2] == [
        "iq_imbalance",
        "adc",
    ]
    assert changes["iq_imbalance"]["signal"] > 1e-3 > changes["adc"]["signal"]
    # 24 bits change no image, so no answer; leakage buries the target.
    assert (
        changes["adc"]["more"] == {"pixels": 0, "answers": 0}
        and changes["transmit_leakage"]["more"]["pixels"] > 0.5
    )
    assert "there is no clutter to cancel" in changes["canceller"]["refused"]
    # The suggested scene has the effects that matter, and is a scene.
    assert load([CONFIG, mine], SCHEMA)["effects"] == {"iq_imbalance": {}}
    assert main([*scene, "--no-table", "--levels"]) == 0
    text = capsys.readouterr().out
    assert "is chosen in 100% of the symbols: Bird 100%" in text and "expected echo" in text


def test_a_wrong_cell_changes_the_symbols_that_hold_another_cell(answer, tmp_path, monkeypatch):
    now_s = [0.0]
    received_signal = explanation.received_signal

    def slow(scene, *given):
        now_s[0] += 1e-3 * len(scene.effects)
        return received_signal(scene, *given)

    # On this clock an effect takes a millisecond.
    monkeypatch.setattr(explanation, "time", SimpleNamespace(process_time=lambda: now_s[0]))
    monkeypatch.setattr(explanation, "received_signal", slow)
    overlay = tmp_path / "scene.yaml"
    overlay.write_text(
        "network: {symbols: 32}\nspectra: {vrp: {window: 16}}\n"
        "effects: {cell_error: {probability: 0.4, spread_cells: 60}}\n"
    )
    found, _ = answer("explain", str(overlay), "--sample", "Crow:3", "--station", "B")
    right = {finding["station"]: finding["right"] for finding in found["findings"]}
    # An error of one cell still holds the target. The table is that of the station asked for, not
    # of the first.
    assert 0.3 < right["B"] < 0.9 and abs(right["A"] - right["B"]) > 0.1
    assert found["changes"][0]["cells"] == pytest.approx(1 - right["B"], abs=0.05)
    assert {
        round(one["ms"], 6) for one in found["changes"] if not one["refused"] + one["also"]
    } == {1.0}


def test_spectra_answers_with_the_size_of_each(answer, capsys):
    found, status = answer("spectra")
    assert main(["spectra"]) == 0
    text = capsys.readouterr().out.splitlines()
    assert (
        len(text) == 2 * len(found["spectra"]) + 1
        and text[-1] == f"medians of 5; {found['hardware']}"
    )
    for one, first, second in zip(found["spectra"], text[::2], text[1::2], strict=False):
        said = (
            f"{one['name']} ({one['title']}): {one['rows']} rows, {one['windows']} windows, zero at"
            " index "
        )
        assert first.startswith(f"{said}{one['zero_index']}, ") and second == f"  {one['source']}"
        assert first.endswith(", ".join(f"{key} {value}" for key, value in one["settings"].items()))
    assert status == 0
    assert [(one["name"], one["rows"], one["windows"]) for one in found["spectra"]] == [
        ("vrp", 256, 144),
        ("trp", 1024, 392),
        ("vt", 123, 392),
    ]
    assert all(one["image_ms"] > 0 for one in found["spectra"])


def snakemake(code, jobs=()):
    """In the place of Snakemake: note planned jobs, leave a run's state behind, end with a status."""

    def run(line, stdout=None, env=None, **_):
        assert stdout == 2
        Path(env[PLANNED_JOBS]).write_text("".join(json.dumps(job) + "\n" for job in jobs))
        board = Board({"clouds": 2}, 1.0)
        board.start(1, Job("clouds", "", "", 1.0))
        board.finish(1, 2.0, good=not code)
        with replacing(FOLDER / "1.json") as temporary:
            kept = {
                "pid": 1,
                "process": None,
                "state": "ended",
                "written": 1e12,
                "board": board.kept(),
            }
            temporary.write_text(json.dumps(kept))
        return SimpleNamespace(returncode=code)

    return run


def test_run_and_report_answer_with_what_ran_and_end_with_the_workflow_s_status(
    answer, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(workflow.subprocess, "run", snakemake(7))
    found, status = answer("run")
    assert (
        status == found["status"] == 7
        and found["command"][2] == "snakemake"
        and found["seconds"] >= 0
    )
    assert (found["stages"]["clouds"]["total"], found["stages"]["clouds"]["failed"]) == (2, 1)
    job = {"rule": "clouds", "files": ["a.npz"], "reason": "Missing output files: a.npz"}
    monkeypatch.setattr(workflow.subprocess, "run", snakemake(0, [job]))
    found, status = answer("run", "-n")
    assert status == 0 and found["jobs"] == [job] and "stages" not in found
    settings = load([ROOT / "config/default.yaml", ROOT / "config/tiny.yaml"], SCHEMA)
    Path("results/tiny").mkdir(parents=True)
    Path("results/tiny/config.yaml").write_text(yaml.safe_dump(plain(settings)))
    found, status = answer("report", "results/tiny")
    assert status == 0 and found["files"] == ["results/tiny/report.html"] and found["stages"]
    assert answer("report", "--gallery") == ({"files": ["results/index.html"], "runs": ["tiny"]}, 0)
    monkeypatch.setattr(workflow.subprocess, "run", snakemake(1))
    found, status = answer("report", "results/tiny")
    assert status == found["status"] == 1 and found["files"] == []


def test_an_answer_has_no_number_that_json_lacks():
    odd = {
        "a": np.array([1.5, np.inf]),
        "b": (float("-inf"), np.float32("nan")),
        Path("c"): Path("d"),
    }
    assert json.loads(as_json(odd)) == {"a": [1.5, "inf"], "b": ["-inf", None], "c": "d"}
    with pytest.raises(TypeError, match="set"):
        as_json({"a": {1}})


def test_every_command_with_an_answer_takes_json(capsys):
    """All commands but `completion`, whose answer is a script. The page has those of extensions too."""
    actions = "inspect|new|make|show|train|drone|bird|vehicle|tracks|score|confirm|table"
    documented = re.findall(rf"\.venv/bin/lowalt (\w+(?: (?:{actions})\b)?)", PAGE)
    for words in documented:
        if words.split()[0] not in COMMANDS:
            continue
        with pytest.raises(SystemExit):
            main([*words.split(), "--help"])
        assert "--json" in capsys.readouterr().out
    assert {*COMMANDS} - {"completion"} <= {words.split()[0] for words in documented}
