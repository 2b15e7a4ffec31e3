"""The configuration: merges files and checks the result against the schema.

This module does not depend on any stage. Errors are found before any job starts and name key and
value.
"""

import json
import re
import sys
from collections.abc import Iterable
from pathlib import Path

import yaml

from lowalt.config.brought import OF_TRAINING, is_of_run, refuse_brought, refuse_training
from lowalt.config.command import parser, run
from lowalt.config.network import OFDM
from lowalt.config.schema import check_brought, faults, plain, with_extensions, with_numbers
from lowalt.files.atomic import write_file
from lowalt.files.errors import LONGEST, InputError
from lowalt.files.shipped import located, shipped
from lowalt.files.yaml_files import load_yaml

MOST_SUBCARRIERS = 100_000
DEFAULT = "config/default.yaml"
SCHEMA = "workflow/schemas/config.schema.yaml"


def merge(base: dict, overlay: dict) -> dict:
    """Return `base` with `overlay` laid over it: mappings merge by key, the rest is replaced."""
    result = dict(base)
    for key, value in overlay.items():
        lower = result.get(key)
        if isinstance(value, dict) and isinstance(lower, dict):
            result[key] = merge(lower, value)
        else:
            result[key] = value
    return result


def canonical(value: object) -> str:
    """Return the JSON text of a settings block with sorted keys: equal settings, equal texts."""
    return json.dumps(plain(value), sort_keys=True, allow_nan=False)


def _may_be_null(entry: dict) -> bool:
    """Whether a schema's entry allows null, itself or as one of its choices."""
    return "null" in entry.get("type", ()) or any(map(_may_be_null, entry.get("oneOf", ())))


def _entry(schema: dict, key: str) -> object:
    """The entry of a schema for a key of its block: by name, by a pattern, or for further keys."""
    if key in schema.get("properties", {}):
        return schema["properties"][key]
    for pattern, entry in schema.get("patternProperties", {}).items():
        if re.search(pattern, key):
            return entry
    return schema.get("additionalProperties", {})


def _without_nulls(block: object, schema: dict) -> None:
    """Remove nulls of optional keys whose schema allows none, from a block and its inner blocks."""
    if isinstance(block, list):
        for item in block:
            _without_nulls(item, schema.get("items", {}))
    if not isinstance(block, dict):
        return
    for key, value in list(block.items()):
        if not isinstance(key, str):
            raise InputError(
                f"configuration: key {key!r} among {list(block)}, expected text: put it in quotes"
            )
        entry = _entry(schema, key)
        if not isinstance(entry, dict):
            continue
        optional = key not in schema.get("required", ())
        if value is None and optional and not _may_be_null(entry):
            del block[key]
        else:
            _without_nulls(value, entry)


def _listed(lines: list[str]) -> str:
    """The first faults, as many as fit into a message, and the number of the others."""
    text = lines[0]
    for number, line in enumerate(lines[1:], 1):
        if len(text) + len(line) > LONGEST - 50:
            return f"{text}\n  and {len(lines) - number} more"
        text += f"\n  {line}"
    return text


def _without_ofdm(network: dict) -> None:
    """Remove the default's subcarriers from a network whose waveform has none.

    A waveform block that says OFDM is removed too, since OFDM is what a network without one has.
    """
    if network.get("waveform") == {"kind": "ofdm"}:
        del network["waveform"]
    elif "waveform" in network:
        default = load_yaml(shipped(DEFAULT))["network"]
        for key in OFDM:
            if network.get(key) == default[key]:
                del network[key]


def _with_subcarriers(network: dict) -> None:
    """Replace a network's bandwidth by the number of subcarriers that comes nearest to it."""
    bandwidth_hz = network.pop("bandwidth_hz", None)
    if bandwidth_hz is None:
        return
    if "waveform" in network:
        raise InputError(
            f"network.bandwidth_hz: {bandwidth_hz:g}, expected of OFDM only; the band of a sweep "
            "is sweep_hz"
        )
    count = round(bandwidth_hz / network["subcarrier_spacing_hz"])
    if not 1 <= count <= MOST_SUBCARRIERS:
        raise InputError(
            f"network.bandwidth_hz: {bandwidth_hz:g} is {count} subcarriers, expected 1 to "
            f"{MOST_SUBCARRIERS}"
        )
    network["subcarriers"] = count


