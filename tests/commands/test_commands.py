"""The commands of `lowalt`: what they write and say, their exit status, and examples that parse."""

import json
import shlex
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import yaml

from command_lines import assert_help_with_example, completions
from dataset import build, publish
from lowalt import Dataset
from lowalt.__main__ import main
from lowalt.commands import workflow
from lowalt.commands.command_table import COMMANDS
from lowalt.config.layers import load, load_yaml, plain
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.shipped import located
from lowalt.recognition import predict_sample, runs
from lowalt.report.figures.tile_axes import axes_of
from lowalt.tiles.png import decode
from lowalt.tiles.render import Renderer, split
from trainings import train, with_training, write_views

ROOT = Path(__file__).parents[2]
CONFIG = load_yaml("config/default.yaml")
SCHEMA = "workflow/schemas/config.schema.yaml"


def renderer():
    return Renderer.from_settings({key: CONFIG[key] for key in ("network", "spectra", "images")})


@pytest.mark.parametrize("speed", [2.0, -3.5])
@pytest.mark.parametrize("name", ["vrp", "trp"])
def test_a_target_of_known_speed_stands_at_that_speed_on_the_axes(name, speed):
    render = renderer()
    times = render.network.times_s
    column = list(render.spectra).index(name)
    phases = [
        4 * np.pi * place.frequency_hz * speed * times / SPEED_OF_LIGHT
        for place in render.network.stations
    ]
    images = split(
        render.tile(np.exp(-1j * np.array(phases)).astype(np.complex64)), len(render.spectra)
    )
    for number, station in enumerate(render.network.stations):
        axes = axes_of(name, station, render)
        rows = images[3 * number + column][:, 100].astype(int)
        place = (np.flatnonzero(rows == rows.max()).mean() + 0.5) / len(rows)
        _, bottom, top = axes.upwards
        assert top + (bottom - top) * place == pytest.approx(speed, abs=0.1)


@pytest.mark.parametrize("name", ["vrp", "trp"])
def test_an_echo_that_sets_in_stands_at_half_its_strength_at_that_time_on_the_axes(name):
    render = renderer()
    signal = np.where(np.arange(400) < 190, 0, np.exp(-2j * np.pi * 0.125 * np.arange(400))).astype(
        np.complex64
    )
    image = split(render.tile(np.array([signal] * 3)), len(render.spectra))[
        list(render.spectra).index(name)
    ]
    line = image[image.max(axis=1).argmax()].astype(float)
    # Squares of the images are amplitudes: the share of a window after the onset, over that of the
    # last window.
    last = min(1.0, 210 / render.spectra[name].window)
    place = (np.flatnonzero((line / line.max()) ** 2 * last > 0.5)[0] + 0.5) / len(line)
    _, left, right = axes_of(name, render.network.stations[0], render).across
    assert left + (right - left) * place == pytest.approx(189.5 * 2.5e-3, abs=0.01)


