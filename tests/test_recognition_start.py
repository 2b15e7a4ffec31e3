"""A training that starts from another one's weights: equal weights at step 0, no leak, resumed, and told apart."""

import csv
import json
import math

import numpy as np
import pytest
import torch

from lowalt.common.errors import InputError
from lowalt.recognition import checkpoint, runs, samples, schemes
from lowalt.recognition import start as starts
from lowalt.recognition.__main__ import main
from lowalt.recognition.methods import built
from lowalt.recognition.schemes import Scheme
from lowalt.recognition.start import carry, opened
from needed_options import assert_needed_options_are_named
from trainings import SCHEME, SETTINGS, Killed, equal, kill_at, with_training, write_views

ONE = Scheme("A:VRP+VT", (0,), (0, 2))
SHORT = with_training(steps=2, validate_every=2)
FOLDS = {"train": "train", "validation": "val"}


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """The folder of views of both groups, seen and unseen, and of a model of each protocol."""
    folder = tmp_path_factory.mktemp("both")
    write_views(folder / "seen.npz", 5)
    with np.load(folder / "seen.npz") as data:
        held = {name: data[name] for name in data.files}
    held["key"], held["subtype"] = (np.char.add("un", held[name]) for name in ("key", "subtype"))
    np.savez(folder / "unseen.npz", **{**held, "group": np.full(len(held["key"]), "unseen")})
    rows = "AB:VRP+VT,AB,VRP+VT,attention,,seen+unseen\nA:VRP+VT,A,VRP+VT,attention,,seen+unseen\n"
    (folder / "schemes.csv").write_text(",".join(schemes.COLUMNS) + "\n" + rows)
    for protocol in ("unseen", "seen"):
        train(folder, protocol, "AB:VRP+VT", protocol)
    return folder


def train(folder, protocol, scheme, out, *more, settings=SHORT):
    """Train from the command line into a folder below `folder`; return its model.pt."""
    main([
        "train", "--settings", json.dumps(settings), "--views", str(folder / "seen.npz"), str(folder / "unseen.npz"),
        "--schemes", str(folder / "schemes.csv"), "--stations", "A", "B", "C", "--protocol", protocol,
        "--scheme", scheme, "--out", str(folder / out), *more,
    ])  # fmt: skip
    return folder / out / "model.pt"


def test_at_a_rate_of_zero_the_weights_of_the_start_come_out_and_the_model_names_it(both):
    origin = both / "unseen" / "model.pt"
    still = with_training(steps=2, validate_every=1, rate=0.0)
    model = train(both, "seen", "A:VRP+VT", "still", "--start", str(origin), settings=still)
    name, state = checkpoint.load(model)
    assert equal(state["weights"], checkpoint.load(origin)[1]["weights"])
    about = {"training": "unseen/AB:VRP+VT", "seed": 3, "sha256": opened(origin).sha256}
    assert json.loads(name)["start"] == state["start"] == about
    assert json.loads(model.with_name("run.json").read_text())["start"] == about
    with model.with_name("history.csv").open(newline="") as file:
        history = list(csv.DictReader(file))
    assert [row["step"] for row in history] == ["0", "1", "2"] and math.isnan(float(history[0]["train_loss"]))
    assert len({row["validation_loss"] for row in history}) == 1
    assert "start" not in json.loads(checkpoint.load(origin)[0])


def test_a_start_that_has_met_a_test_sample_is_refused_by_name(both):
    with pytest.raises(InputError, match=r"seen/AB:VRP\+VT has 24 samples in its part 'train' .* first uns0 motion"):
        train(both, "unseen", "A:VRP+VT", "leak", "--start", str(both / "seen" / "model.pt"))
    assert not (both / "leak").exists()


def test_a_start_on_other_images_or_another_network_is_refused_by_name(both):
    origin = opened(both / "unseen" / "model.pt")
    parts = {
        part: samples.ViewSamples([both / "seen.npz"], SCHEME.columns, {("seen", fold)}) for part, fold in FOLDS.items()
    }
    starts.check_samples(origin, parts, parts)
    parts["validation"].images = 255 - parts["validation"].images
    with pytest.raises(InputError, match=r"unseen/AB:VRP\+VT was trained on other samples \(validation\)"):
        starts.check_samples(origin, parts, parts)
    starts.check_settings(origin, ONE, SETTINGS)
    for change in ({"size": 48}, {"classes": ["UAV", "Bird"]}, {"network": {**SETTINGS["network"], "hidden": 0}}):
        with pytest.raises(InputError, match=f"has another {next(iter(change))}, expected"):
            starts.check_settings(origin, ONE, {**SETTINGS, **change})
    with pytest.raises(InputError, match="has another backbone"):
        starts.check_settings(origin, Scheme("A", (0,), (0,), backbone="test_vit"), SETTINGS)


