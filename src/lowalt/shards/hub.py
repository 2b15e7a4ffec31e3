"""The metadata block at the head of a data card, as dataset hubs read it: licence, protocols and
their shards.
"""

import json
from fnmatch import fnmatchcase

from lowalt.config.splits import FOLDS
from lowalt.shards.read import ShardSet
from lowalt.shards.sample_table import EXTENSIONS
from lowalt.shards.stored_cubes import cell_type_of
from lowalt.spectra.cube import TRUTH

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


DTYPES = {bool: "bool", int: "int64", float: "float64", str: "string", type(None): "float64"}
"""The hub's type names for values of a record; an unknown number is null."""


def features(shards: ShardSet) -> list[dict]:
    """Return the columns of the data set as the hub's library `datasets` types them, the label's
    with its classes.
    """
    if not len(shards):
        return []
    names = {
        "class_label": {"names": {str(number): name for number, name in enumerate(shards.classes)}}
    }

    def typed(name: str, value: object) -> dict:
        """The type of one value of a record."""
        if name == "label":
            return {"name": name, "dtype": names}
        if isinstance(value, dict):
            return {"name": name, "struct": [typed(*item) for item in value.items()]}
        if name == "others":
            # The first sample may have no companion, so its list may be empty.
            return {"name": name, "list": [{"name": column, "list": "float64"} for column in TRUTH]}
        if isinstance(value, list):
            return {"name": name, "list": DTYPES[type(value[0])] if value else "string"}
        return {"name": name, "dtype": DTYPES[type(value)]}

    entry = json.loads(shards.stored(0, "record"))
    data: dict = {"dtype": "image"}
    if shards.kind != "image":
        # One nested list per axis of the array.
        axes = {
            "list": {"list": {"list": "int16" if cell_type_of(entry) == "int16" else "float32"}}
        }
        data = {"list": axes} if shards.kind == "cube" else axes
    return [
        typed("__key__", ""),
        typed("__url__", ""),
        typed("json", entry),
        {"name": EXTENSIONS[shards.kind], **data},
    ]


def front(shards: ShardSet, name: str, license_name: str) -> dict:
    """Return the metadata block at the head of the data card, as dataset hubs read it."""
    protocols = configs(shards)
    return {
        "pretty_name": name,
        "license": license_name.lower(),
        "language": ["en"],
        "task_categories": ["image-classification"],
        "configs": protocols,
        "dataset_info": [
            {"config_name": block["config_name"], "features": features(shards)}
            for block in protocols
        ],
        "tags": TAGS,
    }
