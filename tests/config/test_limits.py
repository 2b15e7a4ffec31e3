"""Integers and offsets at 1.44 million and 100 million samples: shown on sparse files, whose holes
take no space.
"""

import json
import tarfile
import zipfile

import numpy as np
import pytest

from configured import ROOT, SCHEMA
from dataset import build
from lowalt.config.layers import load, merge
from lowalt.files.yaml_files import load_yaml
from lowalt.numerics.streams import digest
from lowalt.shards import ShardSet, index
from lowalt.shards import write as shard_module
from lowalt.shards.dataset import Dataset
from lowalt.shards.plan import Plan
from lowalt.shards.sample_record import sample_key
from lowalt.shards.sample_table import SAMPLE, map_samples, table_path
from lowalt.shards.tar import Writer
from lowalt.targets.records import records_of
from lowalt.tiles.tile_files import Tiles, map_array, npy_header

HOLE = 5 * 2**30
"""Bytes of zeros in front of what a test reads: more than 32 bits count, and whole blocks of a tar.
"""
MANY = 100_000_000


class Late(Writer):
    """A writer of shards whose first member is a hole, so that all samples stand behind 5 GiB."""

    def __init__(self, file):
        super().__init__(file)
        info = tarfile.TarInfo("hole")
        info.size = HOLE
        self._put(info.tobuf(tarfile.USTAR_FORMAT))
        file.seek(HOLE, 1)
        self.size += HOLE


@pytest.mark.parametrize("kind", ["signal", "recipe"])
def test_a_shard_beyond_4_gib_is_written_indexed_and_read(kind, tmp_path, monkeypatch):
    plain = ShardSet(build(tmp_path / "plain", kind) / "index.json")
    monkeypatch.setattr(shard_module, "Writer", Late)
    late = ShardSet(build(tmp_path / "late", kind) / "index.json")
    assert late.index["bytes"] > 6 * HOLE and len(late) == len(plain) == 24
    for number in range(len(plain)):
        assert late.members(number) == plain.members(number)
    for shard in late.shards:
        path = tmp_path / "late" / shard["path"]
        far = map_samples(table_path(path))
        near = map_samples(table_path(tmp_path / "plain" / shard["path"]))
        for name in ("offset", "record_offset", "data_offset"):
            assert (far[name] - near[name] == HOLE + tarfile.BLOCKSIZE).all()
        with tarfile.open(path) as archive:
            names = archive.getnames()
            assert names[0] == "hole" and len(names) > 1
            row = far[-1]
            offset = {member.name: member.offset_data for member in archive}
            assert {row["record_offset"], row["data_offset"]} <= set(offset.values())


def sparse_array(path, name, dtype, count, *more):
    """An .npz whose one-dimensional array `name` is a hole of `count` items, with the arrays `more`
    behind it.

    Returns where the hole begins.
    """
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        with archive.open(zipfile.ZipInfo(name), "w", force_zip64=True) as member:
            member.write(npy_header(dtype, (count,)))
            first = archive.fp.tell()
            # A member's size is counted as it is written; a hole is counted by hand.
            member._fileobj.seek(count * np.dtype(dtype).itemsize, 1)
            member._file_size += count * np.dtype(dtype).itemsize
        for other, values in more:
            archive.writestr(
                zipfile.ZipInfo(other),
                npy_header(values.dtype.str, values.shape) + values.tobytes(),
            )
    return first


def test_the_last_of_100_million_samples_is_found(tmp_path, monkeypatch):
    """One shard of 99 999 977 samples and five others; its table has 20 GB, all but the last row a
    hole.
    """
    monkeypatch.setattr(shard_module, "Writer", Late)
    folder = build(tmp_path, "signal")
    found = json.loads((folder / "index.json").read_text())
    last = found["shards"][-1]
    table = table_path(folder / last["path"])
    row = np.array(map_samples(table)[-1:])
    count = MANY - 24 + last["samples"]
    with np.load(table) as data:
        header = data["header"]
    # The type of the rows has several columns, which the short header of an array cannot state.
    first = sparse_array(
        table, "samples.npy", "|V1", count * SAMPLE.itemsize, ("header.npy", header.reshape(1))
    )
    with table.open("r+b") as file:
        file.seek(first + (count - 1) * SAMPLE.itemsize)
        file.write(row.tobytes())
    last["samples"] = count
    found["samples"] = MANY
    found["sha256"] = index._checksum(found)
    (folder / "index.json").write_text(json.dumps(found))
    monkeypatch.setattr(
        "lowalt.shards.read.map_samples",
        lambda path: _rows(path) if path == table else map_samples(path),
    )
    shards = ShardSet(folder / "index.json", check=False)
    assert len(shards) == MANY
    for number in (MANY - 1, np.int64(MANY - 1), np.uint32(MANY - 1)):
        assert shards.record(number)["key"] == row["key"][0].decode()
    assert shards.signal(MANY - 1).shape == (3, 400)
    with pytest.raises(IndexError, match="expected 0 to 99999999"):
        shards.record(MANY)


