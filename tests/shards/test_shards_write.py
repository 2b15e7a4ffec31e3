"""What the parts of a data set are held to: one group a shard, a sample once, tables and shards of
one length.
"""

import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from dataset import RENDER, motion_rows, pack
from lowalt.files.errors import InputError
from lowalt.shards import ShardSet
from lowalt.shards.hub import configs, patterns
from lowalt.shards.index import build
from lowalt.shards.sample_table import map_samples, read_header
from lowalt.shards.sample_table import write as write_table


@pytest.fixture
def folder(tmp_path):
    """Two shards of four samples each, and their index."""
    rows = motion_rows("seen")
    shards = [
        pack(tmp_path / "seen-train-0.tar", rows[:4]),
        pack(tmp_path / "seen-val-0.tar", rows[4:], "val"),
    ]
    build(shards, RENDER, tmp_path / "index.json")
    return tmp_path


def test_a_chunk_of_two_groups_is_no_shard(tmp_path):
    rows = [motion_rows("seen")[0], motion_rows("unseen")[0]]
    with pytest.raises(
        InputError, match=r"x\.tar: .*groups \['seen', 'unseen'\], expected exactly one"
    ):
        pack(tmp_path / "x.tar", rows)
    with pytest.raises(InputError, match=r"groups \[\], expected exactly one"):
        pack(tmp_path / "x.tar", [])
    assert not list(tmp_path.iterdir())


def test_a_sample_that_stands_twice_is_named_and_nothing_is_kept(tmp_path):
    """Two names of subtypes that make one key are one sample to a reader."""
    drone, crow = motion_rows("seen")[:2]
    for twice in (crow, crow | {"subtype": "crow"}):
        with pytest.raises(InputError, match=r"x\.tar: sample 'crow-000000-snr003' stands twice"):
            pack(tmp_path / "x.tar", [drone, crow, twice])
        assert not list(tmp_path.iterdir())


def test_an_index_refuses_a_shard_of_another_length_than_its_table_says(folder):
    path = folder / "seen-val-0.tar"
    size = path.stat().st_size
    for change in (1, -1):
        path.write_bytes((path.read_bytes() + b"\0")[: size + change])
        with pytest.raises(
            InputError, match=rf"seen-val-0\.tar: {size + change} bytes, its table says {size}"
        ):
            build([path], RENDER, folder / "other.json")
    assert not (folder / "other.json").exists()


def test_an_index_has_the_same_bytes_in_whatever_order_settings_and_shards_come(folder):
    paths = [folder / "seen-val-0.tar", folder / "seen-train-0.tar"]
    before = (folder / "index.json").read_bytes()
    turned = {name: dict(reversed(block.items())) for name, block in reversed(RENDER.items())}
    build(paths, turned, folder / "index.json")
    assert (folder / "index.json").read_bytes() == before


def test_an_index_refuses_a_name_that_stands_twice(folder):
    (folder / "more").mkdir()
    again = [shutil.copy(folder / f"seen-val-0{end}", folder / "more") for end in (".tar", ".npz")]
    with pytest.raises(InputError, match=r"2 shards of kinds \['signal'\], expected names once"):
        build([folder / "seen-val-0.tar", again[0]], RENDER, folder / "other.json")


@pytest.mark.parametrize("count", [3, 5])
def test_a_table_of_another_length_than_the_index_says_is_refused_without_checksums_too(
    folder, count
):
    path = folder / "seen-val-0.npz"
    rows = map_samples(path)[[0, 1, 2, 3, 3][:count]]
    write_table(path, read_header(path), rows)
    for check in (True, False):
        shards = ShardSet(folder / "index.json", check=check)
        assert len(shards) == 8 and shards.signal(3).shape == (3, 400)
        with pytest.raises(InputError, match=rf"seen-val-0\.npz: .*{count} rows, expected 4"):
            shards.signal(4)


def test_a_sample_that_a_cut_shard_ends_in_is_refused_without_checksums_too(folder):
    path = folder / "seen-val-0.tar"
    rows = map_samples(path.with_suffix(".npz"))
    whole = ShardSet(folder / "index.json").signal(7)
    last = rows[3]
    end = int(last["data_offset"] + last["data_size"])
    data = path.read_bytes()
    path.write_bytes(data[:end])
    # All bytes of the signal are there, but not those that fill up its block: only a check reads
    # them.
    np.testing.assert_array_equal(ShardSet(folder / "index.json", check=False).signal(7), whole)
    path.write_bytes(data[: end - 1])
    for check in (True, False):
        shards = ShardSet(folder / "index.json", check=check)
        assert shards.signal(6).shape == (3, 400)
        with pytest.raises(
            InputError, match=rf"seen-val-0\.tar: sample {last['key'].decode()} is damaged"
        ):
            shards.signal(7)


def entries(*paths):
    """What a card takes of shards whose group and fold are the first two words of their names' last
    parts.
    """
    words = [path.rpartition("/")[2].split("-") for path in paths]
    return SimpleNamespace(
        shards=[
            {"path": path, "group": group, "fold": fold}
            for path, (group, fold, *_) in zip(paths, words, strict=True)
        ]
    )


def test_a_hub_gets_a_pattern_where_it_matches_a_fold_s_shards_and_their_paths_elsewhere():
    usual = entries("seen-train-00000.tar", "seen-train-00001.tar", "seen-val-00000.tar")
    assert patterns(usual, "seen", "train") == ["seen-train-*.tar"]
    # In a hub's pattern a star stands for no slash.
    below = entries("a/seen-train-0.tar", "seen-train-1.tar")
    assert patterns(below, "seen", "train") == ["a/seen-train-0.tar", "seen-train-1.tar"]
    inside = entries("seen-train-x/seen-train-0.tar")
    assert patterns(inside, "seen", "train") == ["seen-train-x/seen-train-0.tar"]
    # A shard of another fold whose name begins like theirs.
    other = entries("seen-train-0.tar", "seen-train-1.tar")
    other.shards[1]["fold"] = "val"
    assert patterns(other, "seen", "train") == ["seen-train-0.tar"]
    assert patterns(other, "seen", "val") == ["seen-train-1.tar"]


def test_a_data_set_without_unseen_subtypes_has_no_protocol_for_them():
    (only,) = configs(entries("seen-train-0.tar", "seen-test-0.tar"))
    assert only["config_name"] == "seen" and only["default"] is True
    assert [part["split"] for part in only["data_files"]] == ["train", "test"]
    both = configs(entries("seen-train-0.tar", "seen-test-0.tar", "unseen-val-0.tar"))
    assert [config["config_name"] for config in both] == ["seen", "unseen"]
    assert both[1]["data_files"] == [
        {"split": "train", "path": ["seen-train-*.tar"]},
        {"split": "test", "path": ["unseen-val-*.tar"]},
    ]
