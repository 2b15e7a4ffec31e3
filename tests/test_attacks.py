"""Inputs that attack: damaged files of every kind, and some that would run code, fill the memory or
leave a folder.
"""

import io
import itertools
import os
import pickle
import struct
import zipfile
import zlib

import numpy as np
import pytest
import torch

import fuzzed_readers
import fuzzing
from fuzzed_seals import ARCHIVE, PNG
from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml
from lowalt.recognition import checkpoint
from lowalt.shards import index
from lowalt.targets.cloud import read as read_cloud
from lowalt.tiles.png import SIGNATURE, _chunk, decode
from made_indexes import index_of

READERS = {reader.name: reader for reader in fuzzed_readers.readers()}


@pytest.mark.parametrize("name", READERS)
def test_a_good_file_is_accepted_and_damaged_ones_are_accepted_or_refused_by_name(name, tmp_path):
    reader = READERS[name]
    found = fuzzing.attack(reader, 8 if reader.share == 1 else 1, 3, tmp_path)
    assert not found["faults"], found["first_fault"]


def test_the_fuzzer_sees_an_exception_and_changes_what_it_is_given(tmp_path):
    def careless(path):
        return path.read_text().index("z")

    reader = fuzzing.Reader("careless", "a.txt", b"a\xffz" * 9, careless)
    found = fuzzing.attack(reader, 20, 1, tmp_path)
    assert found["faults"] == 1 and "the good file: UnicodeDecodeError" in found["first_fault"]
    reader.read = lambda path: path.read_bytes() == reader.data or careless(path)
    found = fuzzing.attack(reader, 20, 1, tmp_path)
    assert found["faults"] == 20 and "UnicodeDecodeError" in found["first_fault"]
    changed = {
        fuzzing.mutated(b"0123456789" * 9, np.random.default_rng(seed)) for seed in range(50)
    }
    assert len(changed) > 45 and b"0123456789" * 9 not in changed


@pytest.mark.parametrize(
    "name", [name for name, reader in READERS.items() if reader.seal in (ARCHIVE, PNG)]
)
def test_sealed_damage_is_in_one_part_under_checksums_that_are_right(name):
    reader = READERS[name]
    good = reader.seal.opened(reader.data)
    for seed in range(3):
        parts = reader.seal.opened(reader.damaged(np.random.default_rng(seed), sealed=True))
        changed = [part for part in parts if parts[part] != good[part]]
        assert parts.keys() <= good.keys() and len(set(changed)) <= 1


def yaml_of(folder, text):
    (folder / "a.yaml").write_bytes(text)
    return folder / "a.yaml"


NAMES = b"abcdefghij"
BILLIONS = b"a: &a [1]\n" + b"".join(
    b"%c: &%c [%s]\n" % (later, later, b",".join([b"*%c" % former] * 9))
    for former, later in itertools.pairwise(NAMES)
)
"""Ten lines, each nine times the one before."""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (b"a: !!python/object/apply:os.system ['touch made']", "not YAML"),
        (BILLIONS, "anchors make more than 1000000 values"),
        (b"a: &a [*a]", "anchors make more than|undefined alias"),
        (b"a: " + b"[" * 5000, "too deeply|not YAML"),
        (b"- " * 1_000_000, "too deeply"),
        (b"a: 2001-99-99", "not YAML"),
        (b"a: " + b"9" * 5000, "not YAML"),
        (b"a: 1\na: 2", "stands twice"),
        (b"\xff\xfea: 1", "in UTF-8 text"),
        (b"? [1]\n: 2", "not YAML"),
    ],
    ids=[
        "code",
        "billions",
        "endless",
        "deep",
        "a million deep",
        "month 99",
        "5000 digits",
        "twice",
        "encoding",
        "list as key",
    ],
)
def test_yaml_that_runs_code_grows_or_is_not_what_it_seems_is_refused(
    text, expected, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=expected) as found:
        load_yaml(yaml_of(tmp_path, text))
    assert "a.yaml" in str(found.value) and not (tmp_path / "made").exists()


