"""Data sets of scenes and of a drafted town have cards.

Other people's tools read the data sets by them.
"""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

import towns
from hub_library import loaded
from lowalt.__main__ import main
from lowalt.config.layers import overlaid
from lowalt.shards import ShardSet
from lowalt.shards.build import write_run
from lowalt.shards.card import write as write_card
from lowalt.shards.dataset import Dataset

ROOT = Path(__file__).parents[3]
SCENES = sorted(path.stem for path in (ROOT / "config/scenes").glob("*.yaml"))
CHEAP = ["detection", "flock"]
"""Scenes in the quick suite: one of signals, one whose records name companions."""
FEW = {
    "targets": {"select": ["DJI Mini 2", "Owl", "Walking Pedestrian 5"]},
    "motion": {"models": 4, "models_per_chunk": 4, "looks": None},
    "split": {"by": "motion", "train": 2, "val": 1, "test": 1},
}


def text(value):
    """A cell of text, which Croissant's reference implementation gives as bytes."""
    return value.decode() if isinstance(value, bytes) else value


def drafted_town(folder):
    """The scene that `lowalt scene new` drafts from four buildings."""
    town = towns.geojson(folder / "town.geojson", towns.BOXES)
    scene = folder / "mytown.yaml"
    assert main(f"scene new {town} --out {scene}".split()) == 0
    return scene


def check_tools(scene, tmp_path, monkeypatch, mlcroissant):
    """Make a few samples of a scene and their card, and read them by it.

    The hub's library, Croissant's and WebDataset read all samples.
    """
    config = overlaid([scene, FEW])
    config["noise"]["snr_db"] = config["noise"]["snr_db"][:2]
    kind = "cube" if config["shards"]["kind"] == "cube" else "signal"
    dataset = Dataset(config)
    write_run(dataset, tmp_path / "run", kind, clouds=False)
    index = tmp_path / "run/shards/index.json"
    (tmp_path / "run/config.yaml").write_text(yaml.safe_dump(config))
    write_card(index, tmp_path / "run/config.yaml", datePublished="2026-01-31")
    shards = ShardSet(index)
    numbers = {key.decode(): number for number, key in enumerate(shards.keys.tolist())}
    assert len(numbers) == len(dataset) > 0
    read = read_by_hub(shards, numbers, tmp_path, monkeypatch)
    assert read == set(numbers)
    assert read_by_webdataset(shards, numbers) == set(numbers)
    described = mlcroissant.Dataset(str(index.parent / "croissant.json"))
    assert not described.metadata.issues.errors
    keys = {text(row["samples/key"]) for row in described.records("samples")}
    assert keys == set(numbers)
    return shards


def read_by_hub(shards, numbers, tmp_path, monkeypatch):
    """Keys of the samples that the hub's library reads by the card.

    Each comes with its record and array.
    """
    keys = set()
    folder = shards.index_path.parent
    card = (folder / "README.md").read_text()
    for protocol in yaml.safe_load(card.split("---")[1])["configs"]:
        found = loaded(folder, tmp_path, monkeypatch, protocol["config_name"])
        for rows in found.values():
            for row in rows:
                key = row["__key__"]
                assert row["json"] == shards.record(numbers[key])
                array = np.array(row["npy"], np.float64)
                np.testing.assert_array_equal(array, shards._array(numbers[key]))
                keys.add(key)
    return keys


def read_by_webdataset(shards, numbers):
    """Keys of the samples that WebDataset reads, each with its record."""
    import webdataset

    paths = [str(shards.index_path.parent / entry["path"]) for entry in shards.shards]
    keys = set()
    for sample in webdataset.WebDataset(paths, shardshuffle=False):
        key = sample["__key__"]
        assert json.loads(sample["json"]) == shards.record(numbers[key])
        keys.add(key)
    return keys


@pytest.mark.parametrize("scene", CHEAP)
def test_a_scene_s_samples_are_read_by_other_tools(scene, tmp_path, monkeypatch, mlcroissant):
    check_tools(ROOT / f"config/scenes/{scene}.yaml", tmp_path, monkeypatch, mlcroissant)


def test_a_drafted_town_s_samples_are_read_by_other_tools(tmp_path, monkeypatch, mlcroissant):
    shards = check_tools(drafted_town(tmp_path), tmp_path, monkeypatch, mlcroissant)
    stations = [shards.record(number)["paths"]["stations"] for number in range(len(shards))]
    routes = [seen["reflected"] for each in stations for seen in each.values()]
    # Lists of lists, of which some are empty.
    assert any(routes) and not all(routes)


@pytest.mark.slow
@pytest.mark.parametrize("scene", [name for name in SCENES if name not in CHEAP])
def test_every_other_scene_s_samples_are_read_by_other_tools(
    scene, tmp_path, monkeypatch, mlcroissant
):
    check_tools(ROOT / f"config/scenes/{scene}.yaml", tmp_path, monkeypatch, mlcroissant)
