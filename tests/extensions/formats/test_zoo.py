"""The zoo: entries with 8-bit weights, their measurements, and their names."""

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from finished_run import answers, finished_run
from lowalt.__main__ import main
from lowalt.extensions.formats import zoo
from lowalt.extensions.formats.zoo_files import ZOO, names
from lowalt.files.errors import InputError
from lowalt.recognition import model_file, predict_sample, runs
from made_predictions import facts
from trainings import sources

ROOT = Path(__file__).parents[3]


@pytest.fixture
def finished(trained, tmp_path):
    """The model.safetensors of a training inside the folder of a run."""
    return finished_run(trained, tmp_path)


def test_an_entry_is_held_against_the_weights_as_trained_sample_by_sample(monkeypatch):
    told = {
        "exact": np.eye(2)[[0, 1, 1, 1]],
        "entry": np.array([[0.9, 0.1], [0.7, 0.3], [0.4, 0.6], [0.3, 0.7]]),
    }
    monkeypatch.setattr(zoo, "probabilities", lambda model, *rest: told[model])
    # Their labels are 0, 1, 1, 0.
    samples = SimpleNamespace(facts=facts(models=1).take(np.array([0, 6, 7, 1])))
    found = zoo.held_against(
        SimpleNamespace(model="exact"), SimpleNamespace(model="entry"), samples
    )
    assert list(found.values()) == [4, 75.0, 50.0, 1, pytest.approx(0.7)]


def test_an_entry_of_the_zoo_is_small_measured_and_predicts_by_name(
    finished, views, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    zoo.main(f"--model {finished} --views {views} --name mine".split())
    content = model_file.read("results/zoo/mine.safetensors")
    exact, _ = runs.opened(finished)
    entry, _ = runs.opened("mine")
    validation = sources(views)["validation"]
    assert content.measured == zoo.held_against(exact, entry, validation)
    assert content.measured["samples"] == len(validation.facts)
    known = json.loads(finished.with_name("run.json").read_text())["validation_accuracy"]
    assert content.measured["exact_percent"] == pytest.approx(100 * known)
    one = answers(exact, views)
    other = answers(entry, views)
    assert 0 < (one - other).abs().max() <= content.measured["largest_change"] + 1e-6
    assert Path("results/zoo/mine.safetensors").stat().st_size < 0.4 * finished.stat().st_size
    card = Path("results/zoo/mine.md").read_text()
    assert f"| 8 bits | {content.measured['percent']:.3f} |" in card
    capsys.readouterr()
    assert main(["predict", "yours", "a.npy"]) == 2
    assert "'yours'" in (told := capsys.readouterr().err) and "'mine'" in told


def test_an_entry_that_loses_accuracy_or_is_large_or_ill_named_is_not_written(
    finished, views, tmp_path, monkeypatch
):
    samples = sources(views)["validation"]
    with pytest.raises(InputError, match="--name"):
        zoo.entry(finished, samples, "../mine", tmp_path)
    with monkeypatch.context() as patch:
        patch.setattr(zoo, "LARGEST_BYTES", 1000)
        with pytest.raises(InputError, match="expected less than 1000"):
            zoo.entry(finished, samples, "mine", tmp_path)
    with pytest.raises(InputError, match="other samples"):
        zoo.entry(finished, sources(views)["train"], "mine", tmp_path)
    monkeypatch.setattr(zoo, "LARGEST_BYTES", 10_000_000)
    monkeypatch.setattr(
        zoo,
        "small",
        lambda content, own: replace(
            content, tensors={name: value * 0 for name, value in content.tensors.items()}
        ),
    )
    with pytest.raises(InputError, match="points less"):
        zoo.entry(finished, samples, "mine", tmp_path)
    assert not list(tmp_path.glob("*.safetensors"))


@pytest.mark.parametrize("name", ["default-seen", "default-unseen", "lowalt-40-v1-unseen"])
def test_the_shipped_entries_answer_by_name_and_say_on_their_cards_how_well(
    name, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(ROOT)
    assert name in names()
    path = ZOO / f"{name}.safetensors"
    assert path.stat().st_size < zoo.LARGEST_BYTES
    measured = model_file.read(path).measured
    card = path.with_suffix(".md").read_text()
    assert f"| 8 bits | {measured['percent']:.3f} |" in card and measured["percent"] > 95
    signals = np.exp(1j * np.arange(1200).reshape(3, 400) ** 1.4).astype(np.complex64)
    np.save(tmp_path / "a.npy", signals)
    assert main(["predict", name, str(tmp_path / "a.npy"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert list(found) == ["UAV", "Bird", "Vehicle", "Pedestrian"] and sum(
        found.values()
    ) == pytest.approx(1)
    model, made = runs.opened(name)
    assert found == predict_sample.predict(model, tmp_path / "a.npy", made)


def test_an_entry_whose_file_names_code_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(ROOT)
    content = model_file.read(ZOO / "default-seen.safetensors")
    named = {**content.model, "scheme": {**content.model["scheme"], "backbone": "code.py:run"}}
    with pytest.raises(InputError, match="may not choose"):
        zoo.kept(replace(content, model=named), "mine", None, "mine", tmp_path)
