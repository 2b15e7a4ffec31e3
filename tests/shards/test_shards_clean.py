"""Recipe shards: clean echoes once a motion model, read as the signal shards whose samples they
stand for.
"""

import json
import math
import shutil
import tarfile

import numpy as np
import pytest
import yaml

from dataset import CONFIG, SEED, build, motion_rows, write_settings
from hub_library import loaded
from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.numerics.streams import stream
from lowalt.scene.effects.transmitter import slow_time
from lowalt.shards import ShardSet, clean
from lowalt.shards.__main__ import main
from lowalt.shards.build import write_run
from lowalt.shards.card import main as card
from lowalt.shards.dataset import Dataset
from lowalt.shards.index import build as build_index
from lowalt.shards.sample_record import npy, row_of
from lowalt.shards.sample_table import map_samples
from lowalt.shards.verify import faults
from lowalt.shards.write import ChunkSamples, write_shard
from options import words
from pictures import NETWORK
from small_configuration import configuration
from stage_runs import check_members

STATIONS = list(NETWORK["stations"])


@pytest.fixture(scope="module")
def recipes(tmp_path_factory):
    folder = build(tmp_path_factory.mktemp("recipe") / "shards", "recipe")
    (folder.parent / "config.yaml").write_text(yaml.safe_dump(CONFIG))
    return folder


@pytest.fixture(scope="module")
def published(recipes, tmp_path_factory):
    folder = build(tmp_path_factory.mktemp("published") / "shards", "recipe", inputs=False)
    card(
        words(
            index=folder / "index.json",
            config=recipes.parent / "config.yaml",
            date="2026-01-31",
            url="https://example.org/trial",
        )
    )
    return folder


def test_samples_have_the_numbers_that_they_have_in_signal_shards_and_no_image(recipes, tmp_path):
    found = ShardSet(recipes / "index.json")
    expected = ShardSet(build(tmp_path / "signal", "signal") / "index.json")
    np.testing.assert_array_equal(found.keys, expected.keys)
    np.testing.assert_array_equal(found.snrs_db, expected.snrs_db)
    with pytest.raises(InputError, match="kind 'recipe', expected 'image'"):
        found.png(0)


def test_images_know_how_late_symbols_are_as_the_effect_draws_it(recipes, tmp_path):
    """`spectra.times: known` takes each symbol at its instant, which the effect draws again."""
    shutil.copytree(recipes, tmp_path / "late")
    path = tmp_path / "late/index.json"
    jitter = slow_time.DEFAULTS | {"downlink": 1.0, "jitter_s": 2e-3}
    render = {name: CONFIG[name] for name in ("network", "spectra", "images")}
    render["spectra"] = render["spectra"] | {"times": "known"}
    effects = {"tolerance": None, "effects": {"slow_time": jitter}}
    build_index(sorted(path.parent.glob("*.tar")), render, path, effects)
    shards = ShardSet(path)
    network = Network.from_settings(NETWORK)
    row = row_of(shards.record(5))[0]
    late = []
    for name in STATIONS:
        rng = stream(SEED, "effect", "slow_time", row["subtype"], row["model"], name)
        times_s = slow_time.sampling(jitter, network, rng).times_s
        late.append((times_s - network.times_s) / network.symbol_interval_s)
    expected = shards.renderer.tile(shards.signal(5), late=np.stack(late))
    assert (shards.tile(5) == expected).all()
    assert (
        shards.images(5) == expected.reshape(3, 256, 3, 256).swapaxes(1, 2).reshape(9, 256, 256)
    ).all()
    assert (shards.tile(5) != shards.renderer.tile(shards.signal(5))).any()


def test_each_motion_model_is_stored_once(recipes):
    with tarfile.open(recipes / "seen-train-00000.tar") as archive:
        names = archive.getnames()
    rows = map_samples(recipes / "seen-train-00000.npz")
    models = {key.decode().rpartition("-snr")[0] for key in rows["key"].tolist()}
    assert sorted(names) == sorted(
        f"{model}{end}" for model in models for end in (".clean.npy", ".json")
    )
    # Two SNRs share each echo.
    assert len(set(rows["offset"].tolist())) == len(models) == len(rows) / 2


def test_splits_by_sample_give_each_fold_its_own_levels(tmp_path):
    rows = motion_rows("unseen")
    split = {"by": "sample", "train": 2, "val": 1, "test": 1}
    echoes = np.ones((3, 400), np.complex64)
    network = Network.from_settings(NETWORK)
    seen = []
    for fold in ("train", "val", "test"):
        path = tmp_path / f"unseen-{fold}-00000.tar"
        chunk = ChunkSamples(rows, [3.0, 8.0, np.inf], split, SEED, network)
        write_shard(path, chunk, fold, "recipe", lambda *_: (npy(echoes), {}))
        with tarfile.open(path) as archive:
            for name in archive.getnames():
                if name.endswith(".json"):
                    entry = json.load(archive.extractfile(name))
                    seen += [(entry["model"], snr) for snr in clean.sample_snrs(entry)]
    assert sorted(seen) == [(model, snr) for model in range(4) for snr in (3.0, 8.0, np.inf)]


