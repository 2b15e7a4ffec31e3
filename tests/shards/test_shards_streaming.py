"""Readers on several nodes with several workers each give every sample of the shards exactly once."""

import os
from itertools import chain

import pytest

from dataset import build, publish
from lowalt.shards import ShardSet

torch = pytest.importorskip("torch")
NODES = 2
WORKERS = 2


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("streaming")
    return publish(build(made / "shards", "signal"), made / "published")


@pytest.fixture
def hub(tmp_path, monkeypatch):
    """The hub's library, with its cache in a folder of its own and no internet."""
    monkeypatch.setenv("HF_HOME", str(tmp_path))
    monkeypatch.setenv("HF_DATASETS_OFFLINE", "1")
    return pytest.importorskip("datasets")


def loaded(data, **options):
    """Keys that the workers of one node give."""
    return [
        str(key)
        for key in torch.utils.data.DataLoader(
            data, batch_size=None, num_workers=WORKERS, **options
        )
    ]


def keys_of(folder):
    return sorted(key.decode() for key in ShardSet(folder / "index.json").keys)


def test_webdataset_gives_each_sample_once_over_nodes_and_workers(folder, monkeypatch):
    import webdataset

    paths = sorted(map(str, folder.glob("*.tar")))
    found = []
    assert len(paths) >= NODES * WORKERS
    monkeypatch.setenv("WORLD_SIZE", str(NODES))
    for rank in range(NODES):
        monkeypatch.setitem(os.environ, "RANK", str(rank))
        stream = webdataset.WebDataset(
            paths, shardshuffle=100, nodesplitter=webdataset.split_by_node, seed=1
        )
        found.append(loaded(stream.shuffle(1000).map(lambda sample: sample["__key__"])))
    assert all(found) and sorted(chain(*found)) == keys_of(folder)


def test_the_hubs_library_gives_each_sample_once_over_nodes_and_workers(folder, hub):
    from datasets.distributed import split_dataset_by_node

    paths = sorted(map(str, folder.glob("*.tar")))
    whole = hub.load_dataset(
        "webdataset", data_files={"train": paths}, split="train", streaming=True
    )
    found = []
    for rank in range(NODES):
        part = split_dataset_by_node(whole.shuffle(seed=1, buffer_size=1000), rank, NODES)
        found.append(loaded(part.select_columns("__key__"), collate_fn=lambda row: row["__key__"]))
    assert all(found) and sorted(chain(*found)) == keys_of(folder)
