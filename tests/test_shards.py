"""Shards: bytes, order, index, reading by us and by webdataset."""

import hashlib
import io
import json
import pickle
import tarfile

import numpy as np
import pytest
import webdataset
from PIL import Image

from dataset import SEED, SNRS, SPLIT, TARGETS, build, motion_rows, write_settings
from lowalt.config.splits import fold
from lowalt.files.errors import InputError
from lowalt.motion import write_table
from lowalt.shards import ShardSet
from lowalt.shards.__main__ import main
from lowalt.shards.read import complex_signals
from lowalt.shards.record import row_of
from lowalt.shards.size import main as size_main
from lowalt.shards.size import models_per_chunk, sample_bytes
from lowalt.shards.table import map_samples
from lowalt.tiles import decode, resize, split
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
        writer.write({name: value for name, value in sample.items() if name in ("__key__", "json", "png")})
    writer.close()
    assert path.read_bytes() == buffer.getvalue()


@pytest.mark.parametrize("kind", ["image", "signal"])
def test_equal_inputs_give_equal_bytes(images, signals, kind, tmp_path):
    old = {"image": images, "signal": signals}[kind]
    new = build(tmp_path, kind)
    for path in sorted(old.iterdir()):
        assert (new / path.name).read_bytes() == path.read_bytes(), path.name


def test_every_sample_stands_once_in_the_fold_that_is_its_own(images):
    found = []
    for group in TARGETS:
        for name in ("train", "val", "test"):
            for sample in webdataset.WebDataset(str(images / f"{group}-{name}-00000.tar"), shardshuffle=False):
                entry = json.loads(sample["json"])
                found.append((entry["subtype"], entry["model"], row_of(entry)[1]))
                assert sample["__key__"] == entry["key"] and "." not in entry["key"]
                assert entry["fold"] == name == fold(SPLIT, SEED, entry["subtype"], entry["model"])
                assert entry["group"] == group
    expected = [(row["subtype"], row["model"], float(snr)) for g in TARGETS for row in motion_rows(g) for snr in SNRS]
    assert sorted(found) == sorted(expected)


def test_shards_open_with_plain_webdataset_and_pillow(images):
    data = webdataset.WebDataset(str(images / "unseen-test-00000.tar"), shardshuffle=False).decode("pil")
    count = 0
    for sample in data:
        assert sample["png"].size == (768, 768)
        tile, palette = decode(png_of(images, sample["__key__"]))
        np.testing.assert_array_equal(np.asarray(sample["png"].convert("RGB")), palette[tile])
        assert isinstance(sample["png"], Image.Image)
        count += 1
    assert count == 2


def png_of(folder, key):
    """The PNG of a sample by plain tarfile."""
    for path in folder.glob("*.tar"):
        with tarfile.open(path) as archive:
            if f"{key}.png" in archive.getnames():
                return archive.extractfile(f"{key}.png").read()
    raise KeyError(key)


def test_order_depends_on_names_alone(images, tmp_path):
    """With another SNR in the data set, the samples there were keep their order."""
    rows = motion_rows("seen")
    noisy = np.stack([echoes(seed) for seed in range(3 * len(rows))]).reshape(len(rows), 3, 3, 400)
    np.save(tmp_path / "seen.npy", noisy)
    write_table(tmp_path / "seen.csv", rows[::-1])
    block = {**json.loads(write_settings("signal")), "snr_db": ["inf", 8, 3]}
    inputs = ["--motion", f"{tmp_path}/seen.csv", "--signals", f"{tmp_path}/seen.npy", "--fold", "train"]
    main(["write", "--settings", json.dumps(block), *inputs, "--out", f"{tmp_path}/seen-train-00000.tar"])
    before = map_samples(images / "seen-train-00000.npz")["key"].tolist()
    after = map_samples(tmp_path / "seen-train-00000.npz")["key"].tolist()
    assert [key for key in after if not key.endswith(b"snr008")] == before
    assert before != sorted(before)


def test_signals_of_an_older_data_set_are_read(signals):
    stored = ShardSet(signals / "index.json").signal(0)
    assert (complex_signals(stored.view(np.float32).reshape(3, 400, 2)) == stored).all()
    assert complex_signals(stored) is stored


