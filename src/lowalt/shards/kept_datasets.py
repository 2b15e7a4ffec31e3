"""Data sets of one subtype that stay in memory between calls, found again by their content.

To check a configuration and the records of all targets takes a hundred times as long as one echo.
They are reused only while the layers of the configuration, the working directory, the folder of
inputs and every file that any of them names are unchanged.
"""

import copy
import hashlib
import json
import os
import stat
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from lowalt.config.layers import SCHEMA, check, overlaid
from lowalt.files.errors import warn
from lowalt.files.shipped import located, shipped
from lowalt.files.yaml_files import load_yaml
from lowalt.scene.effects import needed_subtypes
from lowalt.shards.dataset import Dataset
from lowalt.targets.record_schema import record_files
from lowalt.targets.records import read_records, records_of

KEPT_CONFIGURATIONS = 4
KEPT_SUBTYPES = 8
"""Largest numbers of configurations, and of subtypes of each, that stay in memory."""
MOST_COMPARED_BYTES = 1_000_000
"""Files of more bytes are compared by size and modification time only."""

Layer = str | Path | dict


class Kept(NamedTuple):
    """A checked configuration and what was made of it.

    records: the merged records of all its targets; inputs: the folder of inputs; states: what
    `_state` returned for each file that the configuration names; datasets: by subtype.
    """

    config: dict
    records: dict[str, dict]
    inputs: str | None
    states: dict[Path, object]
    datasets: dict[str, Dataset]


_kept: dict[str, Kept] = {}


def dataset_of_subtype(configuration: Layer | Iterable[Layer], subtype: str) -> Dataset:
    """Return a data set of one subtype and of the subtypes that the scene's effects need.

    The same data set is returned as long as nothing that it was made from has changed.

    Raises: InputError naming the key, value or file that is wrong.
    """
    if isinstance(configuration, (dict, str, Path)):
        configuration = [configuration]
    # The caller may change a layer after the call.
    layers = copy.deepcopy(list(configuration))
    key = _content(layers)
    kept = _kept.get(key)
    if kept is None or not _is_unchanged(kept):
        kept = _checked(layers)
    _keep_as_newest(_kept, key, kept, KEPT_CONFIGURATIONS)
    dataset = kept.datasets.get(subtype)
    if dataset is None:
        dataset = _made(kept, subtype)
    else:
        # Each caller sees the warnings that making the data set gives, the first and all later.
        for text in dataset.folding:
            warn(text)
    _keep_as_newest(kept.datasets, subtype, dataset, KEPT_SUBTYPES)
    return dataset


def _is_unchanged(kept: Kept) -> bool:
    """Whether every file that a configuration names is as it was when it was checked."""
    return all(_state(path) == state for path, state in kept.states.items())


def _keep_as_newest(kept: dict, key: str, value: Any, most: int) -> None:
    """Put a value at the end of those kept, and drop from the front what exceeds `most`."""
    # Assigning to a key that is there would leave it at its old position.
    kept.pop(key, None)
    kept[key] = value
    while len(kept) > most:
        del kept[next(iter(kept))]


def _content(layers: Sequence[Layer]) -> str:
    """Return a text that changes with the layers, their files and what else they depend on."""
    content: list[object] = [str(Path.cwd()), os.environ.get("LOWALT_INPUTS")]
    for layer in layers:
        if isinstance(layer, dict):
            content.append(layer)
        else:
            # A layer may be one of the package's configurations, named as in a checkout.
            file = shipped(layer)
            content.append([str(layer), _state(file)])
    # The order of keys matters, since it numbers the stations: the keys are not sorted here.
    # Values that JSON does not know, such as paths and dates, are written by `repr`.
    return json.dumps(content, default=repr)


def _state(path: Path) -> object:
    """Return a file's SHA-256, or its size and modification time if it is large.

    Return None if the path is no regular file or cannot be read.
    """
    try:
        about = path.stat()
        if not stat.S_ISREG(about.st_mode):
            return None  # a pipe or a device may never end
        if about.st_size > MOST_COMPARED_BYTES:
            return [about.st_size, about.st_mtime_ns]
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return None
    except ValueError:
        return None  # a text of the configuration with a null byte, which no path can have


def _checked(layers: Sequence[Layer]) -> Kept:
    """Return the checked configuration of the layers, its records and the states of its files."""
    config = _configuration(layers)
    inputs = config["inputs"] or os.environ.get("LOWALT_INPUTS")
    with_paths = located(config)
    # The states are taken first: a file that changes while its record is read counts as changed.
    states = {path: _state(path) for path in _named_files(with_paths, inputs)}
    records = records_of(with_paths["targets"], inputs)
    return Kept(config, records, inputs, states, datasets={})


def _configuration(layers: Sequence[Layer]) -> dict:
    """Return the checked configuration: a single complete mapping, or layers over the default."""
    schema = shipped(SCHEMA)
    if len(layers) == 1 and isinstance(layers[0], dict):
        required = set(load_yaml(schema)["required"])
        is_complete = required <= set(layers[0])
        if is_complete:
            return check(copy.deepcopy(layers[0]), schema)
    return overlaid(layers)


def _made(kept: Kept, subtype: str) -> Dataset:
    """Make the data set of one subtype and of the subtypes that the effects need."""
    select = list(dict.fromkeys([subtype, *needed_subtypes(kept.config["effects"])]))
    config = kept.config | {"targets": kept.config["targets"] | {"select": select}}
    return Dataset(config, inputs=kept.inputs, records=kept.records)


def _named_files(config: dict, inputs: str | None) -> Iterator[Path]:
    """Yield the files that a configuration or a record of its targets names.

    Files that are missing from the folder of inputs are among them: if one appears, another record
    is chosen for its subtype.
    """
    for text in _texts(config):
        path = Path(text)
        if _state(path) is not None:
            yield path
    if inputs is None:
        return
    targets = config["targets"]
    for path in [*targets["records"], *targets.get("own", {}).values()]:
        for record in read_records(path).values():
            for name in record_files(record):
                yield Path(inputs) / name


def _texts(value: object) -> Iterator[str]:
    """Yield every text in nested mappings and lists, keys too."""
    if isinstance(value, str):
        yield value
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from _texts(key)
            yield from _texts(item)
    elif isinstance(value, list):
        for item in value:
            yield from _texts(item)