def _rows(path):
    """The rows of a table that a sparse array of bytes holds."""
    return map_array(path, "samples.npy").view(SAMPLE)


def test_a_tiles_file_beyond_4_gib_is_read_image_by_image(tmp_path):
    images = [b"first image", b"the second one"]
    ends = np.cumsum([HOLE, *map(len, images)]).astype("<i8")
    first = sparse_array(
        tmp_path / "a.npz", "data.npy", "|u1", int(ends[-1]), ("offsets.npy", ends)
    )
    with (tmp_path / "a.npz").open("r+b") as file:
        file.seek(first + HOLE)
        file.write(b"".join(images))
    tiles = Tiles(tmp_path / "a.npz")
    assert [tiles[number] for number in range(len(tiles))] == images
    assert (map_array(tmp_path / "a.npz", "data.npy")[HOLE : HOLE + 11] == list(images[0])).all()


def config_of(models, per_chunk):
    """The default's configuration with other numbers of motion models, and shards as large as their
    folds.
    """
    motion = {"models": models, "models_per_chunk": per_chunk}
    shards = {"largest_mb": 30_000}
    return merge(load_yaml(ROOT / "config/default.yaml"), {"motion": motion, "shards": shards})


@pytest.fixture(scope="module")
def published():
    config = load_yaml(ROOT / "config/default.yaml")
    return {name: item["published"] for name, item in records_of(config["targets"]).items()}


@pytest.mark.parametrize(
    ("models", "per_chunk", "samples", "chunks", "shards"),
    [(6000, 50, 1_440_000, 240, 720), (416_670, 1000, 100_000_800, 834, 2502)],
)
def test_the_plan_names_each_shard_once_and_one_command_takes_them_all(
    published, models, per_chunk, samples, chunks, shards
):
    plan = Plan.of(config_of(models, per_chunk), published)
    held = [plan.chunk(name) for name in plan.chunks]
    assert sum(chunk.count * len(chunk.members) * len(chunk.snrs) for chunk in held) == samples
    assert (len(plan.chunks), len(plan.shards), len(set(plan.shards))) == (chunks, shards, shards)
    # The command of the index names every shard; Linux takes 2 MiB of arguments, with a pointer to
    # each.
    words = [f"results/default/shards/{name}.tar" for name in plan.shards]
    assert sum(len(word) + 1 + 8 for word in words) < 2**20
    if samples == 1_440_000:
        paper = load(["config/default.yaml", "config/paper.yaml"], SCHEMA)
        assert (paper["motion"]["models"], paper["motion"]["models_per_chunk"]) == (
            models,
            per_chunk,
        )


def test_at_the_schemas_most_motion_models_keys_and_parts_keep_their_digits(published):
    """Keys sort by model with six digits, chunks by part with five."""
    motion = load_yaml(SCHEMA)["properties"]["motion"]["properties"]
    most = motion["models"]["maximum"]
    plan = Plan.of(config_of(most, 10), published)
    last = plan.chunk(plan.chunks[-1])
    assert (last.name, last.first, last.count) == ("unseen-99999", most - 10, 10)
    assert {len(name.partition("-")[2]) for name in plan.chunks} == {5}
    keys = [
        sample_key(name, most - 1, snr) for name in published for snr in (-60.0, 3.5, float("inf"))
    ]
    assert all("-999999-snr" in key for key in keys)
    assert max(len(f"{key}.json".encode()) for key in keys) <= 100
    assert max(map(len, keys)) <= SAMPLE["key"].itemsize


def test_sample_numbers_of_any_integer_type_name_the_same_sample(published):
    data = Dataset(config_of(416_670, 1000), clouds={}, published=published)
    assert len(data) == 100_000_800
    for number in (0, 2**24 + 1, MANY - 1, len(data) - 1):
        places = {data.place(kind(number)) for kind in (int, np.int64, np.uint64, np.int32)}
        assert len(places) == 1 and isinstance(next(iter(places)).model, int)
    assert data.place(np.int64(len(data) - 1)).model == 416_669
    assert data.place(np.int64(MANY)) != data.place(np.int64(MANY - 1))
    with pytest.raises(IndexError):
        data.place(np.int64(len(data)))
    # Random streams keep every bit of a motion model's number beyond 32 bits.
    model = 416_670 + MANY // 40 + 2**33
    assert digest(1, "motion", "Crow", np.int64(model)) == digest(1, "motion", "Crow", model)
    assert digest(1, "motion", "Crow", model) != digest(1, "motion", "Crow", model % 2**32)