def test_a_byte_order_mark_is_no_part_of_the_first_key(tmp_path):
    assert load_yaml(yaml_of(tmp_path, b"\xef\xbb\xbfseed: 1")) == {"seed": 1}


class Runs:
    """Unpickled, it makes a folder."""

    def __reduce__(self):
        return os.mkdir, ("made",)


def test_pickles_in_checkpoints_and_arrays_run_nothing(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    torch.save({"identity": "{}", "digest": "", "state": Runs()}, tmp_path / "a.pt")
    (tmp_path / "b.pt").write_bytes(pickle.dumps(Runs()))
    for name in ("a.pt", "b.pt"):
        with pytest.raises(InputError, match="not a checkpoint"):
            checkpoint.load(tmp_path / name)
    np.savez(tmp_path / "a.npz", points=np.array([Runs()], dtype=object))
    with pytest.raises(InputError, match="not a cloud file"):
        read_cloud(tmp_path / "a.npz")
    assert not (tmp_path / "made").exists()


def test_archives_that_expand_beyond_measure_are_refused_before_they_do(tmp_path):
    with zipfile.ZipFile(tmp_path / "a.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("points.npy", bytes(100 << 20))
    with pytest.raises(InputError, match=r"points.npy says that \d+ bytes expand to 104857600"):
        read_cloud(tmp_path / "a.npz")


def test_an_array_whose_header_promises_ten_gigabytes_is_refused(tmp_path):
    header = np.lib.format.header_data_from_array_1_0(np.zeros(1)) | {"shape": (10 << 27,)}
    raw = io.BytesIO()
    np.lib.format.write_array_header_1_0(raw, header)
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("points.npy", raw.getvalue() + bytes(64))
    with pytest.raises(InputError, match="not a cloud file"):
        read_cloud(tmp_path / "a.npz")


def png(width, height, pixels):
    header = struct.pack(">IIBBBBB", width, height, 8, 3, 0, 0, 0)
    parts = (
        (b"IHDR", header),
        (b"PLTE", bytes(768)),
        (b"IDAT", zlib.compress(pixels)),
        (b"IEND", b""),
    )
    return SIGNATURE + b"".join(_chunk(*part) for part in parts)


@pytest.mark.parametrize("size", [(2**31 - 1, 2**31 - 1), (200_000, 200_000), (0, 5)])
def test_images_whose_header_promises_more_than_their_bytes_can_hold_are_refused(size):
    with pytest.raises(InputError, match=rf"image: {size[0]} x {size[1]} pixels in \d+ bytes"):
        decode(png(*size, bytes(100)))


def test_a_palette_of_too_many_colours_is_refused_and_a_short_one_is_read():
    good = png(3, 2, bytes([0, 1, 2, 3, 0, 4, 5, 6]))
    assert decode(good)[0].tolist() == [[1, 2, 3], [4, 5, 6]]
    wrong = good.replace(_chunk(b"PLTE", bytes(768)), _chunk(b"PLTE", bytes(771)))
    with pytest.raises(InputError, match="palette of 771 bytes"):
        decode(wrong)


def test_an_index_whose_shards_lie_elsewhere_or_are_no_shards_is_refused_though_its_checksum_is_right(
    tmp_path,
):
    assert index.load(index_of(tmp_path))["shards"][0]["path"] == "a.tar"
    for path in ("../a.tar", "/etc/passwd", "b/../../a.tar"):
        with pytest.raises(
            InputError, match=r"index.json: shard '.*' lies outside the index's folder"
        ):
            index.load(index_of(tmp_path, path=path))
    with pytest.raises(InputError, match=r"shards\.0\.samples: value '1', expected type integer"):
        index.load(index_of(tmp_path, samples="1"))
