"""How well readers of shards shuffle: labels, subtypes and motion models of their batches, against
a random order.

    python benchmarks/shuffling.py --shards results/RUN/shards/*-train-*.tar --out
    results/benchmarks/shuffling.csv

Reads the same shards with each reader, one worker, and cuts what it gives into batches of 64. The
entropy of a batch is that of its shares of labels or subtypes, in bits; `motion models` is the
number of distinct ones in a batch. `random order` is a permutation of all samples, as random access
through `ShardSet` gives.
"""

import argparse
import json
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import webdataset

from lowalt.files.csv_tables import write_csv
from lowalt.numerics.streams import stream
from lowalt.shards.sample_table import map_samples, table_path

COLUMNS = ("reader", "shards", "samples", "label_bits", "subtype_bits", "motion_models")
BATCH = 64
Facts = tuple[int, str, int]
"""Label, subtype and number of the motion model of a sample."""


def facts(record: dict) -> Facts:
    """What is counted of a sample."""
    return record["label"], record["subtype"], record["model"]


def by_webdataset(paths: list[str], shards: bool, samples: int) -> Iterator[Facts]:
    """Samples in the order of webdataset, with shards and a buffer of samples shuffled or not."""
    data = webdataset.WebDataset(paths, shardshuffle=len(paths) if shards else False, seed=1)
    for sample in data.shuffle(samples) if samples else data:
        yield facts(json.loads(sample["json"]))


def by_hub(paths: list[str], buffer: int) -> Iterator[Facts]:
    """Samples in the order of the hub's library, with shards and a buffer of samples shuffled."""
    import datasets

    data = datasets.load_dataset(
        "webdataset", data_files={"train": paths}, split="train", streaming=True
    )
    yield from (facts(row["json"]) for row in data.shuffle(seed=1, buffer_size=buffer))


def at_random(paths: list[str]) -> Iterator[Facts]:
    """Samples in a random order of all."""
    rows = np.concatenate([map_samples(table_path(path)) for path in paths])
    for row in rows[stream(1, "shuffling").permutation(len(rows))]:
        yield int(row["label"]), row["key"].decode().rsplit("-", 2)[0], int(row["model"])


def bits(values: list) -> float:
    """Entropy of the shares of values in a batch, in bits."""
    shares = np.unique(values, return_counts=True)[1] / len(values)
    return float(-(shares * np.log2(shares)).sum())


def figures(found: list[Facts]) -> tuple[float, float, float]:
    """Mean over batches: entropies of labels and subtypes, and distinct motion models."""
    batches = [found[first : first + BATCH] for first in range(0, len(found) - BATCH + 1, BATCH)]
    each = [
        (
            bits([label for label, _, _ in batch]),
            bits([name for _, name, _ in batch]),
            len({(name, model) for _, name, model in batch}),
        )
        for batch in batches
    ]
    label, subtype, models = np.mean(each, axis=0).tolist()
    return label, subtype, models


def main() -> None:
    """Read the shards with each reader and write the table."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument(
        "--shards", nargs="+", required=True, help="tars of a data set, next to their tables"
    )
    options.add_argument("--out", type=Path, required=True)
    given = options.parse_args()
    readers = {
        "random order": at_random(given.shards),
        "webdataset, as stored": by_webdataset(given.shards, False, 0),
        "webdataset, shards shuffled": by_webdataset(given.shards, True, 0),
        "webdataset, shards shuffled, buffer of 1000": by_webdataset(given.shards, True, 1000),
        "webdataset, shards shuffled, buffer of 10000": by_webdataset(given.shards, True, 10000),
        "datasets, buffer of 1000": by_hub(given.shards, 1000),
    }
    rows = []
    for name, reader in readers.items():
        found = list(reader)
        rows.append(
            (name, len(given.shards), len(found), *(f"{value:.4g}" for value in figures(found)))
        )
        print(*rows[-1], sep="  ")
    write_csv(given.out, COLUMNS, rows)


if __name__ == "__main__":
    main()