def check(config: dict, schema_path: str | Path) -> dict:
    """Return the configuration if it fits the schema, without the nulls that remove keys.

    A layer can only add keys to a mapping. A null therefore removes an optional key, such as a
    station, a spectrum or an effect. A number may be written 28e9. If the waveform has no
    subcarriers, those of the embedded default are removed; a bandwidth becomes a number of
    subcarriers. The configuration is changed in place.
    Raises: InputError with one line per fault.
    """
    schema = with_extensions(schema_path)
    _without_nulls(config, schema)
    with_numbers(config, schema)
    if isinstance(config.get("network"), dict):
        _without_ofdm(config["network"])
    lines = faults(config, schema)
    if lines:
        raise InputError(f"configuration refused: {_listed(lines)}")
    _with_subcarriers(config["network"])
    return config


def read_layer(path: str | Path, unused: Iterable[str] = (), trains: bool = False) -> dict:
    """Return what a configuration file holds, which may be an overlay of the user or of a run.

    unused: blocks that the caller does not use; what they name is not refused. trains: whether the
    caller trains networks.
    Raises: InputError naming the file where it is no YAML, or where it counts as a run's
    (`brought.is_of_run`) and names code, weights or files elsewhere.
    """
    content = load_yaml(path)
    used = {key: value for key, value in content.items() if key not in unused}
    try:
        refuse_brought(used, path)
        if trains:
            refuse_training(content, path)
    except InputError:
        # The schema takes longer to read than most overlays, so it is asked last.
        if is_of_run(Path(path), content, load_yaml(shipped(SCHEMA))["required"]):
            raise
    return content


def load(
    layers: Iterable[str | Path | dict],
    schema_path: str | Path,
    unused: Iterable[str] = OF_TRAINING,
) -> dict:
    """Return the checked configuration of a base file and its overlays, in order.

    Each layer is a path or a dict. A file that is not in the working directory is taken from the
    package. unused: as in `read_layer`, by default the blocks that making samples does not use. The
    embedded default belongs to the checkout and is trusted.
    Raises: InputError naming file, key and value.

        >>> paths = ["config/default.yaml", "config/tiny.yaml"]
        >>> config = load(paths, "workflow/schemas/config.schema.yaml")
        >>> config["run"], config["noise"]["snr_db"]
        ('tiny', [3, inf])
    """
    result: dict = {}
    for layer in layers:
        if isinstance(layer, dict):
            content = layer
        elif layer == DEFAULT:
            content = load_yaml(shipped(layer))
        else:
            content = read_layer(shipped(layer), unused)
        result = merge(result, content)
    return located(check(result, shipped(schema_path)))


def of_run(folder: str | Path) -> dict:
    """Return the configuration in a run's folder, plain values only; it may be of an older schema.

    The folder is untrusted, so whoever opens what it names asks `brought.refuse_brought` first.
    Raises: InputError naming a folder that is not a run's, or the file and the wrong key.
    """
    path = Path(folder) / "config.yaml"
    if not path.is_file():
        raise InputError(f"{folder}: has no config.yaml, expected the folder of a finished run")
    config = load_yaml(path)
    check_brought("settings", config, path)
    return config


def overlaid(overlays: Iterable[str | Path | dict], unused: Iterable[str] = OF_TRAINING) -> dict:
    """Return the embedded default with overlays laid over it, in order, as `load` does."""
    return load([DEFAULT, *overlays], SCHEMA, unused)


def main(arguments: list[str]) -> None:
    """Write the merged configuration next to a run's results."""
    line = parser("lowalt.config.layers", "Write the merged configuration as YAML.")
    line.add_argument("--out", required=True)
    options = line.parse_args(arguments)
    write_file(options.out, yaml.safe_dump(options.settings, sort_keys=False, allow_unicode=True))
    print(f"{options.out}: written", file=sys.stderr)


if __name__ == "__main__":
    run(main)
