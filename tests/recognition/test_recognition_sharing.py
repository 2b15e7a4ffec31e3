"""Models that others can use: safetensors with the run's identity, ONNX, cards, 8-bit entries of the zoo."""

import json
import shutil
from dataclasses import asdict, replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import torch
import yaml
from safetensors import safe_open

import model_files
from lowalt.__main__ import main
from lowalt.files.errors import InputError
from lowalt.recognition import model_file, predict_sample, runs, zoo, zoo_files
from lowalt.recognition.export import export
from made_predictions import facts
from pictures import IMAGES, NETWORK, SPECTRA
from trainings import SCHEME, SETTINGS, equal, sources

ROOT = Path(__file__).parents[2]
TABLE = """\
protocol,scheme,snr_db,accuracy_percent,samples,hardware,seeds,spread_points
seen,AB:VRP+VT,3,81.2500,16,a machine,3,0.5
seen,AB:VRP+VT,avg,84.3750,32,a machine,3,0.5
unseen,AB:VRP+VT,avg,11.1111,32,a machine,3,0.5
"""


@pytest.fixture
def finished(trained, tmp_path):
    """The model.safetensors of a training inside the folder of a run with a table of accuracy and a configuration."""
    place = tmp_path / "results/mine/models/seen/ab-vrp-vt/3"
    shutil.copytree(trained, place)
    config = {"network": NETWORK, "spectra": SPECTRA, "images": IMAGES, "split": {}}
    (tmp_path / "results/mine/config.yaml").write_text(yaml.safe_dump(config))
    (tmp_path / "results/mine/accuracy.csv").write_text(TABLE)
    return place / "model.safetensors"


def answers(trained, views):
    """Class probabilities of a model for the validation samples."""
    with torch.inference_mode():
        return trained.model(torch.from_numpy(sources(views)["validation"].views(np.arange(12)))).softmax(1)


def test_a_safetensors_file_holds_the_weights_and_all_that_made_them(finished, views, tmp_path):
    model = runs.load(finished)
    for name in ("one", "two"):
        export(model, tmp_path / f"{name}.safetensors")
    assert (tmp_path / "one.safetensors").read_bytes() == (tmp_path / "two.safetensors").read_bytes()
    with safe_open(tmp_path / "one.safetensors", framework="pt") as file:
        about = json.loads(file.metadata()["lowalt"])
        stored = {name: file.get_tensor(name) for name in file.keys()}  # noqa: SIM118
    identity, state = model_files.load(finished)
    assert equal(stored, state["weights"])
    assert about["identity"] == json.loads(identity)
    assert about["identity"]["samples"]["train"] == sources(views)["train"].sha256()
    assert about["run"] == json.loads(finished.with_name("run.json").read_text())
    assert about["input"] == {"network": NETWORK, "spectra": SPECTRA, "images": IMAGES}
    again, made = zoo.opened(tmp_path / "one.safetensors")
    assert torch.equal(answers(again, views), answers(model, views)) and made == about["input"]
    assert (again.scheme, again.size, again.seed, again.classes) == (SCHEME, 32, 3, tuple(SETTINGS["classes"]))


def test_a_card_stands_next_to_the_file_with_the_runs_own_numbers(finished, tmp_path):
    export(runs.load(finished), tmp_path / "mine.safetensors")
    card = (tmp_path / "mine.md").read_text()
    front = yaml.safe_load(card.split("---\n")[1])
    assert front["license"] == "mit" and "safetensors" in front["tags"]
    record = json.loads(finished.with_name("run.json").read_text())
    assert f"| steps | {record['steps']} |" in card and f"| trained values | {record['parameters']} |" in card
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
        zoo.opened(path)


def test_eight_bits_move_a_weight_by_at_most_half_a_step_of_its_row():
    torch.manual_seed(1)
    rows = torch.randn(5, 3, 2, 2) * torch.tensor([1e-6, 1.0, 300.0, 0.0, 2.0])[:, None, None, None]
    weights = {"conv": rows, "bias": torch.randn(5), "conv.scale": torch.randn(2), "count": torch.tensor(7)}
    del weights["conv.scale"]
    stored = model_file.rounded(weights, {"conv"})
    assert stored["conv"].dtype == torch.int8 and stored["conv"].shape == rows.shape
    found = model_file.restored(stored)
    assert found.keys() == weights.keys()
    assert torch.equal(found["bias"], weights["bias"]) and torch.equal(found["count"], weights["count"])
    error = (found["conv"] - rows).abs().flatten(1).amax(1)
    largest = rows.abs().flatten(1).amax(1)
    assert (error <= 1.001 * largest / 254).all() and error[1] > largest[1] / 1000
    layer = {"gamma": torch.ones(3, 3), "gamma.scale": torch.ones(3)}
    assert equal(model_file.restored(model_file.rounded(layer, set())), layer)


def test_an_entry_is_held_against_the_weights_as_trained_sample_by_sample(monkeypatch):
    told = {"exact": np.eye(2)[[0, 1, 1, 1]], "entry": np.array([[0.9, 0.1], [0.7, 0.3], [0.4, 0.6], [0.3, 0.7]])}
    monkeypatch.setattr(zoo, "probabilities", lambda model, *rest: told[model])
    # Their labels are 0, 1, 1, 0.
    samples = SimpleNamespace(facts=facts(models=1).take(np.array([0, 6, 7, 1])))
    found = zoo.held_against(SimpleNamespace(model="exact"), SimpleNamespace(model="entry"), samples)
    assert list(found.values()) == [4, 75.0, 50.0, 1, pytest.approx(0.7)]