def test_sample_writes_the_bytes_of_the_data_set_and_a_picture(tmp_path, capsys):
    assert main(f"sample Crow 3 --snr 13 --out {tmp_path}".split()) == 0
    said = capsys.readouterr().out.split()
    stem = "crow-000003-snr013"
    assert [Path(path).name for path in said] == [
        f"{stem}.png",
        f"{stem}.json",
        f"{stem}-axes.png",
        f"{stem}.npy",
    ]
    alone = {**CONFIG, "targets": {**CONFIG["targets"], "select": ["Crow"]}}
    dataset = Dataset(alone)
    (number,) = [n for n in range(len(dataset)) if dataset.key(n) == stem]
    made = dataset[number]
    np.testing.assert_array_equal(decode((tmp_path / f"{stem}.png").read_bytes())[0], made.image)
    np.testing.assert_array_equal(np.load(tmp_path / f"{stem}.npy"), made.signal)
    assert json.loads((tmp_path / f"{stem}.json").read_text()) == made.record
    assert (tmp_path / f"{stem}-axes.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"


def test_every_command_has_help_with_an_example_that_parses(capsys, monkeypatch):
    with pytest.raises(SystemExit):
        main(["--help"])
    whole = capsys.readouterr().out
    assert all(
        f"\n    {name}" in whole and f"\n  {entry.example}\n" in whole
        for name, entry in COMMANDS.items()
    )
    for name in COMMANDS:
        assert_help_with_example([name], capsys, monkeypatch)


ODD = (
    "run none.yaml",
    "run config",
    "run README.md",
    "explain none.yaml",
    "explain config",
    "explain README.md --no-table",
    "explain config/scenes/urban.yaml --station Z --no-table",
    "explain config/tiny.yaml --sample Nobody:1 --no-table",
    "sample Nobody 3",
    "sample Crow -1",
    "sample Crow 3 --snr nan",
    "sample Crow 3 --overlay none.yaml",
    "predict none.pt a.png",
    "predict README.md README.md",
    "predict README.md none.npy",
    "verify none.json",
    "verify README.md",
    "verify config",
    "verify config/targets.csv --remake 2",
    "remake none.json KEY",
    "remake README.md KEY",
    "compare none nowhere",
    "compare config docs",
    "report --gallery --results none",
    "report --gallery --results config",
    "report",
    "report none",
    "report config",
    "report none --gallery",
    "spectra none.yaml",
    "spectra README.md",
    "target inspect none.stl",
    "target inspect README.md",
    "target inspect config",
    "target new none.stl --subtype Crow",
    "target new README.md --subtype Nobody",
    "target make none.yaml",
    "target make README.md",
    "target make config/tiny.yaml",
    "target show none.npz",
    "target show README.md",
)


@pytest.mark.parametrize("line", ODD)
def test_odd_inputs_end_with_2_and_one_clear_sentence(line, capsys, monkeypatch, tmp_path):
    for name in ("config", "workflow", "docs", "README.md"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    try:
        status = main(shlex.split(line))
    except SystemExit as ended:
        status = ended.code
    said = capsys.readouterr()
    assert status == 2, said
    assert "error: " in said.err and "Traceback" not in said.err


@pytest.mark.parametrize(
    ("words", "current", "wanted"),
    [
        (["lowalt"], "stat", ["status"]),
        (["lowalt", "run"], "--dr", ["--dry-run"]),
        (["lowalt", "run"], "config/ti", ["config/tiny.yaml"]),
        ([".venv/bin/lowalt", "compare", "results"], "--js", ["--json"]),
    ],
)
def test_a_shell_completes_commands_options_and_files(words, current, wanted, capsys, monkeypatch):
    for found in completions(words, current, capsys):
        assert found == wanted


def test_verify_and_remake_end_with_1_where_a_byte_differs(tmp_path, capsys):
    publish(build(tmp_path / "made", "signal"), tmp_path / "set")
    index = tmp_path / "set/index.json"
    assert main(["verify", str(index), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"good": True, "faults": []}
    assert main(["verify", str(index)]) == 0
    assert "every byte is as it was written" in capsys.readouterr().out
    shard, *_ = sorted((tmp_path / "set").glob("*.tar"))
    raw = bytearray(shard.read_bytes())
    raw[700] ^= 1
    shard.write_bytes(raw)
    assert main(["verify", str(index)]) == 1 and shard.name in capsys.readouterr().out
    assert main(["remake", str(index), "nothing"]) == 2
    assert "does not say how echoes were computed" in capsys.readouterr().err


def test_predict_names_the_classes_by_their_probability(tmp_path, capsys):
    trained = tmp_path / "model"
    train(write_views(tmp_path / "views.npz"), trained, with_training(steps=2, validate_every=2))
    signals = np.exp(1j * np.arange(1200).reshape(3, 400) ** 1.4).astype(np.complex64)
    np.save(tmp_path / "a.npy", signals)
    line = ["predict", str(trained / "model.safetensors"), str(tmp_path / "a.npy")]
    assert main([*line, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    settings = {key: CONFIG[key] for key in ("network", "spectra", "images")}
    assert found == predict_sample.predict(
        runs.load(trained / "model.safetensors"), tmp_path / "a.npy", settings
    )
    assert main(line) == 0
    shown = [text.split()[-1] for text in capsys.readouterr().out.splitlines()]
    assert shown == sorted(found, key=found.get, reverse=True)
    assert main([*line[:2], str(tmp_path / "a.wav")]) == 2


def test_report_asks_the_workflow_for_the_page_of_the_same_run(tmp_path, monkeypatch, capsys):
    asked = []

    def snakemake(line, **_):
        overlay = line[line.index("--configfile") + 1 :]
        asked.append(
            (load([*overlay[: overlay.index("--")]], SCHEMA), overlay[overlay.index("--") + 1 :])
        )
        return SimpleNamespace(returncode=0)

    config = load(["config/default.yaml", "config/tiny.yaml"], SCHEMA)
    del config["network"]["stations"]["C"]
    (tmp_path / "results/tiny").mkdir(parents=True)
    (tmp_path / "results/tiny/config.yaml").write_text(yaml.safe_dump(plain(config)))
    (tmp_path / "results/moved").mkdir()
    (tmp_path / "results/moved/config.yaml").write_text(yaml.safe_dump(plain(config)))
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(workflow.subprocess, "run", snakemake)
    assert main(["report", "results/tiny"]) == 0
    assert plain(asked[0][0]) == plain(located(config)) and asked[0][1] == [
        "results/tiny/report.html"
    ]
    assert main(["report", "results/moved"]) == 2 and "of the run 'tiny'" in capsys.readouterr().err
