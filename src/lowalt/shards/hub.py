"""The metadata block at the head of a data card, as dataset hubs read it: licence, protocols and
their shards.
"""

import json
from collections.abc import Iterator
from fnmatch import fnmatchcase
from pathlib import Path

import numpy as np

from lowalt.config.splits import FOLDS
from lowalt.files.atomic import existing
from lowalt.files.errors import reading
from lowalt.shards.read import ShardSet
from lowalt.shards.record_types import Type, column, joined, type_of
from lowalt.shards.sample_table import EXTENSIONS
from lowalt.shards.stored_cubes import cell_type_of

TAGS = ["radar", "integrated-sensing-and-communication", "micro-doppler", "webdataset", "synthetic"]


def patterns(shards: ShardSet, group: str, fold: str) -> list[str]:
    """Return one glob pattern that matches exactly the shards of a group and fold, or else their
    paths.
    """
    names = [
        entry["path"] for entry in shards.shards if (entry["group"], entry["fold"]) == (group, fold)
    ]
    usual = f"{group}-{fold}-*.tar"
    # The hub's `*` does not match `/`; fnmatchcase's does.
    paths = [entry["path"] for entry in shards.shards if "/" not in entry["path"]]
    matched = [path for path in paths if fnmatchcase(path, usual)]
    return [usual] if matched == names else names


def configs(shards: ShardSet) -> list[dict]:
    """Return the protocols as a hub's configurations: for each its splits and the shards of each
    split.

    Patterns match shards by group and fold in their names, so the list is short even for thousands
    of shards.
    """
    present = {(entry["group"], entry["fold"]) for entry in shards.shards}
    hub = {"train": "train", "val": "validation", "test": "test"}
    result: list[dict] = []
    for protocol in ("seen", "unseen"):
        files: dict[str, list[str]] = {}
        for group, fold in sorted(present, key=lambda pair: (pair[0], FOLDS.index(pair[1]))):
            # In the unseen protocol all folds of the unseen group are test data, and the seen group
            # has none.
            both = protocol == "seen" or group == "seen"
            if protocol == "unseen" and group == "seen" and fold == "test":
                continue
            files.setdefault(hub[fold] if both else "test", []).extend(
                patterns(shards, group, fold)
            )
        if protocol == "unseen" and not any(group == "unseen" for group, _ in present):
            continue
        splits = [
            {"split": split, "path": files[split]} for split in hub.values() if split in files
        ]
        result.append({"config_name": protocol, "data_files": splits})
    if result:
        result[0]["default"] = True
    return result


def records(shards: ShardSet) -> Iterator[dict]:
    """Yield every stored record once, shard by shard; the samples of a motion model in a recipe
    shard share one.

    Only the records are read. Raises: InputError naming the shard where one is damaged.
    """
    for entry, table in shards.tables():
        path = existing(Path(shards.index_path).parent / entry["path"], "shard")
        offsets, places = np.unique(table["record_offset"], return_index=True)
        with path.open("rb") as file:
            for offset, size in zip(offsets, table["record_size"][places], strict=True):
                file.seek(int(offset))
                with reading(path, "shard"):
                    record = json.loads(file.read(int(size)))
                yield record


def features(shards: ShardSet) -> list[dict]:
    """Return the columns of the data set as the hub's library `datasets` types them, the label's
    with its classes.

    Raises: InputError where a field has unlike types in the records.
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
    data: dict = {"dtype": "image"}
    if shards.kind != "image":
        # One nested list per axis of the array.
        axes = {
            "list": {"list": {"list": "int16" if cell_type_of(first) == "int16" else "float32"}}
        }
        data = {"list": axes} if shards.kind == "cube" else axes
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
