"""Answers of `lowalt --json`: valid JSON with the keys that the reference names, and the plain command's status."""

import json
import math
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from lowalt.__main__ import main
from lowalt.commands import spectra, workflow
from lowalt.commands.for_programs import as_json
from lowalt.common.config import load, plain
from lowalt.common.files import replacing
from lowalt.report.figures import inspection, target
from lowalt.shards.dataset import Dataset, Place
from lowalt.tiles.render import Renderer
from lowalt.workflow.board import Board, Job
from lowalt.workflow.status import FOLDER, PLANNED_JOBS
from test_targets_own import craft

ROOT = Path(__file__).parents[1]
CONFIG, SCHEMA = ROOT / "config/default.yaml", ROOT / "workflow/schemas/config.schema.yaml"
PAGE = (ROOT / "docs/reference/json.md").read_text()
STATION = {"method", "decisions", "rms_change", "other_cells"}
STATIC = ("settings", "stages", "method")
"""Keys whose own keys are names of settings, stages or fields that the reference does not list."""


def refused(text):
    raise AssertionError(f"{text} is not JSON")


@pytest.fixture
def answer(capsys):
    """What a command line prints with --json, and its exit status; every key stands on the page of the reference."""

    def asked(*words):
        try:
            status = main([*map(str, words), "--json"])
        except SystemExit as ended:
            status = ended.code
        found = json.loads(capsys.readouterr().out, parse_constant=refused)
        missing = {key for key in keys(found) if f"`{key}`" not in PAGE}
        assert not missing
        return found, status

    return asked


def keys(value):
    """All keys of nested values, without those below STATIC."""
    if isinstance(value, list):
        return set().union(*map(keys, value)) if value else set()
    if not isinstance(value, dict):
        return set()
    return set(value).union(*(keys(item) for name, item in value.items() if name not in STATIC))


def test_explain_answers_with_the_facts_of_its_text(answer, capsys, tmp_path):
    overlay = tmp_path / "scene.yaml"
    effects = "effects: {squint: {}, iq_imbalance: {}}"
    overlay.write_text(f"{{network: {{symbols: 32}}, spectra: {{vrp: {{window: 16}}}}, {effects}}}")
    scene = ["explain", str(overlay), "--sample", "Crow:3"]
    found, status = answer(*scene)
    assert status == 0 and found["snr_db"][-1] == "inf"
    assert found["time"]["base_ms"] > 0 and found["time"]["hardware"]
    (sample,) = found["samples"]
    assert set(sample) >= STATION and (sample["subtype"], sample["model"]) == ("Crow", 3)
    assert main([*scene, "--no-cost"]) == 0
    text = capsys.readouterr().out
    assert f"range {sample['range_m']:.0f} m" in text and f"rms change {sample['rms_change']:.2g}" in text
    decided = re.findall(r"^  (\w+): (?:computed|left out)", text, re.MULTILINE)
    assert decided == [decision["name"] for decision in sample["decisions"]] == ["squint"]
    named = re.findall(r"^(\w+) \([\w ]+\): ", text, re.MULTILINE)
    assert named == [effect["name"] for effect in found["effects"]] == ["squint", "iq_imbalance"]


def test_explain_answers_for_a_link_with_its_geometry(answer):
    scene = ("explain", "config/scenes/links.yaml", "--sample", "Crow:3", "--no-cost", "--station")
    found, _ = answer(*scene, "A-B")
    (sample,) = found["samples"]
    assert found["time"] is None and not set(sample) & STATION
    out, back, angle = (sample["link"][name] for name in ("out_m", "back_m", "bistatic_rad"))
    assert set(sample["link"]) == {"out_m", "back_m", "bistatic_rad"}
    assert sample["range_m"] == pytest.approx((out + back) / 2)
    assert [answer(*scene, name)[0]["samples"][0]["range_m"] for name in "AB"] == pytest.approx([out, back])
    masts = load([CONFIG, ROOT / "config/scenes/links.yaml"], SCHEMA)["network"]["stations"]
    apart = math.dist(masts["A"]["position_m"], masts["B"]["position_m"])
    assert out**2 + back**2 - 2 * out * back * math.cos(angle) == pytest.approx(apart**2)


