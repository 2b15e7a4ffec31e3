"""Shards: bytes, order, index, reading by us and by webdataset."""

import io
import json
import math
import pickle

import numpy as np
import pytest
import webdataset

from dataset import SEED, SNRS, SPLIT, TARGETS, build, motion_rows, write_settings
from lowalt.config.network import Network
from lowalt.config.splits import fold
from lowalt.files.errors import InputError
from lowalt.motion import write_table
from lowalt.shards import ShardSet
from lowalt.shards.__main__ import main
from lowalt.shards.sample_record import npy, row_of
from lowalt.shards.sample_table import map_samples, table_path
from lowalt.shards.sizes import sample_bytes
from lowalt.shards.write import ChunkSamples, write_shard
from lowalt.tiles import decode, resize, split
from options import words
from pictures import NETWORK, echoes


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    return build(tmp_path_factory.mktemp("images"), "image")


@pytest.fixture(scope="module")
def signals(tmp_path_factory):
    return build(tmp_path_factory.mktemp("signals"), "signal")


def test_tar_bytes_are_those_of_webdatasets_writer(images):
    path = images / "seen-train-00000.tar"
    buffer = io.BytesIO()
    writer = webdataset.TarWriter(buffer, encoder=False, mtime=0)
    for sample in webdataset.WebDataset(str(path), shardshuffle=False):
        writer.write(
            {name: value for name, value in sample.items() if name in ("__key__", "json", "png")}
        )
    writer.close()
    assert path.read_bytes() == buffer.getvalue()


def test_every_sample_stands_once_in_the_fold_that_is_its_own(images):
    found = []
    for group in TARGETS:
        for name in ("train", "val", "test"):
            for sample in webdataset.WebDataset(
                str(images / f"{group}-{name}-00000.tar"), shardshuffle=False
            ):
                entry = json.loads(sample["json"])
                found.append((entry["subtype"], entry["model"], row_of(entry)[1]))
                assert sample["__key__"] == entry["key"] and "." not in entry["key"]
                assert entry["fold"] == name == fold(SPLIT, SEED, entry["subtype"], entry["model"])
                assert entry["group"] == group
    expected = [
        (row["subtype"], row["model"], float(snr))
        for g in TARGETS
        for row in motion_rows(g)
        for snr in SNRS
    ]
    assert sorted(found) == sorted(expected)


def test_order_depends_on_names_alone(images, tmp_path):
    """With another SNR in the data set, the samples there were keep their order."""
    rows = motion_rows("seen")
    noisy = np.stack([echoes(seed) for seed in range(3 * len(rows))]).reshape(len(rows), 3, 3, 400)
    np.save(tmp_path / "seen.npy", noisy)
    write_table(tmp_path / "seen.csv", rows[::-1])
    block = {**json.loads(write_settings("signal")), "snr_db": ["inf", 8, 3]}
    files = {"motion": tmp_path / "seen.csv", "signals": tmp_path / "seen.npy"}
    out = tmp_path / "seen-train-00000.tar"
    main(words("write", settings=json.dumps(block), **files, fold="train", out=out))
    before = map_samples(images / "seen-train-00000.npz")["key"].tolist()
    after = map_samples(tmp_path / "seen-train-00000.npz")["key"].tolist()
    assert [key for key in after if not key.endswith(b"snr008")] == before
    assert before != sorted(before)


def test_shard_set_reads_any_sample(images):
    shards = ShardSet(images / "index.json", ["seen"], ["train", "val"])
    assert len(shards) == 2 * 3 * 2
    folds = [shards.record(number)["fold"] for number in range(len(shards))]
    assert sorted(folds) == ["train"] * 8 + ["val"] * 4
    for number in (0, len(shards) - 1):
        entry = shards.record(number)
        assert shards.keys[number].decode() == entry["key"]
        assert (shards.labels[number], shards.models[number]) == (entry["label"], entry["model"])
        assert shards.snrs_db[number] == row_of(entry)[1]
        tile, palette = decode(shards.png(number))
        np.testing.assert_array_equal(shards.images(number), split(tile, 3))
        np.testing.assert_array_equal(shards.palette, palette)
    with pytest.raises(IndexError):
        shards.record(len(shards))


def test_both_kinds_give_the_same_images(images, signals):
    by_image, by_signal = (ShardSet(folder / "index.json") for folder in (images, signals))
    np.testing.assert_array_equal(by_image.keys, by_signal.keys)
    again = pickle.loads(pickle.dumps(by_signal))
    for number in range(0, len(by_image), 5):
        np.testing.assert_array_equal(by_image.images(number), by_signal.images(number))
        np.testing.assert_array_equal(by_signal.signal(number), again.signal(number))
    with pytest.raises(InputError, match="signal"):
        by_image.signal(0)
    with pytest.raises(InputError, match="image"):
        by_signal.png(0)


