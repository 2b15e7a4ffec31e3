"""Models that others can use: safetensors with the run's identity, cards, 8-bit weights."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml
from safetensors import safe_open

import model_files
from finished_run import answers, finished_run
from lowalt.__main__ import main
from lowalt.files.errors import InputError
from lowalt.recognition import model_file, predict_sample, runs
from lowalt.recognition.export import export
from pictures import IMAGES, NETWORK, SPECTRA
from trainings import SCHEME, SETTINGS, equal, sources

ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / "results/zoo/default-seen.safetensors"


@pytest.fixture
def finished(trained, tmp_path):
    """The model.safetensors of a training inside the folder of a run."""
    return finished_run(trained, tmp_path)


def test_a_safetensors_file_holds_the_weights_and_all_that_made_them(finished, views, tmp_path):
    model = runs.load(finished)
    for name in ("one", "two"):
        export(model, tmp_path / f"{name}.safetensors")
    assert (tmp_path / "one.safetensors").read_bytes() == (
        tmp_path / "two.safetensors"
    ).read_bytes()
    with safe_open(tmp_path / "one.safetensors", framework="pt") as file:
        about = json.loads(file.metadata()["lowalt"])
        stored = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    identity, state = model_files.load(finished)
    assert equal(stored, state["weights"])
    assert about["identity"] == json.loads(identity)
    assert about["identity"]["samples"]["train"] == sources(views)["train"].sha256()
    assert about["run"] == json.loads(finished.with_name("run.json").read_text())
    assert about["input"] == {"network": NETWORK, "spectra": SPECTRA, "images": IMAGES}
    again, made = runs.opened(tmp_path / "one.safetensors")
    assert torch.equal(answers(again, views), answers(model, views)) and made == about["input"]
    assert (again.scheme, again.size, again.seed, again.classes) == (
        SCHEME,
        32,
        3,
        tuple(SETTINGS["classes"]),
    )


def test_a_card_stands_next_to_the_file_with_the_runs_own_numbers(finished, tmp_path):
    export(runs.load(finished), tmp_path / "mine.safetensors")
    card = (tmp_path / "mine.md").read_text()
    front = yaml.safe_load(card.split("---\n")[1])
    assert front["license"] == "mit" and "safetensors" in front["tags"]
    record = json.loads(finished.with_name("run.json").read_text())
    assert (
        f"| steps | {record['steps']} |" in card
        and f"| trained values | {record['parameters']} |" in card
    )
    assert "| 3 | 81.2500 | 16 |\n| all | 84.3750 | 32 |" in card and "11.1111" not in card
    assert "mean over the 3 trainings of the run" in card and "8 bits" not in card
    (tmp_path / "results/mine/accuracy.csv").unlink()
    export(runs.load(finished), tmp_path / "mine.safetensors")
    assert "no table of accuracy" in (tmp_path / "mine.md").read_text()


@pytest.mark.parametrize("fault", ["tensor", "metadata", "foreign", "cut", "missing"])
def test_a_damaged_or_foreign_file_is_refused_with_its_name(finished, tmp_path, fault):
    path = tmp_path / "mine.safetensors"
    export(runs.load(finished), path)
    raw = bytearray(path.read_bytes())
    if fault == "tensor":
        raw[-5] ^= 1
    elif fault == "metadata":
        raw = raw.replace(b'\\"seed\\": 3', b'\\"seed\\": 4')
    elif fault == "cut":
        raw = raw[:-100]
    path.write_bytes(raw)
    if fault == "foreign":
        from safetensors.torch import save_file

        save_file({"weight": torch.ones(2)}, path, {"format": "pt"})
    if fault == "missing":
        path.unlink()
    with pytest.raises(InputError, match=r"mine\.safetensors"):
        runs.opened(path)


def test_eight_bits_move_a_weight_by_at_most_half_a_step_of_its_row():
    torch.manual_seed(1)
    rows = torch.randn(5, 3, 2, 2) * torch.tensor([1e-6, 1.0, 300.0, 0.0, 2.0])[:, None, None, None]
    weights = {
        "conv": rows,
        "bias": torch.randn(5),
        "conv.scale": torch.randn(2),
        "count": torch.tensor(7),
    }
    del weights["conv.scale"]
    stored = model_file.rounded(weights, {"conv"})
    assert stored["conv"].dtype == torch.int8 and stored["conv"].shape == rows.shape
    found = model_file.restored(stored)
    assert found.keys() == weights.keys()
    assert torch.equal(found["bias"], weights["bias"]) and torch.equal(
        found["count"], weights["count"]
    )
    error = (found["conv"] - rows).abs().flatten(1).amax(1)
    largest = rows.abs().flatten(1).amax(1)
    assert (error <= 1.001 * largest / 254).all() and error[1] > largest[1] / 1000
    layer = {"gamma": torch.ones(3, 3), "gamma.scale": torch.ones(3)}
    assert equal(model_file.restored(model_file.rounded(layer, set())), layer)


def test_signals_become_images_as_the_model_file_says_unless_overlays_are_given(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(ROOT)
    content = model_file.read(SHIPPED)
    made = {**content.input, "images": {**content.input["images"], "gamma": 1.0}}
    path = tmp_path / "other.safetensors"
    signals = tmp_path / "a.npy"
    model_file.write(path, replace(content, input=made))
    np.save(signals, np.exp(1j * np.arange(1200).reshape(3, 400) ** 1.4).astype(np.complex64))
    (tmp_path / "overlay.yaml").write_text("images: {gamma: 0.25}\n")
    model = runs.opened(path)[0]
    found = []
    for more in ([], ["--overlay", str(tmp_path / "overlay.yaml")]):
        assert main(["predict", str(path), str(signals), "--json", *more]) == 0
        found.append(json.loads(capsys.readouterr().out))
    for gamma, answer in zip((1.0, 0.25), found, strict=True):
        assert answer == predict_sample.predict(
            model, signals, {**made, "images": {**made["images"], "gamma": gamma}}
        )
    assert found[0] != found[1]


def test_another_ending_is_refused(trained, tmp_path):
    with pytest.raises(InputError, match=r"expected a name ending in \.safetensors"):
        export(runs.load(trained / "model.safetensors"), tmp_path / "model.pt2")
