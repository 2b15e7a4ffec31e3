"""Each tutorial runs as it is printed, block by block, in a folder that looks like a checkout."""

import contextlib
import importlib
import io
import os
import re
import runpy
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml

import lowalt
import lowalt.extensions.benchmark
import small_benchmark
from dataset import build, publish
from lowalt.__main__ import main
from lowalt.commands import workflow
from lowalt.config.layers import load
from lowalt.extensions.benchmark import definition, frozen_bytes
from lowalt.extensions.benchmark.submission import read as read_submission
from lowalt.files.yaml_files import load_yaml
from lowalt.shards.build import write_run

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "docs/tutorials"
FENCE = re.compile(r'^```(\w+)(?: title="([^"]+)")?\n(.*?)^```$', re.DOTALL | re.MULTILINE)
NEEDS = {"pytorch": "timm", "hugging_face": "datasets"}
SHARDS = ("pytorch", "hugging_face")
LOOP = "torch.Size([2, 9, 64, 64]) ('UAV', 'Bird', 'Vehicle', 'Pedestrian') 8\n"
"""What `loop.py` of the tutorial on PyTorch prints on the small data set of these tests."""
SCHEMA = "workflow/schemas/config.schema.yaml"


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    """A finished data set of 24 samples with its card, in the place of the default's."""
    folder = tmp_path_factory.mktemp("made")
    return publish(build(folder / "shards", "image"), folder / "default/shards")


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder with links to what a checkout holds, and the current folder of the test."""
    for name in ("config", "design", "examples", "workflow"):
        (tmp_path / name).symlink_to(ROOT / name)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HF_HOME", str(tmp_path / "hub"))
    monkeypatch.setenv("HF_DATASETS_OFFLINE", "1")
    return tmp_path


def in_this_process(line, monkeypatch):
    """Run a command here, where the libraries are loaded already; returns what it prints."""
    words = shlex.split(line)
    with contextlib.redirect_stdout(io.StringIO()) as printed:
        if words[0] == ".venv/bin/lowalt":
            assert main(words[1:]) == 0
        elif words[1] == "-m":
            importlib.import_module(f"{words[2]}.__main__").main(words[3:])
        else:
            monkeypatch.setattr(sys, "argv", words[1:])
            runpy.run_path(words[1], run_name="__main__")
    return printed.getvalue()


def followed(page, folder, monkeypatch, more=None):
    """Do what a page says: write the files it names, run its commands and its Python; returns (printed, names).

    more: options by the line that gets them besides its own.
    """
    printed, names = "", {"__name__": page}
    for language, title, block in FENCE.findall((FOLDER / f"{page}.md").read_text()):
        if title:
            (folder / title).write_text(block)
        elif language == "sh":
            for line in block.splitlines():
                if line.startswith(".venv/bin/lowalt run "):
                    continue  # a whole run: tests/test_notebooks.py has the slow ones
                printed += in_this_process(f"{line} {(more or {}).get(line, '')}", monkeypatch)
        elif language == "python":
            exec(compile(block, f"{page}.md", "exec"), names)
    return printed, names


def test_every_tutorial_is_followed_here():
    pages = {path.stem for path in FOLDER.glob("*.md")}
    assert pages == {
        "first_data_set", "trajectory", "target", "effect", "backbone", "pytorch", "hugging_face", "recording",
        "benchmark", "extension",
    }  # fmt: skip


def test_a_first_data_set(checkout, capsys, monkeypatch):
    _, names = followed("first_data_set", checkout, monkeypatch)
    assert len(names["samples"]) == 80
    assert capsys.readouterr().out.startswith("80 ")
    # The overlay of the last step is a whole configuration's overlay.
    names["load"](["config/default.yaml", "first.yaml"], SCHEMA)


def test_a_submission_to_the_benchmark(checkout, monkeypatch):
    """On a small copy of the benchmark; its data come from the test, so that no workflow starts and no byte is kept."""
    small_benchmark.shrink(monkeypatch)
    monkeypatch.setattr(workflow, "ended", lambda options: {"status": small_benchmark.write(Path("results")) is None})
    monkeypatch.setattr(frozen_bytes, "compared", lambda part, folder: [])
    printed, _ = followed("benchmark", checkout, monkeypatch)
    assert "are equal to the kept checksums" in printed and "16 samples, training seeds: 1" in printed
    test = lowalt.extensions.benchmark.load("unseen", "test")
    right = read_submission("mine.csv", test.track).argmax(1) == test.labels
    assert f"accuracy {100 * right.mean():.1f} (" in printed
    definition.truth.cache_clear()


def test_a_trajectory(checkout, monkeypatch):
    _, names = followed("trajectory", checkout, monkeypatch)
    shapes = {"signals": (3, 400), "velocity": (3, 256, 144), "time": (3, 1024, 392), "transfer": (123, 392)}
    assert {name: names[name].shape for name in shapes} == shapes
    assert names["tile"].shape == (768, 768) and len(set(names["tile"].ravel().tolist())) > 100
    assert [(record["track"], record["look"]) for record in names["looks"]] == [
        (names["looks"][0]["track"], look) for look in range(30)
    ]
    assert [(record["subtype"], record["track"], record["look"]) for record in names["flown"]] == [
        ("DJI Mini 2", 0, look) for look in range(8)
    ]


def test_a_target(checkout, monkeypatch):
    printed, names = followed("target", checkout, monkeypatch)
    assert "4 moving parts drafted" in printed and "5 parts" in printed
    assert (checkout / "mydrone.png").is_file()
    assert len(names["samples"].clouds["DJI Mini 2"].kinds) == 5
    config = load(["config/default.yaml", "config/tiny.yaml", "with_mine.yaml"], SCHEMA)
    assert "My drone" in names["lowalt"].Dataset(config, inputs=config["inputs"]).plan.groups["unseen"]


# The quick suite adds an effect to a copy of the tree in tests/test_contributing.py.
@pytest.mark.slow
# `lowalt explain` leaves out and adds every effect of the catalogue, in looks of 2048 sweeps.
@pytest.mark.slow
def test_an_effect(checkout, capsys, monkeypatch):
    printed, names = followed("effect", checkout, monkeypatch)
    # Table 5 of ITU-R P.838-3, vertical polarisation.
    table = "1 GHz: k 3.08e-05, alpha 0.8592", "10 GHz: k 0.01129, alpha 1.2156", "20 GHz: k 0.09611, alpha 0.9847"
    assert capsys.readouterr().out.startswith("\n".join((*table, "80 GHz: k 1.167, alpha 0.7021")))
    (line,) = [line for line in printed.splitlines() if line.startswith("rain.py ")]
    assert line.split()[1] == "named" and float(line.split()[2].rstrip("%")) > 0
    assert "rain.py: ITU-R P.838-3" in printed
    wet, dry, rain = names["wet"].maker, names["dry"].maker, names["rain"]
    row = names["wet"].row(names["wet"].place(0))
    station = wet.network.stations[0]
    heard = [maker.received(row, stations=[0])[1][0, 0] for maker in (wet, dry)]
    way_km = 2e-3 * np.linalg.norm(np.subtract([row[f"{axis}_m"] for axis in "xyz"], station.position_m))
    expected_db = way_km * rain.attenuation(76e9 + 307.2e6 / 2, 50.0)
    assert 10 * np.log10(heard[1] / heard[0]) == pytest.approx(expected_db, rel=0.02)
    lost, *_ = re.findall(r"^ +rain, out and back +(-\d+\.\d) dB$", printed, re.MULTILINE)
    assert float(lost) == pytest.approx(-expected_db, abs=0.06)


@pytest.mark.parametrize("page", SHARDS)
def test_shards_in_other_tools(page, checkout, shards, capsys, monkeypatch):
    pytest.importorskip(NEEDS[page])
    (checkout / "results/default").mkdir(parents=True)
    shutil.copytree(shards, checkout / "results/default/shards")
    printed, names = followed(page, checkout, monkeypatch)
    if page == "pytorch":
        assert re.search(r"loss \d+\.\d+ after 2 steps, \d+\.\d % of 6 validation samples", printed)
        runpy.run_path("loop.py", run_name="__main__")
        assert capsys.readouterr().out == LOOP
    else:
        assert {name: len(rows) for name, rows in names["seen"].items()} == {"train": 12, "validation": 6, "test": 6}
        assert names["images"].shape[:2] == (3, 3)


# Three processes that import torch.
@pytest.mark.slow
def test_the_loop_works_with_spawned_workers(checkout, shards):
    pytest.importorskip("torch")
    (checkout / "results/default").mkdir(parents=True)
    shutil.copytree(shards, checkout / "results/default/shards")
    (text,) = (text for _, title, text in FENCE.findall((FOLDER / "pytorch.md").read_text()) if title == "loop.py")
    (checkout / "loop.py").write_text(text)
    # As elsewhere than on Linux: a worker imports the file again.
    (checkout / "sitecustomize.py").write_text("import multiprocessing\nmultiprocessing.set_start_method('spawn')\n")
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(checkout), str(ROOT / "src")])}
    run = subprocess.run([sys.executable, "loop.py"], capture_output=True, text=True, env=environment)
    assert run.stdout == LOOP, run.stderr


def test_the_first_hour_has_no_block_beyond_ten_lines():
    blocks = [block for _, _, block in FENCE.findall((ROOT / "docs/first_hour.md").read_text())]
    assert len(blocks) > 10 and max(len(block.splitlines()) for block in blocks) <= 10


# A town at two bands, a target from its data sheet, two seconds of a walker, a network of its radar and of one station.
@pytest.mark.slow
def test_the_first_hour(checkout, capsys, monkeypatch):
    (checkout / "results/tiny").mkdir(parents=True)
    (checkout / "results/zoo").symlink_to(ROOT / "results/zoo")
    # The run itself: tests/test_notebooks.py. Here its data set, and one row of its table.
    config = load(["config/default.yaml", "config/tiny.yaml"], SCHEMA)
    (checkout / "results/tiny/config.yaml").write_text(yaml.safe_dump(config))
    write_run(lowalt.Dataset(config), checkout / "results/tiny", "image")
    (checkout / "results/tiny/confusion_by_snr.csv").write_text(
        "protocol,scheme,snr_db,category,predicted,samples\nunseen,ABC:VRP+TRP+VT,3,Bird,Bird,8\n"
    )
    block = load_yaml("config/measured/recognition.yaml") | {"size": 24, "echoes": {"train": 1, "validation": 1}}
    block["training"] |= {"steps": 1, "batch": 4, "validate_every": 1}
    (checkout / "quick.yaml").write_text(yaml.safe_dump(block))
    quick = {".venv/bin/lowalt recording train walk.yaml --out my_radar": "--recognition quick.yaml"}
    printed, names = followed("../first_hour", checkout, monkeypatch, quick)
    said = capsys.readouterr().out
    assert "(400, 256) sqrt(W) ('body', 'right inner wing'" in said and "('Bird',)\n[[100.]]" in said
    assert names["alone"].scheme.record["name"] == "A:VRP+TRP+VT" and list(names["scores"]["by_snr_percent"]) == [
        "3",
        "inf",
    ]
    assert "windows right" in printed and printed.count("windows hold a target") == 2
    for name, echo in {"town": names["echo"], "fourth": names["fourth"], "hexacopter": names["hexacopter"]}.items():
        assert (checkout / f"{name}.png").is_file()
        # In the cells around the target, the strongest line of the map is at the folded speed of the target.
        spectrum = abs(np.fft.fftshift(np.fft.fft(np.hanning(400)[:, None] * echo.values, axis=0), axes=0)[::-1])
        cell = int(echo.truth["observed_cell"].mean())
        line = spectrum[:, cell - 1 : cell + 3].max(axis=1)
        place = np.interp(echo.truth["observed_mps"].mean(), echo.speeds_mps, np.arange(400))
        assert line[max(0, int(place) - 25) : int(place) + 25].max() == line.max()
    # 12 dB/km, there and back.
    assert names["lost_db"] == pytest.approx(0.012 * 2 * names["dry"].truth["range_m"].mean(), rel=1e-3)
    assert names["fourth"].station == "D" and len(names["hexacopter"].parts) == 7
    assert "m600.yaml: 'm600'" in printed and "reading 1; another" in printed


def test_a_recording(checkout, monkeypatch):
    (checkout / "results").mkdir()
    (checkout / "results/zoo").symlink_to(ROOT / "results/zoo")
    printed, names = followed("recording", checkout, monkeypatch)
    assert names["signals"].ndim >= 2
    assert len(list((checkout / "mine/tiles").glob("*.png"))) > 2
    assert "5 of 5 windows hold a target: UAV 0, Bird 0, Vehicle 0, Pedestrian 5" in printed