def test_index_has_counts_and_checksums(images):
    index = json.loads((images / "index.json").read_text())
    assert index["samples"] == 24
    for entry in index["shards"]:
        data = (images / entry["path"]).read_bytes()
        assert (len(data), hashlib.sha256(data).hexdigest()) == (entry["bytes"], entry["sha256"])
        samples = map_samples((images / entry["path"]).with_suffix(".npz"))
        assert len(samples) == entry["samples"]
        for row in samples:
            span = data[row["offset"] : row["offset"] + row["size"]]
            assert hashlib.sha256(span).digest() == row["sha256"].tobytes()


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
    inputs = ["--motion", f"{images}/seen.csv", "--signals", f"{images}/seen.npy"]
    out = ["--fold", "train", "--out", f"{tmp_path}/x.tar"]
    tiles = ["--tiles", f"{images}/seen.tiles.npz"]
    block = json.loads(write_settings("image"))
    one = tmp_path_factory.mktemp("one") / "seen.npy"
    np.save(one, np.load(images / "seen.npy")[:, :1])
    for change, given, named in [
        ({}, [*inputs, *out], "--tiles"),
        ({"shards": {"kind": "sound"}}, [*inputs, *tiles, *out], "sound"),
        ({"snr_db": [3]}, [*inputs, *tiles, *out], "seen.npy"),
        ({}, [*inputs, "--tiles", f"{images}/unseen.tiles.npz", *out], "unseen.tiles.npz"),
        ({}, [*inputs, *tiles, "--fold", "trial", "--out", f"{tmp_path}/x.tar"], "trial"),
        # The images of two SNRs for one.
        ({"snr_db": [3]}, [*inputs[:2], "--signals", str(one), *tiles, *out], "16 images, expected 8"),
    ]:
        with pytest.raises(InputError, match=named):
            main(["write", "--settings", json.dumps({**block, **change}), *given])
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
        np.testing.assert_array_equal(shards.images(3, stations=["C", "A"], views=["vt"]), whole[[8, 2]])
        np.testing.assert_array_equal(shards.images(3, size=64, views=["trp"]), resize(whole[[1, 4, 7]], 64))
        assert shards.images(3, size=224).shape == (9, 224, 224)
        with pytest.raises(InputError, match="'D'"):
            shards.images(3, stations=["D"])


def test_chunks_are_sized_for_their_shards(images, signals, tmp_path, capsys):
    """The promised space of a sample holds, and the number of models makes the train shard nearest the target."""
    for folder, kind in ((images, "image"), (signals, "signal")):
        promised = sample_bytes(kind, 3, 400)
        found = map_samples(folder / "seen-train-00000.npz")["size"].mean()
        assert found <= 1.3 * promised and promised <= 1.3 * found
    # Two headers, a record, and 128 bytes before three stations' 401 numbers of 8 bytes, filled up to whole blocks.
    assert sample_bytes("signal", 3, 401) == 2 * 512 + 2048 + 20 * 512
    assert sample_bytes("recipe", 3, 401, 4) == sample_bytes("signal", 3, 401) // 4
    split = {"by": "motion", "train": 8, "val": 1, "test": 1}
    models = models_per_chunk(1e9, 300_000, subtypes=20, snrs=6, split=split)
    assert models % 10 == 0 and abs(models * 0.8 * 20 * 6 * 300_000 - 1e9) <= 0.5 * 8 * 20 * 6 * 300_000
    assert models_per_chunk(1, 300_000, 20, 6, split) == 10
    with pytest.raises(InputError, match="target"):
        models_per_chunk(0, 300_000, 20, 6, split)
    block = {"network": NETWORK, "noise": {"snr_db": SNRS}, "split": split, "shards": {"kind": "signal"}}
    (tmp_path / "config.yaml").write_text(json.dumps(block))
    for given, target in ((["--target-mb", "40"], 40e6), ([], 1e9)):
        size_main(["--config", str(tmp_path / "config.yaml"), "--subtypes", "20", *given])
        assert int(capsys.readouterr().out) == models_per_chunk(target, sample_bytes("signal", 3, 400), 20, 2, split)
