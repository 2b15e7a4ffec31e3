"""A training fed by samples made on the spot sees what a training fed by shards sees, batch by
batch.
"""

import json
import pickle
from types import SimpleNamespace

import numpy as np
import pytest
import torch
import yaml

import model_files
from configured import Inputs, stages_of
from lowalt.config.classes import CATEGORIES
from lowalt.files.errors import InputError
from lowalt.recognition import samples
from lowalt.recognition.__main__ import main
from lowalt.recognition.dataset_samples import DatasetSamples, opened, stations_of
from lowalt.recognition.views import ShardSamples
from lowalt.shards import maker
from lowalt.shards.build import write_run
from lowalt.shards.dataset import Dataset
from lowalt.spectra import NAMES
from lowalt.workflow.stages.stage import given
from small_configuration import configuration
from trainings import SCHEME

SIZE = 24
COLUMNS = [0, 2, len(NAMES), len(NAMES) + 2]
"""Views by the catalogue, whose spectra are four: images 0, 2, 3 and 5 of a data set with the first
three.
"""
ONE_OF_EACH = ["DJI Mini 2", "Crow", "AITO M9 2024", "Walking Pedestrian 1", "Owl"]


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run's folder with clouds, configuration and signal shards: two chunks of a group, one
    subtype a class.
    """
    config = configuration()
    config["targets"]["select"] = ONE_OF_EACH
    config["motion"] |= {"models": 8, "models_per_chunk": 4}
    folder = tmp_path_factory.mktemp("made") / "run"
    write_run(Dataset(config), folder, "signal")
    (folder / "config.yaml").write_text(yaml.safe_dump(config))
    return folder


@pytest.fixture(scope="module")
def pair(run):
    folds = {("seen", "train"), ("seen", "val"), ("unseen", "val")}
    made = DatasetSamples(opened(run / "config.yaml"), COLUMNS, folds, SIZE, placed=True)
    return made, ShardSamples(run / "shards" / "index.json", COLUMNS, folds, SIZE, placed=True)


def test_order_facts_and_pixels_are_those_of_the_shards(pair):
    made, stored = pair
    assert len(made.facts) == 2 * (4 * 6 + 2)
    for name in samples.FACTS:
        one = getattr(made.facts, name)
        other = getattr(stored.facts, name)
        assert one.dtype == other.dtype and np.array_equal(
            one, other, equal_nan=one.dtype.kind == "f"
        ), name
    some = np.array([0, 7, 30, 51, 3])
    assert (made.views(some) == stored.views(some)).all()
    copy = pickle.loads(pickle.dumps(made))
    copy.keep(some[1:])
    assert (copy.views(np.array([0, 2])) == stored.views(some[[1, 3]])).all()
    assert copy.facts.key.tolist() == stored.facts.key[some[1:]].tolist()


def test_clean_echoes_are_computed_once_a_motion_model(run, pair, monkeypatch):
    made = pair[0]
    calls = []
    maker = made.dataset.maker
    monkeypatch.setattr(type(maker), "_listen", lambda self, row: calls.append(row))
    made.views(np.arange(len(made.facts)))
    assert calls == [] and maker.kept >= len({place for place, _ in made.chosen}) == 26
    monkeypatch.undo()
    monkeypatch.setattr("lowalt.recognition.dataset_samples.CLEAN_BYTES", 9600)
    small = DatasetSamples(
        opened(run / "config.yaml"), COLUMNS, {("unseen", "val")}, SIZE, placed=False
    )
    assert not small.dataset.maker._received and np.isnan(small.facts.range_m).all()


def test_a_training_on_made_samples_ends_in_the_same_weights(run, tmp_path):
    config = yaml.safe_load((run / "config.yaml").read_text())
    block = config["recognition"]
    block["training"] |= {"steps": 3, "validate_every": 3, "batch": 4}
    settings = {key: block[key] for key in ("network", "training", "augmentation")}
    settings |= {"seed": 1, "size": SIZE, "colour_map": "viridis", "classes": list(CATEGORIES)}
    line = [
        "train",
        "--settings",
        json.dumps({**settings, "scheme": SCHEME.record}),
        "--protocol",
        "seen",
    ]
    weights = []
    for name, source in (
        ("dataset", run / "config.yaml"),
        ("index", run / "shards" / "index.json"),
    ):
        main([*line, f"--{name}", str(source), "--out", str(tmp_path / name)])
        weights.append(model_files.load(tmp_path / name / "model.safetensors")[1]["weights"])
    assert all(torch.equal(weights[0][name], weights[1][name]) for name in weights[1])
    with pytest.raises(InputError, match="one of --views, --index and --dataset"):
        main([*line, "--out", str(tmp_path / "none")])


def test_what_a_made_training_rests_on_is_in_its_identity(run, pair):
    folds = {("seen", "val")}
    same = [
        DatasetSamples(opened(run / "config.yaml"), COLUMNS, folds, SIZE, placed=False).sha256()
        for _ in range(2)
    ]
    other = opened(run / "config.yaml")
    other.clouds["Crow"].points[0, 0] += 1e-9
    changed = DatasetSamples(other, COLUMNS, folds, SIZE, placed=False).sha256()
    assert same[0] == same[1] != changed
    with pytest.raises(InputError, match="3 stations, the scheme needs"):
        DatasetSamples(other, [3 * len(NAMES)], folds, SIZE, placed=False)
    with pytest.raises(InputError, match="no samples"):
        DatasetSamples(other, [0], set(), SIZE, placed=False)


def test_the_configuration_names_the_source():
    overlay = {
        "recognition": {"cache": False, "input": "dataset"},
        "effects": {"occlusion": {}},
        "echo": {"tolerance": 1e-3},
    }
    found = stages_of(overlay).recognition.samples(SimpleNamespace(scheme="a-vrp-trp-vt"))
    assert (
        found["dataset"] == "results/default/config.yaml"
        and len(found["clouds"]) == len(found["occluders"]) == 40
    )
    options = given("dataset", "views", "index")
    assert options(None, Inputs(found)) == ["--dataset", "results/default/config.yaml"]
    with pytest.raises(InputError, match=r"recognition\.input"):
        stages_of({"recognition": {"input": "dataset"}})


@pytest.mark.parametrize("effects", [{}, {"carrier_offset": {}}, {"cell_noise": {}}])
def test_only_the_stations_that_a_scheme_sees_are_computed(run, effects, monkeypatch):
    """The second station of three alone, and its signal has the same bits as with the others next
    to it.
    """
    dataset = opened(run / "config.yaml")
    asked = []

    def heard(original, names):
        def counted(*given, **more):
            asked.extend(names(given))
            return original(*given, **more)

        return counted

    monkeypatch.setattr(maker, "clean_signals", heard(maker.clean_signals, lambda given: given[1]))
    monkeypatch.setattr(
        maker, "scene_signals", heard(maker.scene_signals, lambda given: [given[1]])
    )
    dataset.maker.echo["effects"] = effects
    row = dataset.row(dataset.place(3))
    whole = dataset.maker.signal(row, 8.0)
    assert asked == ["A", "B", "C"] and (abs(whole).max(axis=1) > 0).all()
    one = dataset.maker.signal(row, 8.0, [1])
    assert asked == ["A", "B", "C", "B"]
    assert (one[1] == whole[1]).all() and not one[[0, 2]].any()


def test_all_stations_are_asked_for_range_cells(run):
    dataset = opened(run / "config.yaml")
    assert stations_of(dataset.maker, [3, 5]) == [1]
    assert stations_of(dataset.maker, [0, 2, 3]) == [0, 1]
    dataset.maker.render["spectra"] = dataset.maker.render["spectra"] | {
        "hrrp": {"window": 1, "hop": 1, "cells": 9}
    }
    assert stations_of(dataset.maker, [4, 7]) is None
