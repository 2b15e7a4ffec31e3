"""Data sets of one subtype that stay in memory between calls, found again by their content.

To check a configuration and the records of all targets takes a hundred times as long as one echo.
Both are used again only where the layers of the configuration, the working directory, the folder of
inputs and every file that any of them names have the content that they had.
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
"""Larger files count as unchanged while their size and their time of change are."""

Layer = str | Path | dict


class Kept(NamedTuple):
    """A checked configuration and what was made of it.

    records: of all its targets, merged; inputs: the folder of inputs; states: of every file that
    it names; datasets: by subtype.
    """

    config: dict
    records: dict[str, dict]
    inputs: str | None
    states: dict[Path, object]
    datasets: dict[str, Dataset]


_kept: dict[str, Kept] = {}


def alone(configuration: Layer | Iterable[Layer], subtype: str) -> Dataset:
    """Return the data set of one subtype and of those that the scene's effects need.

    Raises: InputError naming the key, value or file that is wrong.
    """
    if isinstance(configuration, (dict, str, Path)):
        configuration = [configuration]
    # The caller may change a layer after the call.
    layers = copy.deepcopy(list(configuration))
    key = _content(layers)
    found = _kept.pop(key, None)
    if found is None or any(_state(path) != state for path, state in found.states.items()):
        found = _checked(layers)
    _keep(_kept, key, found, KEPT_CONFIGURATIONS)
    dataset = found.datasets.pop(subtype, None)
    if dataset is None:
        dataset = _made(found, subtype)
    else:
        for text in dataset.folding:
            warn(text)
    _keep(found.datasets, subtype, dataset, KEPT_SUBTYPES)
    return dataset


def _keep(kept: dict, key: str, value: Any, most: int) -> None:
    """Add a value as the latest of those kept, and drop the oldest beyond `most`."""
    kept[key] = value
    while len(kept) > most:
        del kept[next(iter(kept))]


def _content(layers: Sequence[Layer]) -> str:
    """The layers as one text, with the content of files in place of them."""
    held: list[object] = [str(Path.cwd()), os.environ.get("LOWALT_INPUTS")]
    for layer in layers:
        if isinstance(layer, dict):
            held.append(layer)
        else:
            held.append([str(layer), _state(shipped(layer))])
    # The order of keys counts: it is that of the stations. `repr` stands for what JSON lacks.
    return json.dumps(held, default=repr)


def _state(path: Path) -> object:
    """What tells a file's content from another: its SHA-256, or size and time; None without it."""
    try:
        about = path.stat()
        if not stat.S_ISREG(about.st_mode):
            return None  # a pipe or a device may never end
        if about.st_size > MOST_COMPARED_BYTES:
            return [about.st_size, about.st_mtime_ns]
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except (OSError, ValueError):
        return None


def _checked(layers: Sequence[Layer]) -> Kept:
    """A whole configuration checked, or layers on the embedded default, with what they name."""
    config = _configuration(layers)
    inputs = config["inputs"] or os.environ.get("LOWALT_INPUTS")
    targets = located(config)["targets"]
    states = {path: _state(path) for path in _named_files(located(config), inputs)}
    return Kept(config, records_of(targets, inputs), inputs, states, {})


def _configuration(layers: Sequence[Layer]) -> dict:
    """The configuration of layers on the embedded default, or the whole one that they are."""
    schema = shipped(SCHEMA)
    if len(layers) == 1 and isinstance(layers[0], dict):
        is_whole = set(load_yaml(schema)["required"]) <= set(layers[0])
        if is_whole:
            return check(copy.deepcopy(layers[0]), schema)
    return overlaid(layers)


def _made(kept: Kept, subtype: str) -> Dataset:
    """The data set of one subtype and of those that the effects need."""
    select = list(dict.fromkeys([subtype, *needed_subtypes(kept.config["effects"])]))
    config = kept.config | {"targets": kept.config["targets"] | {"select": select}}
    return Dataset(config, inputs=kept.inputs, records=kept.records)


def _named_files(config: dict, inputs: str | None) -> Iterator[Path]:
    """Yield the files that a configuration or a record of its targets names.

    A file of the folder of inputs counts also if it is not there, since a record may then be
    replaced by an earlier one.
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