def test_explain_says_how_far_effects_change_the_signals_of_the_data_set(answer, tmp_path):
    """A wrong cell holds another value, so the symbols that change are those with another cell."""
    plain_scene, overlay = tmp_path / "plain.yaml", tmp_path / "scene.yaml"
    plain_scene.write_text("targets: {select: [Crow]}\nnetwork: {symbols: 32}\nspectra: {vrp: {window: 16}}\n")
    overlay.write_text(plain_scene.read_text() + "effects: {cell_error: {probability: 0.4}}\n")
    found, _ = answer("explain", str(overlay), "--sample", "Crow:3", "--no-cost")
    (sample,) = found["samples"]
    without, signal = (
        Dataset(load([CONFIG, path], SCHEMA)).made_signal(Place("seen", "Crow", 3, math.inf))[0].astype(complex)
        for path in (plain_scene, overlay)
    )
    assert 0.1 < sample["other_cells"] == (signal != without).mean() < 0.9
    change = np.sqrt((abs(signal - without) ** 2).mean() / (abs(without) ** 2).mean())
    # Signals of the data set are complex64.
    assert sample["rms_change"] == pytest.approx(change, rel=1e-6)


def test_spectra_answers_with_the_size_of_each(answer):
    found, status = answer("spectra")
    text = spectra.described(found["spectra"], "here").splitlines()
    assert len(text) == 2 * len(found["spectra"]) + 1 and text[-1] == "medians of 5; here"
    for one, first, second in zip(found["spectra"], text[::2], text[1::2], strict=False):
        said = f"{one['name']} ({one['title']}): {one['rows']} rows, {one['windows']} windows, zero at index "
        assert first.startswith(f"{said}{one['zero_index']}, ") and second == f"  {one['source']}"
        assert first.endswith(", ".join(f"{key} {value}" for key, value in one["settings"].items()))
    assert status == 0
    assert [(one["name"], one["rows"], one["windows"]) for one in found["spectra"]] == [
        ("vrp", 256, 144), ("trp", 1024, 392), ("vt", 123, 392),
    ]  # fmt: skip
    assert all(one["image_ms"] > 0 for one in found["spectra"])


def test_a_spectrum_that_knows_its_gaps_is_timed_with_some(monkeypatch):
    given = []
    monkeypatch.setattr(Renderer, "image", lambda self, signal, *rest: given.append(signal))
    config = load([ROOT / "config/default.yaml"], SCHEMA)
    for times in ("even", "known"):
        spectra.facts({**config, "spectra": {**config["spectra"], "times": times}})
        assert len(given[-1]) == 400 and (given[-1][3::4] == 0).all() == (times == "known")
        assert (abs(np.delete(given[-1], np.s_[3::4])) > 0).all()


def test_targets_answer_from_mesh_to_picture(answer, tmp_path, monkeypatch):
    craft(False, 1000).export(tmp_path / "craft.stl")
    monkeypatch.chdir(tmp_path)
    # The pictures have tests of their own.
    monkeypatch.setattr(inspection, "inspection_picture", lambda found: b"picture")
    monkeypatch.setattr(target, "target_picture", lambda cloud: b"picture")
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


def snakemake(code, jobs=()):
    """In the place of Snakemake: note planned jobs, leave a run's state behind, end with a status."""

    def run(line, stdout=None, env=None):
        assert stdout == 2
        Path(env[PLANNED_JOBS]).write_text("".join(json.dumps(job) + "\n" for job in jobs))
        board = Board({"clouds": 2}, 1.0)
        board.start(1, Job("clouds", "", "", 1.0))
        board.finish(1, 2.0, good=not code)
        with replacing(FOLDER / "1.json") as temporary:
            kept = {"pid": 1, "process": None, "state": "ended", "written": 1e12, "board": board.kept()}
            temporary.write_text(json.dumps(kept))
        return SimpleNamespace(returncode=code)

    return run


def test_run_and_report_answer_with_what_ran_and_end_with_the_workflow_s_status(answer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(workflow.subprocess, "run", snakemake(7))
    found, status = answer("run")
    assert status == found["status"] == 7 and found["command"][2] == "snakemake" and found["seconds"] >= 0
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
    odd = {"a": np.array([1.5, np.inf]), "b": (float("-inf"), np.float32("nan")), Path("c"): Path("d")}
    assert json.loads(as_json(odd)) == {"a": [1.5, "inf"], "b": ["-inf", None], "c": "d"}
    with pytest.raises(TypeError, match="set"):
        as_json({"a": {1}})


def test_every_command_with_an_answer_takes_json(capsys):
    """All commands but `completion`, whose answer is a script."""
    for words in re.findall(r"\.venv/bin/lowalt (\w+(?: (?:inspect|new|make|show)\b)?)", PAGE):
        with pytest.raises(SystemExit):
            main([*words.split(), "--help"])
        assert "--json" in capsys.readouterr().out
    with pytest.raises(SystemExit):
        main(["--help"])
    names = set(capsys.readouterr().out.split("{")[1].split("}")[0].split(",")) - {"completion"}
    assert names == set(re.findall(r"\.venv/bin/lowalt (\w+)", PAGE))