def test_wrong_input_is_refused_by_name(images, tmp_path, tmp_path_factory):
    right = {"motion": images / "seen.csv", "signals": images / "seen.npy"}
    right |= {"tiles": images / "seen.tiles.npz", "fold": "train", "out": tmp_path / "x.tar"}
    block = json.loads(write_settings("image"))
    one = tmp_path_factory.mktemp("one") / "seen.npy"
    np.save(one, np.load(images / "seen.npy")[:, :1])
    for change, given, named in [
        ({}, {"tiles": None}, "--tiles"),
        ({"shards": {"kind": "sound"}}, {}, "sound"),
        ({"snr_db": [3]}, {}, "seen.npy"),
        ({}, {"tiles": images / "unseen.tiles.npz"}, "unseen.tiles.npz"),
        ({}, {"fold": "trial"}, "trial"),
        # The images of two SNRs for one.
        ({"snr_db": [3]}, {"signals": one}, "16 images, expected 8"),
    ]:
        options = words(settings=json.dumps({**block, **change}), **right | given)
        with pytest.raises(InputError, match=named):
            main(["write", *options])
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(InputError, match="tests"):
        ShardSet(images / "index.json", ["seen"], ["tests"])
    with pytest.raises(InputError, match="expected one of"):
        main(["pack"])


def test_stations_and_views_are_selected_alike_from_both_kinds(images, signals):
    for folder in (images, signals):
        shards = ShardSet(folder / "index.json")
        whole = shards.images(3)
        np.testing.assert_array_equal(shards.images(3, stations=["B"]), whole[3:6])
        np.testing.assert_array_equal(
            shards.images(3, stations=["C", "A"], views=["vt"]), whole[[8, 2]]
        )
        np.testing.assert_array_equal(
            shards.images(3, size=64, views=["trp"]), resize(whole[[1, 4, 7]], 64)
        )
        assert shards.images(3, size=224).shape == (9, 224, 224)
        with pytest.raises(InputError, match="'D'"):
            shards.images(3, stations=["D"])


def test_a_sample_takes_the_promised_space(images, signals):
    for folder, kind in ((images, "image"), (signals, "signal")):
        index = json.loads((folder / "index.json").read_text())
        promised = sample_bytes({**index["render"], "shards": {"kind": kind}})
        found = map_samples(folder / "seen-train-00000.npz")["size"].mean()
        assert found <= 1.3 * promised and promised <= 1.3 * found
    # Two headers, a record, and 128 bytes before three stations' 401 numbers of 8 bytes, filled up
    # to whole blocks.
    block = {"network": {**NETWORK, "symbols": 401}, "noise": {"snr_db": [3, 8, 13, math.inf]}}
    assert sample_bytes({**block, "shards": {"kind": "signal"}}) == 2 * 512 + 2048 + 20 * 512
    assert sample_bytes({**block, "shards": {"kind": "recipe"}}) == (2 * 512 + 2048 + 20 * 512) // 4


@pytest.mark.parametrize("kind", ["signal", "recipe"])
def test_a_fold_in_several_shards_holds_each_sample_once_and_every_class_in_each(kind, tmp_path):
    rows = motion_rows("seen", 24)
    network = Network.from_settings(NETWORK)
    samples = ChunkSamples(
        rows, [3.0, math.inf], {"by": "motion", "train": 1, "val": 0, "test": 0}, 7, network
    )
    data = npy(np.ones((3, 400), np.complex64))
    whole = write_shard(
        tmp_path / "whole.tar", samples, "train", kind, lambda number, level: (data, {})
    )
    tables = []
    for number in range(3):
        path = tmp_path / f"part{number}.tar"
        write_shard(path, samples, "train", kind, lambda number, level: (data, {}), (number, 3))
        tables.append(map_samples(table_path(path)))
    keys = np.concatenate([table["key"] for table in tables])
    assert len(keys) == whole["samples"] and set(keys) == set(
        map_samples(tmp_path / "whole.npz")["key"]
    )
    assert {len(table) for table in tables} == {whole["samples"] // 3}
    assert all(
        set(table["label"]) == set(map_samples(tmp_path / "whole.npz")["label"]) for table in tables
    )
    # All SNRs of a motion model lie in one shard.
    models = [{key.rpartition(b"-")[0] for key in table["key"].tolist()} for table in tables]
    assert sum(map(len, models)) == len(set().union(*models))


def test_an_address_that_no_extension_reads_is_refused():
    with pytest.raises(InputError, match="carrier-pigeon://: no extension reads such addresses"):
        ShardSet("carrier-pigeon://loft/index.json")