@pytest.mark.parametrize(
    ("scheme", "fresh"),
    [
        (Scheme("AC:VRP+VT", (0, 2), (0, 2)), []),
        (Scheme("A:TRP+VT", (0,), (1, 2)), ["fusion.modality"]),
        (Scheme("A:VT", (0,), (2,)), []),
        (Scheme("AB:VRP+VT", (0, 1), (0, 2), "mean"), []),
        (Scheme("AB:VRP+VT", (0, 1), (0, 2), "concatenation"), ["classifier.0.weight"]),
    ],
)
def test_weights_carry_over_by_name_and_shape_and_an_embedding_by_its_spectrum(both, scheme, fresh):
    origin = opened(both / "unseen" / "model.pt")
    given = origin.state["weights"]
    torch.manual_seed(0)
    model = built(scheme, SETTINGS["network"], 32, "gray", 4)
    before = {name: value.clone() for name, value in model.state_dict().items()}
    assert carry(origin, scheme, model) == fresh
    after = model.state_dict()
    for name in after.keys() - {"fusion.modality", "palettes.table"}:
        assert torch.equal(after[name], (before if name in fresh else given)[name])
    if "fusion.modality" in after:
        rows = {0: given["fusion.modality"][0], 2: given["fusion.modality"][1]}
        for row, spectrum in enumerate(scheme.spectra):
            assert torch.equal(after["fusion.modality"][row], rows.get(spectrum, before["fusion.modality"][row]))


def test_layers_that_only_the_new_network_has_stay_as_the_seed_made_them(both, tmp_path):
    mean = Scheme("AB:VRP+VT", (0, 1), (0, 2), "mean")
    parts = {
        part: samples.ViewSamples([both / "seen.npz"], SCHEME.columns, {("seen", fold)}) for part, fold in FOLDS.items()
    }
    runs.train(parts, mean, "unseen", SHORT, tmp_path / "mean")
    one, other = (built(SCHEME, SETTINGS["network"], 32, "gray", 4) for _ in range(2))
    other.load_state_dict(one.state_dict())
    fresh = carry(opened(tmp_path / "mean" / "model.pt"), SCHEME, other)
    assert fresh and all(name.startswith("fusion.") for name in fresh)
    before, after = one.state_dict(), other.state_dict()
    assert all(torch.equal(before[name], after[name]) for name in fresh)
    assert not torch.equal(before["classifier.0.weight"], after["classifier.0.weight"])


def test_a_killed_started_training_resumes_and_another_start_begins_anew(both, tmp_path, monkeypatch):
    def go(origin, folder, settings):
        parts = {
            part: samples.ViewSamples([both / "seen.npz"], ONE.columns, {("seen", fold)})
            for part, fold in FOLDS.items()
        }
        runs.train(parts, ONE, "unseen", settings, folder, start=opened(both / origin / "model.pt"))
        return checkpoint.load(folder / "model.pt")[1]["weights"], (folder / "history.csv").read_text()

    whole = go("unseen", tmp_path / "whole", with_training(steps=4, validate_every=2))
    settings = with_training(steps=4, validate_every=2, checkpoint_s=0)
    step = kill_at(monkeypatch, 3)
    with pytest.raises(Killed):
        go("unseen", tmp_path / "parts", settings)
    monkeypatch.setattr(runs.Trainer, "_step", step)
    with pytest.raises(InputError, match="another run, its start differ"):
        go("seen", tmp_path / "parts", settings)
    parts = go("unseen", tmp_path / "parts", settings)
    assert equal(whole[0], parts[0]) and whole[1] == parts[1]


def test_a_file_that_is_no_network_is_refused_by_name(tmp_path):
    checkpoint.save(tmp_path / "model.pt", "{}", {"twin": "x"})
    with pytest.raises(InputError, match=r"model\.pt: model: unknown key"):
        opened(tmp_path / "model.pt")


NEEDED = """
measure.fresh_models: --settings, --run, --work, --out
measure.network_speed: --settings, --scheme, --stations, --out
recognition.__main__ distances: --settings, --clouds, --motion, --out
recognition.__main__ evaluate: --settings, --model, --out
recognition.__main__ export: --settings, --model, --out
recognition.__main__ freeze: --settings, --out
recognition.__main__ score: --settings, --predictions, --index, --protocol, --out
recognition.__main__ tables: --settings, --predictions, --out
recognition.__main__ train: --settings, --protocol, --scheme, --stations, --out
recognition.__main__ transfer: --settings, --own, --other, --configs, --out
recognition.__main__ views: --settings, --index, --shard, --out
recognition.choose: --settings, --predictions, --out
recognition.rates: --settings, --protocol, --scheme, --stations, --out
recognition.slow_time: --settings, --index, --shard, --out
recognition.track: --settings, --index, --shard, --out
recognition.trial: --settings, --views, --candidate, --fold, --stations, --out
recognition.upload: --model, --repository
recognition.zoo: --model, --name
"""


def test_a_command_without_its_options_names_all_that_it_needs(capsys):
    assert_needed_options_are_named(NEEDED, capsys)
