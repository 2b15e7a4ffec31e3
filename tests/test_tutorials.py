"""Each tutorial runs as it is printed, block by block, in a folder that looks like a checkout."""

import os
import re
import runpy
import shutil
import subprocess
import sys

import numpy as np
import pytest
import torch

from dataset import build, publish
from followed_pages import FENCE, FOLDER, ROOT, SCHEMA, followed, linked_checkout
from lowalt.config.layers import load
from lowalt.recognition.recogniser import Recogniser
from lowalt.recognition.schemes import Scheme

NEEDS = {"pytorch": "timm", "hugging_face": "datasets"}
SHARDS = ("pytorch", "hugging_face")
LOOP = "torch.Size([2, 9, 64, 64]) ('UAV', 'Bird', 'Vehicle', 'Pedestrian') 8\n"
"""What `loop.py` of the tutorial on PyTorch prints on the small data set of these tests."""


@pytest.fixture(scope="module")
def shards(tmp_path_factory):
    """A finished data set of 24 samples with its card, in the place of the default's."""
    folder = tmp_path_factory.mktemp("made")
    return publish(build(folder / "shards", "image"), folder / "default/shards")


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder with links to what a checkout holds, and the current folder of the test."""
    return linked_checkout(tmp_path, monkeypatch)


def test_a_first_data_set(checkout, capsys, monkeypatch):
    _, names = followed("first_data_set", checkout, monkeypatch)
    assert len(names["samples"]) == 80
    assert capsys.readouterr().out.startswith("80 ")
    # The overlay of the last step is a whole configuration's overlay.
    names["load"](["config/default.yaml", "first.yaml"], SCHEMA)


def test_a_backbone(checkout):
    """Its commands are whole runs; here both networks are built from the page's overlays."""
    text = (FOLDER / "backbone.md").read_text()
    for _, title, block in FENCE.findall(text):
        if title:
            (checkout / title).write_text(block)
    images = torch.zeros((2, 9, 32, 32), dtype=torch.uint8)
    palettes = np.zeros((3, 256, 3), np.uint8)
    whole = Scheme("whole", (0, 1, 2), (0, 1, 2), "attention", "")
    named = {"of_timm.yaml": "test_vit", "my_network.yaml": "my_network.py:small"}
    for overlay, backbone in named.items():
        config = load(["config/default.yaml", "config/tiny.yaml", overlay], SCHEMA)
        network = config["recognition"]["network"]
        assert network["backbone"] == backbone and config["data"] == "tiny"
        with torch.inference_mode():
            model = Recogniser(whole, network | {"weights": "none"}, 32, palettes, 4).eval()
            assert model(images).shape == (2, 4)


def test_a_trajectory(checkout, monkeypatch):
    _, names = followed("trajectory", checkout, monkeypatch)
    shapes = {
        "signals": (3, 400),
        "velocity": (3, 256, 144),
        "time": (3, 1024, 392),
        "transfer": (123, 392),
    }
    assert {name: names[name].shape for name in shapes} == shapes
    assert names["tile"].shape == (768, 768) and len(set(names["tile"].ravel().tolist())) > 100
    assert [(record["track"], record["look"]) for record in names["looks"]] == [
        (names["looks"][0]["track"], look) for look in range(30)
    ]
    assert [(record["subtype"], record["track"], record["look"]) for record in names["flown"]] == [
        ("DJI Mini 2", 0, look) for look in range(8)
    ]


@pytest.mark.parametrize(
    "gigahertz, k, alpha",
    [(1, 3.08e-05, 0.8592), (10, 0.01129, 1.2156), (20, 0.09611, 0.9847), (80, 1.167, 0.7021)],
)
def test_the_rain_of_the_tutorial_is_that_of_table_5_of_the_recommendation(gigahertz, k, alpha):
    """Vertical polarisation of ITU-R P.838-3."""
    rain = runpy.run_path(str(ROOT / "examples/rain.py"))
    assert 10 ** rain["fitted"](rain["K"], gigahertz * 1e9) == pytest.approx(k, rel=5e-4)
    assert rain["fitted"](rain["ALPHA"], gigahertz * 1e9) == pytest.approx(alpha, abs=5e-5)


# The quick suite adds an effect to a copy of the tree in tests/test_contributing.py.
# `lowalt explain` leaves out and adds every effect of the catalogue, in looks of 2048 sweeps.
@pytest.mark.slow
def test_an_effect(checkout, monkeypatch):
    printed, names = followed("effect", checkout, monkeypatch)
    (line,) = [line for line in printed.splitlines() if line.startswith("examples/rain.py ")]
    assert line.split()[1] == "named" and float(line.split()[2].rstrip("%")) > 0
    assert "examples/rain.py: ITU-R P.838-3" in printed
    wet = names["wet"].maker
    dry = names["dry"].maker
    rain = runpy.run_path("examples/rain.py")
    row = names["wet"].row(names["wet"].place(0))
    station = wet.network.stations[0]
    heard = [maker.received(row, stations=[0])[1][0, 0] for maker in (wet, dry)]
    way_km = 2e-3 * np.linalg.norm(
        np.subtract([row[f"{axis}_m"] for axis in "xyz"], station.position_m)
    )
    expected_db = way_km * rain["attenuation"](76e9 + 307.2e6 / 2, 50.0)
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
        assert {name: len(rows) for name, rows in names["seen"].items()} == {
            "train": 12,
            "validation": 6,
            "test": 6,
        }
        assert names["images"].shape[:2] == (3, 3)


# Three processes that import torch.
@pytest.mark.slow
def test_the_loop_works_with_spawned_workers(checkout, shards):
    pytest.importorskip("torch")
    (checkout / "results/default").mkdir(parents=True)
    shutil.copytree(shards, checkout / "results/default/shards")
    (text,) = (
        text
        for _, title, text in FENCE.findall((FOLDER / "pytorch.md").read_text())
        if title == "loop.py"
    )
    (checkout / "loop.py").write_text(text)
    # As elsewhere than on Linux: a worker imports the file again.
    (checkout / "sitecustomize.py").write_text(
        "import multiprocessing\nmultiprocessing.set_start_method('spawn')\n"
    )
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(checkout), str(ROOT / "src")])}
    run = subprocess.run(
        [sys.executable, "loop.py"], capture_output=True, text=True, env=environment
    )
    assert run.stdout == LOOP, run.stderr


def test_the_first_hour_has_no_block_beyond_ten_lines():
    blocks = [block for _, _, block in FENCE.findall((ROOT / "docs/first_hour.md").read_text())]
    assert len(blocks) > 10 and max(len(block.splitlines()) for block in blocks) <= 10
