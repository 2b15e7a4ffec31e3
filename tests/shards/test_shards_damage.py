"""Damaged, missing and exchanged files of a data set: verify names each, and reading refuses them."""

import shutil

import numpy as np
import pytest

from dataset import build, publish
from lowalt.files.errors import InputError
from lowalt.shards import ShardSet, faults, verify
from lowalt.shards.sample_table import map_samples


@pytest.fixture(scope="module")
def images(tmp_path_factory):
    return build(tmp_path_factory.mktemp("images"), "image")


@pytest.fixture
def copy(images, tmp_path):
    """A copy of the image shards, published with a data card, to do harm to."""
    return publish(images, tmp_path / "copy")


def test_every_fault_is_found_and_named(copy, images):
    """Single bytes and cuts at random places: verify names the shard and the sample, reading never passes them."""
    rng = np.random.default_rng(3)
    paths = sorted(copy.glob("*.tar"))
    for _ in range(40):
        path = paths[rng.integers(len(paths))]
        whole = (images / path.name).read_bytes()
        samples = map_samples(images / path.with_suffix(".npz").name)
        place = int(rng.integers(len(whole)))
        hit = [r["key"].decode() for r in samples if r["offset"] <= place < r["offset"] + r["size"]]
        if rng.random() < 0.5:
            damaged = bytearray(whole)
            damaged[place] ^= int(rng.integers(1, 256))
            path.write_bytes(damaged)
        else:
            path.write_bytes(whole[:place])
        lines = list(faults(copy / "index.json"))
        assert lines and all(line.startswith(path.name) for line in lines)
        assert all(any(key in line for line in lines) for key in hit)
        shards = ShardSet(copy / "index.json")
        if hit:
            number = shards.keys.tolist().index(hit[0].encode())
            with pytest.raises(InputError, match=path.name):
                shards.images(number)
        path.write_bytes(whole)
    assert list(faults(copy / "index.json")) == []


def test_a_shard_whose_samples_and_end_are_whole_is_named_by_its_checksum(images):
    """So an exchanged checksum is not passed over; where the length differs, the length is named instead."""
    path = sorted(images.glob("*.tar"))[0]
    samples, size = map_samples(path.with_suffix(".npz")), path.stat().st_size
    assert list(verify._locate(path, samples, size)) == ["SHA-256 differs"]
    assert list(verify._locate(path, samples, size - 1)) == [f"{size} bytes, expected {size - 1}"]


def test_a_shard_cut_after_its_last_sample_is_named_by_its_length_and_its_end(copy):
    """An archive ends with two empty blocks of 512 bytes; zeros of fewer are no end."""
    path = copy / "seen-train-00000.tar"
    whole, rows = path.read_bytes(), map_samples(path.with_suffix(".npz"))
    end = int((rows["offset"] + rows["size"]).max())
    for kept, told in (
        (0, ["the end of the archive is damaged"]),
        (1023, ["the end of the archive is damaged"]),
        (1024, []),
    ):
        path.write_bytes(whole[: end + kept])
        length = f"{end + kept} bytes, expected {len(whole)}"
        assert list(faults(copy / "index.json")) == [f"{path.name}: {line}" for line in (length, *told)]


def test_damage_next_to_the_shards_is_not_read_over(copy):
    """A flipped label in a table, or a changed floor in the index, is refused as well."""
    table = copy / "seen-train-00000.npz"
    data = bytearray(table.read_bytes())
    data[data.index(b"crow-") + 96] ^= 1
    table.write_bytes(data)
    assert list(faults(copy / "index.json")) == ["seen-train-00000.npz: the table is damaged (SHA-256 differs)"]
    with pytest.raises(InputError, match=r"seen-train-00000\.npz"):
        print(ShardSet(copy / "index.json").labels)
    text = (copy / "index.json").read_text()
    (copy / "index.json").write_text(text.replace('"floor_db": 40.0', '"floor_db": 41.0'))
    with pytest.raises(InputError, match=r"index\.json"):
        ShardSet(copy / "index.json")


def test_missing_and_exchanged_files_are_faults(copy):
    shutil.copy(copy / "seen-val-00000.tar", copy / "seen-test-00000.tar")
    (copy / "unseen-val-00000.tar").unlink()
    (copy / "seen-train-00000.npz").write_bytes(b"nothing")
    lines = list(faults(copy / "index.json"))
    assert any(line.startswith("seen-test-00000.tar: sample") for line in lines)
    assert "unseen-val-00000.tar: missing" in lines
    assert any(line.startswith("seen-train-00000.npz") for line in lines)
