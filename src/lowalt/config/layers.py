"""The configuration: merged from files, checked against the schema, cut into the stages' settings.

This module does not depend on any stage. Faults are found before any job starts and named by key and value.
"""

import json
import re
import sys
from collections.abc import Iterable
from pathlib import Path

import yaml

from lowalt.config.command import parser, run
from lowalt.config.network import OFDM
from lowalt.config.schema import faults, plain
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.files.shipped import located, shipped
from lowalt.files.yaml_files import load_yaml

DEFAULT, SCHEMA = "config/default.yaml", "workflow/schemas/config.schema.yaml"


def merge(base: dict, overlay: dict) -> dict:
    """Return `base` with `overlay` laid over it: mappings merge key by key, anything else is replaced."""
    result = dict(base)
    for key, value in overlay.items():
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = merge(result[key], value) if both else value
    return result


def canonical(value: object) -> str:
    """Return the one JSON text of a settings block: sorted keys, so equal settings are equal texts."""
    return json.dumps(plain(value), sort_keys=True, allow_nan=False)


NUMBER = re.compile(r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?")
"""A number in the YAML of today; that of 2005, which the library reads, takes 28e9 for a text."""


def _kinds(entry: dict) -> set[str]:
    """The types that a schema's entry allows, those of its choices too."""
    kinds = entry.get("type", [])
    return (
        {kinds}
        if isinstance(kinds, str)
        else {*kinds, *(kind for one in entry.get("oneOf", ()) for kind in _kinds(one))}
    )


def _as_meant(value: object, entry: dict) -> object:
    """The value with texts such as 28e9 as numbers, and whole numbers as integers, where the entry wants these."""
    kinds = _kinds(entry)
    if isinstance(value, dict):
        _settle(value, entry)
    elif isinstance(value, list):
        return [_as_meant(item, entry.get("items", {})) for item in value]
    elif isinstance(value, str) and kinds & {"number", "integer"} and "string" not in kinds and NUMBER.fullmatch(value):
        value = float(value)
    if isinstance(value, float) and value.is_integer() and "integer" in kinds and "number" not in kinds:
        return int(value)
    return value


def _settle(block: dict, schema: dict) -> None:
    """Take the nulls out of a block whose keys may be left out and hold no null, and read its numbers (`_as_meant`)."""
    needed, known, further = (schema.get(key, {}) for key in ("required", "properties", "additionalProperties"))
    for key, value in list(block.items()):
        if not isinstance(key, str):
            raise InputError(f"configuration: key {key!r} among {list(block)}, expected text: put it in quotes")
        entry = known.get(key, further)
        if not isinstance(entry, dict):
            continue
        if value is None and key not in needed and "null" not in _kinds(entry):
            del block[key]
        else:
            block[key] = _as_meant(value, entry)


def _without_ofdm(network: dict) -> None:
    """Take the embedded default's subcarriers out of a network whose waveform has none, and a waveform that is OFDM."""
    if network.get("waveform") == {"kind": "ofdm"}:
        del network["waveform"]
    elif "waveform" in network:
        default = load_yaml(shipped(DEFAULT))["network"]
        for key in OFDM:
            if network.get(key) == default[key]:
                del network[key]


def check(config: dict, schema_path: str | Path) -> dict:
    """Return the configuration if it fits the schema, without nulls that take out what a lower layer has.

    A layer of configuration can only add keys to a mapping, so a null removes one that may be left out, such as a
    station, a spectrum, a start or an effect. A number may be written 28e9. Where the waveform has no subcarriers,
    those of the embedded default go.
    The configuration is changed in place. Raises: InputError with one line a fault.
    """
    schema = load_yaml(schema_path)
    _settle(config, schema)
    if isinstance(config.get("network"), dict):
        _without_ofdm(config["network"])
    lines = faults(config, schema)
    if lines:
        raise InputError("configuration refused: " + "\n  ".join(lines))
    return config


def load(paths: Iterable[str | Path], schema_path: str | Path) -> dict:
    """Return the checked configuration of a base file and its overlays, in order.

    A file that the working directory lacks is taken from those that came with the package.
    Raises: InputError naming file, key and value.

        >>> config = load(["config/default.yaml", "config/tiny.yaml"], "workflow/schemas/config.schema.yaml")
        >>> config["run"], config["noise"]["snr_db"]
        ('tiny', [3, inf])
    """
    result: dict = {}
    for path in paths:
        result = merge(result, load_yaml(shipped(path)))
    return located(check(result, shipped(schema_path)))


def overlaid(overlays: Iterable[str | Path]) -> dict:
    """Return the embedded default with overlays laid over it, in order, as `load` does."""
    return load([DEFAULT, *overlays], SCHEMA)


def main(arguments: list[str]) -> None:
    """Write the merged configuration next to a run's results."""
    line = parser("lowalt.config.layers", "Write the merged configuration as YAML.")
    line.add_argument("--out", required=True)
    options = line.parse_args(arguments)
    with replacing(options.out) as temporary:
        temporary.write_text(yaml.safe_dump(options.settings, sort_keys=False, allow_unicode=True))
    print(f"{options.out}: written", file=sys.stderr)


if __name__ == "__main__":
    run(main)
