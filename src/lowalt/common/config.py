"""The configuration: merged from files, checked against the schema, cut into the stages' settings.

This module does not depend on any stage. Faults are found before any job starts and named by key and value.
"""

import json
import sys
from collections.abc import Iterable
from pathlib import Path

import yaml

from lowalt.common.command import parser, run
from lowalt.common.errors import InputError
from lowalt.common.files import replacing
from lowalt.common.schema import faults, plain
from lowalt.common.shipped import located, shipped
from lowalt.common.yaml_files import load_yaml


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


def check(config: dict, schema_path: str | Path) -> dict:
    """Return the configuration if it fits the schema, without the stations, spectra and starts that are null.

    A layer of configuration can only add keys to a mapping, so a null removes one of a lower layer.
    The configuration is changed in place. Raises: InputError with one line a fault.
    """
    network, recognition = config.get("network"), config.get("recognition")
    inner = [
        block.get(key) for block, key in ((network, "stations"), (recognition, "start")) if isinstance(block, dict)
    ]
    for block in (*inner, config.get("spectra")):
        if isinstance(block, dict):
            for name in [name for name, value in block.items() if value is None]:
                del block[name]
    found = faults(config, load_yaml(schema_path))
    if found:
        raise InputError("configuration refused:\n  " + "\n  ".join(found))
    return config


def load(paths: Iterable[str | Path], schema_path: str | Path) -> dict:
    """Return the checked configuration of a base file and its overlays, in order.

    A file that the working directory lacks is taken from those that came with the package.
    Raises: InputError naming file, key and value.
    """
    result: dict = {}
    for path in paths:
        result = merge(result, load_yaml(shipped(path)))
    return located(check(result, shipped(schema_path)))


def main(arguments: list[str]) -> None:
    """Write the merged configuration next to a run's results."""
    options = parser("lowalt.common.config", "Write the merged configuration as YAML.")
    options.add_argument("--out", required=True)
    given = options.parse_args(arguments)
    with replacing(given.out) as temporary:
        temporary.write_text(yaml.safe_dump(given.settings, sort_keys=False, allow_unicode=True))
    print(f"{given.out}: written", file=sys.stderr)


if __name__ == "__main__":
    run(main)
