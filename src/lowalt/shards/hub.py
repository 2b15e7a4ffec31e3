"""The metadata block at the head of a data card: licence, protocols and shards, as hubs read it.

Cards of models share its tags and its tables.
"""

import json
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from lowalt.config.splits import FOLDS
from lowalt.files.atomic import existing
from lowalt.files.errors import reading
from lowalt.shards.read import ShardSet
from lowalt.shards.record_types import Type, column, joined, type_of
from lowalt.shards.sample_table import EXTENSIONS
from lowalt.shards.stored_cubes import cell_type_of

TAGS = ["radar", "integrated-sensing-and-communication", "micro-doppler", "webdataset", "synthetic"]


def markdown_table(header: tuple[str, ...], rows: list[tuple]) -> str:
    """Return a Markdown table."""
    text = ""
    for line in (header, ("---",) * len(header), *rows):
        text += "| " + " | ".join(map(str, line)) + " |\n"
    return text


def patterns(shards: ShardSet, group: str, fold: str) -> list[str]:
    """Return the glob pattern that matches just the shards of a group and fold, or their paths."""
    names = []
    for entry in shards.shards:
        if entry["group"] == group and entry["fold"] == fold:
            names.append(entry["path"])
    usual = f"{group}-{fold}-*.tar"
    # The hub's `*` does not match `/`; fnmatchcase's does.
    paths = [entry["path"] for entry in shards.shards if "/" not in entry["path"]]
    matched = [path for path in paths if fnmatchcase(path, usual)]
    if matched == names:
        return [usual]
    return names


def configs(shards: ShardSet) -> list[dict]:
    """Return the protocols as a hub's configurations: the splits of each, and their shards.

    Patterns match shards by group and fold in their names, so the list is short even for thousands
    of shards.
    """
    present = {(entry["group"], entry["fold"]) for entry in shards.shards}
    split_of_fold = {"train": "train", "val": "validation", "test": "test"}
    result: list[dict] = []
    for protocol in ("seen", "unseen"):
        files: dict[str, list[str]] = {}
        for group, fold in sorted(present, key=lambda pair: (pair[0], FOLDS.index(pair[1]))):
            # In the unseen protocol all folds of the unseen group are test data, and the seen group
            # has none.
            split = split_of_fold[fold]
            if protocol == "unseen" and group == "seen" and fold == "test":
                continue
            if protocol == "unseen" and group == "unseen":
                split = "test"
            files.setdefault(split, []).extend(patterns(shards, group, fold))
        if protocol == "unseen" and not any(group == "unseen" for group, _ in present):
            continue
        splits = []
        for split in split_of_fold.values():
            if split in files:
                splits.append({"split": split, "path": files[split]})
        result.append({"config_name": protocol, "data_files": splits})
    if result:
        result[0]["default"] = True
    return result


def records(shards: ShardSet) -> Iterator[dict]:
    """Yield every stored record once, shard by shard, reading nothing but the records.

    In a recipe shard, the samples of a motion model share a record. Raises: InputError naming the
    shard where one is damaged.
    """
    for entry, table in shards.tables():
        path = existing(Path(shards.index_path).parent / entry["path"], "shard")
        offsets, rows = np.unique(table["record_offset"], return_index=True)
        with path.open("rb") as file:
            for offset, size in zip(offsets, table["record_size"][rows], strict=True):
                file.seek(int(offset))
                with reading(path, "shard"):
                    record = json.loads(file.read(int(size)))
                yield record


def features(shards: ShardSet) -> list[dict]:
    """Return the columns of the data set as the hub's library `datasets` types them.

    The label's column has its classes. Raises: InputError where a field has unlike types in the
    records.
    """
    kinds: Type = None
    first = None
    for entry in records(shards):
        first = first or entry
        kinds = joined(kinds, type_of(entry, "record"), "record")
    if first is None:
        return []
    record = column("json", kinds)
    classes = {str(number): name for number, name in enumerate(shards.classes)}
    for field in record["struct"]:
        if field["name"] == "label":
            field["dtype"] = {"class_label": {"names": classes}}
    data: Any = {"dtype": "image"}
    if shards.kind != "image":
        data = "int16" if cell_type_of(first) == "int16" else "float32"
        # The type of an array is one nested list per axis; a cube has an axis of range cells too.
        for _ in range(4 if shards.kind == "cube" else 3):
            data = {"list": data}
    return [
        column("__key__", "string"),
        column("__url__", "string"),
        record,
        {"name": EXTENSIONS[shards.kind], **data},
    ]


def front(shards: ShardSet, name: str, license_name: str) -> dict:
    """Return the metadata block at the head of the data card, as dataset hubs read it."""
    protocols = configs(shards)
    columns = features(shards)
    return {
        "pretty_name": name,
        "license": license_name.lower(),
        "language": ["en"],
        "task_categories": ["image-classification"],
        "configs": protocols,
        "dataset_info": [
            {"config_name": block["config_name"], "features": columns} for block in protocols
        ],
        "tags": TAGS,
    }
