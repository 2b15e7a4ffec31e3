"""Verification of a whole data set: damage of any kind to any of its files is found, and named by
the file.
"""

import shutil
import subprocess

import numpy as np
import pytest

from dataset import build, publish
from lowalt.files.errors import InputError
from lowalt.recognition.freeze import freeze
from lowalt.shards import ShardSet, faults
from lowalt.shards.sample_table import map_samples
from lowalt.shards.verify import frozen


@pytest.fixture(scope="module")
def published(tmp_path_factory):
    folder = tmp_path_factory.mktemp("verify")
    (folder / "made").mkdir()
    return publish(build(folder / "made", "signal"), folder / "published")


@pytest.fixture
def copy(published, tmp_path):
    return shutil.copytree(published, tmp_path / "copy")


def names(published):
    return sorted(path.name for path in published.iterdir())


def lines(folder):
    """The faults that `verify` finds; an index that cannot be read is one."""
    try:
        return list(faults(folder / "index.json"))
    except InputError as error:
        return [str(error)]


def test_an_undamaged_data_set_has_no_fault(published):
    assert len(names(published)) == 2 * 6 + 5
    assert lines(published) == []


def test_sha256sum_agrees_and_reads_every_file(published):
    listed = (published / "SHA256SUMS").read_text().split()[1::2]
    assert sorted([*listed, "SHA256SUMS"]) == names(published)
    subprocess.run(
        ["sha256sum", "--check", "--strict", "--quiet", "SHA256SUMS"], cwd=published, check=True
    )


def test_a_flipped_bit_anywhere_in_any_file_is_found(copy):
    rng = np.random.default_rng(5)
    for name in names(copy):
        path = copy / name
        whole = path.read_bytes()
        # The first and last byte, and bytes drawn at random; white space of the JSON files is among
        # them.
        for place in [0, len(whole) - 1, *rng.integers(len(whole), size=10).tolist()]:
            damaged = bytearray(whole)
            damaged[place] ^= 1 << int(rng.integers(8))
            path.write_bytes(damaged)
            found = lines(copy)
            assert any(name in line for line in found), (name, place, found)
        path.write_bytes(whole)
    assert lines(copy) == []


@pytest.mark.parametrize("harm", ["truncated", "emptied", "extended", "missing"])
def test_a_file_of_another_length_is_found(copy, harm):
    for name in names(copy):
        path = copy / name
        whole = path.read_bytes()
        if harm == "missing":
            path.unlink()
        else:
            path.write_bytes(
                {"truncated": whole[:-1], "emptied": b"", "extended": whole + b"\0"}[harm]
            )
        assert any(name in line for line in lines(copy)), name
        path.write_bytes(whole)
    assert lines(copy) == []


def test_files_that_do_not_belong_are_named(copy):
    (copy / "seen-train-00001.tar").write_bytes((copy / "seen-train-00000.tar").read_bytes())
    (copy / "notes").mkdir()
    (copy / "notes/mine.txt").write_text("mine")
    assert lines(copy) == [
        "notes/mine.txt: no part of the data set",
        "seen-train-00001.tar: no part of the data set",
    ]


def test_a_checksum_line_more_or_less_or_for_another_file_is_found(copy):
    sums = copy / "SHA256SUMS"
    text = sums.read_text()
    first, *rest = text.splitlines(keepends=True)
    for changed, words in [
        ("".join(rest), "SHA256SUMS: no line for README.md"),
        (
            text + f"{'0' * 64}  zebra.txt\n",
            "SHA256SUMS: a line for zebra.txt, which is no part of the data set",
        ),
        ("".join([*rest, first]), "SHA256SUMS: damaged"),
        (text + first, "SHA256SUMS: damaged"),
    ]:
        sums.write_text(changed)
        assert any(line.startswith(words) for line in lines(copy)), words


def test_clouds_and_motion_tables_of_the_run_are_held_to_the_checksums_that_froze_them(copy):
    run = copy.parent
    names = ("clouds/a.npz", "clouds/b.npz", "motion/seen-00000.csv")
    for name in names:
        (run / name).parent.mkdir(exist_ok=True)
        (run / name).write_text(name)
    assert lines(copy) == [] and frozen(copy / "index.json") == {}
    freeze([run / name for name in names], run / "SHA256SUMS")
    with (run / "SHA256SUMS").open("a") as file:
        file.write(f"{'0' * 64}  elsewhere.tar\n{'0' * 64}  clouds/../../secret\n")
    (run.parent / "secret").write_text("not read")
    assert (
        lines(copy) == ["../clouds/../../secret: missing"] and len(frozen(copy / "index.json")) == 4
    )
    (run / names[0]).write_text("other")
    (run / names[2]).unlink()
    assert lines(copy)[:-1] == [
        f"../{names[0]}: has changed since it was frozen in ../SHA256SUMS",
        f"../{names[2]}: missing",
    ]


def test_every_fault_of_a_shard_is_found_and_named(copy, published):
    """Single bytes and cuts at random places: verify names the shard and the sample, reading never
    passes them.
    """
    rng = np.random.default_rng(3)
    paths = sorted(copy.glob("*.tar"))
    for _ in range(40):
        path = paths[rng.integers(len(paths))]
        whole = (published / path.name).read_bytes()
        samples = map_samples(published / path.with_suffix(".npz").name)
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
                shards.signal(number)
        path.write_bytes(whole)
    assert list(faults(copy / "index.json")) == []


def test_a_shard_cut_after_its_last_sample_is_named_by_its_length_and_its_end(copy):
    """An archive ends with two empty blocks of 512 bytes; zeros of fewer are no end."""
    path = copy / "seen-train-00000.tar"
    whole = path.read_bytes()
    rows = map_samples(path.with_suffix(".npz"))
    end = int((rows["offset"] + rows["size"]).max())
    for kept, told in (
        (0, ["the end of the archive is damaged"]),
        (1023, ["the end of the archive is damaged"]),
        (1024, []),
    ):
        path.write_bytes(whole[: end + kept])
        length = f"{end + kept} bytes, expected {len(whole)}"
        assert list(faults(copy / "index.json")) == [
            f"{path.name}: {line}" for line in (length, *told)
        ]