def test_an_entry_of_the_zoo_is_small_measured_and_predicts_by_name(finished, views, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    zoo.main(["--model", str(finished), "--views", str(views), "--name", "mine"])
    content = model_file.read("results/zoo/mine.safetensors")
    exact, _ = zoo.opened(finished)
    entry, _ = zoo.opened("mine")
    validation = sources(views)["validation"]
    assert content.measured == zoo.held_against(exact, entry, validation)
    assert content.measured["samples"] == len(validation.facts)
    known = json.loads(finished.with_name("run.json").read_text())["validation_accuracy"]
    assert content.measured["exact_percent"] == pytest.approx(100 * known)
    one, other = answers(exact, views), answers(entry, views)
    assert 0 < (one - other).abs().max() <= content.measured["largest_change"] + 1e-6
    assert Path("results/zoo/mine.safetensors").stat().st_size < 0.4 * finished.stat().st_size
    card = Path("results/zoo/mine.md").read_text()
    assert f"| 8 bits | {content.measured['percent']:.3f} |" in card
    capsys.readouterr()
    assert main(["predict", "yours", "a.npy"]) == 2
    assert "'yours'" in (told := capsys.readouterr().err) and "'mine'" in told


def test_an_entry_that_loses_accuracy_or_is_large_or_ill_named_is_not_written(finished, views, tmp_path, monkeypatch):
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
    monkeypatch.setattr(zoo, "small", lambda content, own: replace(
        content, tensors={name: value * 0 for name, value in content.tensors.items()}))  # fmt: skip
    with pytest.raises(InputError, match="points less"):
        zoo.entry(finished, samples, "mine", tmp_path)
    assert not list(tmp_path.glob("*.safetensors"))


@pytest.mark.parametrize("name", ["default-seen", "default-unseen", "lowalt-40-v1-unseen"])
def test_the_shipped_entries_answer_by_name_and_say_on_their_cards_how_well(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    assert name in zoo_files.names()
    path = zoo.ZOO / f"{name}.safetensors"
    assert path.stat().st_size < zoo.LARGEST_BYTES
    measured, card = model_file.read(path).measured, path.with_suffix(".md").read_text()
    assert f"| 8 bits | {measured['percent']:.3f} |" in card and measured["percent"] > 95
    signals = np.exp(1j * np.arange(1200).reshape(3, 400) ** 1.4).astype(np.complex64)
    np.save(tmp_path / "a.npy", signals)
    assert main(["predict", name, str(tmp_path / "a.npy"), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert list(found) == ["UAV", "Bird", "Vehicle", "Pedestrian"] and sum(found.values()) == pytest.approx(1)
    model, made = zoo.opened(name)
    assert found == predict_sample.predict(model, tmp_path / "a.npy", made)


@pytest.mark.parametrize("name", ["uav_3ghz", "bird_drone_10ghz", "cw_24ghz"])
def test_the_shipped_entries_of_radars_are_those_of_the_twins_there_are(name, monkeypatch):
    from lowalt.extensions.recordings.twin import radars, records

    monkeypatch.chdir(ROOT)
    path = zoo.ZOO / f"{name}.safetensors"
    assert path.stat().st_size < zoo.LARGEST_BYTES and model_file.read(path).measured["percent"] > 80
    made = zoo.opened(name)[1]
    radar, caution = made["radar"], records()[name].twin["caution"]
    assert radar == asdict(radars()[name]) and made["caution"] == caution
    card = path.with_suffix(".md").read_text()
    assert f"{caution[1:]}.\n" in card and f"It classifies {made['expected']['percent']:.1f} % of" in card
    assert f"a radar of {radar['carrier_hz'] / 1e9:g} GHz" in card and f"lowalt predict {name} recording.yaml" in card


def test_signals_become_images_as_the_model_file_says_unless_overlays_are_given(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    content = model_file.read(zoo.ZOO / "default-seen.safetensors")
    made = {**content.input, "images": {**content.input["images"], "gamma": 1.0}}
    path, signals = tmp_path / "other.safetensors", tmp_path / "a.npy"
    model_file.write(path, replace(content, input=made))
    np.save(signals, np.exp(1j * np.arange(1200).reshape(3, 400) ** 1.4).astype(np.complex64))
    (tmp_path / "overlay.yaml").write_text("images: {gamma: 0.25}\n")
    model, found = zoo.opened(path)[0], []
    for more in ([], ["--overlay", str(tmp_path / "overlay.yaml")]):
        assert main(["predict", str(path), str(signals), "--json", *more]) == 0
        found.append(json.loads(capsys.readouterr().out))
    for gamma, answer in zip((1.0, 0.25), found, strict=True):
        assert answer == predict_sample.predict(model, signals, {**made, "images": {**made["images"], "gamma": gamma}})
    assert found[0] != found[1]


@pytest.mark.slow
def test_an_onnx_file_gives_the_same_answers_at_any_batch_size(trained, views, tmp_path):
    pytest.importorskip("onnxscript")
    onnxruntime = pytest.importorskip("onnxruntime")
    model = runs.load(trained / "model.safetensors")
    export(model, tmp_path / "model.onnx")
    session = onnxruntime.InferenceSession(str(tmp_path / "model.onnx"), providers=["CPUExecutionProvider"])
    source = sources(views)["validation"]
    for count in (1, 5):
        index = source.views(np.arange(count))
        with torch.inference_mode():
            expected = model.model(torch.from_numpy(index)).softmax(1).numpy()
        (found,) = session.run(None, {session.get_inputs()[0].name: index})
        np.testing.assert_allclose(found, expected, atol=1e-5)


def test_another_ending_is_refused(trained, tmp_path):
    with pytest.raises(InputError, match=r"expected a name ending in .safetensors or .onnx"):
        export(runs.load(trained / "model.safetensors"), tmp_path / "model.pt2")