def test_noise_passes_the_canceller_of_a_scene_and_noise_that_effects_add_is_refused(tmp_path):
    config = configuration(effects={"canceller": {"kind": "mean"}})
    config["targets"]["select"] = ["Owl"]
    scene = Dataset(config)
    write_run(scene, tmp_path, "recipe")
    shards = ShardSet(tmp_path / "shards/index.json")
    check_members(scene, shards)
    # The canceller leaves neither the echo nor noise a mean; that of 400 values of noise is 5 %.
    signal = shards.signal(int(np.argmin(shards.snrs_db)))
    assert abs(signal.mean(axis=1)).max() < 0.01 * abs(signal).mean()
    with pytest.raises(InputError, match="cell_noise"):
        clean.refuse({"cell_noise": {}})


def test_damage_is_named_with_every_sample_that_it_reaches(published, tmp_path):
    folder = shutil.copytree(published, tmp_path / "copy")
    assert list(faults(folder / "index.json")) == []
    rows = map_samples(folder / "seen-train-00000.npz")
    path = folder / "seen-train-00000.tar"
    row = rows[-1]
    # The table's last sample belongs to a model that is not the last in the archive.
    assert row["offset"] < rows["offset"].max()
    data = bytearray(path.read_bytes())
    data[int(row["data_offset"]) + 200] ^= 1
    path.write_bytes(data)
    lines = [
        line for line in faults(folder / "index.json") if path.name in line and "sample" in line
    ]
    assert not [line for line in faults(folder / "index.json") if "archive" in line]
    model = row["key"].decode().rpartition("-snr")[0]
    assert sorted(lines) == [
        f"{path.name}: sample {model}-{level} is damaged (SHA-256 differs)"
        for level in ("snr003", "snrinf")
    ]
    with pytest.raises(InputError, match=model):
        shards = ShardSet(folder / "index.json", ["seen"], ["train"])
        shards.signal(len(shards) - 1)


def test_webdataset_gives_the_samples_that_are_read_by_number(published):
    webdataset = pytest.importorskip("webdataset")
    stored = ShardSet(published / "index.json", ["seen"], ["train"])
    numbers = {key.decode(): number for number, key in enumerate(stored.keys.tolist())}
    path = str(published / "seen-train-00000.tar")
    for decoding in (False, True):
        pipeline = webdataset.WebDataset(path, shardshuffle=False)
        pipeline = pipeline.decode() if decoding else pipeline
        found = list(pipeline.compose(clean.samples))
        assert sorted(sample["__key__"] for sample in found) == sorted(numbers)
        for sample in found:
            number = numbers[sample["__key__"]]
            assert sample["json"] == stored.record(number)
            assert (sample["npy"].view(np.complex64)[..., 0] == stored.signal(number)).all()


def test_the_hubs_library_reads_clean_echoes_by_the_card(published, tmp_path, monkeypatch):
    rows = loaded(published, tmp_path, monkeypatch, "unseen")["test"]
    assert len(rows) == 4
    for row in rows:
        assert row["json"]["snr_db"] == [3.0, math.inf] and row["json"]["noise"] == [True, False]
        assert np.array(row["clean.npy"], np.float32).shape == (3, 400, 2)


def test_card_and_croissant_tell_of_recipes(published, mlcroissant):
    text = (published / "README.md").read_text()
    assert (
        "KEY.clean.npy" in text
        and "lowalt.shards.clean.samples" in text
        and "{" not in text.split("```")[0]
    )
    data = mlcroissant.Dataset(str(published / "croissant.json"))
    assert not data.metadata.issues.errors and not data.metadata.issues.warnings
    assert len(list(data.records("samples"))) == 24


def test_a_missing_file_of_echoes_is_named(recipes, tmp_path):
    settings = write_settings("recipe")
    out = tmp_path / "seen-train-00000.tar"
    paths = [recipes / f"seen.{name}.npy" for name in STATIONS]
    other = recipes / "unseen.A.npy"
    for given, message in (
        ({}, "--echoes: missing"),
        ({"echoes": paths[:2]}, "2 files"),
        ({"echoes": [*paths[:2], other]}, "unseen"),
        ({"echoes": paths, "powers": paths}, "--powers: shape"),
    ):
        options = words(
            settings=settings, motion=recipes / "seen.csv", fold="train", out=out, **given
        )
        with pytest.raises(InputError, match=message):
            main(["write", *options])
    assert not list(tmp_path.iterdir())
