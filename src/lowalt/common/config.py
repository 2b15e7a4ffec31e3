"""The configuration: merged from files, checked against the schema, cut into the stages' settings.

This module does not depend on any stage. Faults are found before any job starts and named by key and value.
"""

import json
import math
import sys
from collections.abc import Iterable
from pathlib import Path

import jsonschema
import yaml

from lowalt.common.command import parser, run
from lowalt.common.errors import InputError
from lowalt.common.files import replacing
from lowalt.common.shipped import located, shipped
from lowalt.common.yaml_files import load_yaml


def merge(base: dict, overlay: dict) -> dict:
    """Return `base` with `overlay` laid over it: mappings merge key by key, anything else is replaced."""
    result = dict(base)
    for key, value in overlay.items():
        both = isinstance(value, dict) and isinstance(result.get(key), dict)
        result[key] = merge(result[key], value) if both else value
    return result


def plain(value: object) -> object:
    """Return `value` with infinities as the string "inf" (JSON has none) and integral floats unchanged."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, float) and math.isinf(value):
        return "inf" if value > 0 else "-inf"
    return value


def canonical(value: object) -> str:
    """Return the one JSON text of a settings block: sorted keys, so equal settings are equal texts."""
    return json.dumps(plain(value), sort_keys=True, allow_nan=False)


def _expected(error: jsonschema.ValidationError) -> str:
    """Return the schema's expectation in words."""
    rule, wanted = error.validator, error.validator_value
    words = {
        "type": f"type {wanted}",
        "minimum": f"at least {wanted}",
        "maximum": f"at most {wanted}",
        "exclusiveMinimum": f"more than {wanted}",
        "exclusiveMaximum": f"less than {wanted}",
        "enum": f"one of {wanted}",
        "minItems": f"at least {wanted} item(s)",
        "maxItems": f"at most {wanted} items",
        "minProperties": f"at least {wanted} entry",
        "uniqueItems": "every item once",
        "pattern": f"text like {wanted}",
    }
    return words.get(str(rule), error.message)


def faults(config: dict, schema: dict) -> list[str]:
    """Return one line a fault of `config` against a JSON schema: key, value and what was expected."""
    lines = []
    errors = jsonschema.Draft202012Validator(schema).iter_errors(plain(config))
    for error in sorted(errors, key=lambda error: list(map(str, error.absolute_path))):
        key = ".".join(map(str, error.absolute_path)) or "configuration"
        meaning = error.schema.get("description", "") if isinstance(error.schema, dict) else ""
        if error.validator == "additionalProperties":
            known = error.schema.get("properties", {})
            unknown = [name for name in error.instance if name not in known]
            lines.append(f"{key}: unknown key(s) {unknown}, expected only {sorted(known)}")
        elif error.validator == "required":
            missing = [name for name in error.validator_value if name not in error.instance]
            lines.append(f"{key}: missing key(s) {missing}")
        else:
            lines.append(
                f"{key}: value {error.instance!r}, expected {_expected(error)}" + f" ({meaning})" * bool(meaning)
            )
    return list(dict.fromkeys(lines))


def check(config: dict, schema_path: str | Path) -> dict:
    """Return the configuration if it fits the schema, without the stations and spectra that are null.

    A layer of configuration can only add keys to a mapping, so a null removes one of a lower layer.
    The configuration is changed in place. Raises: InputError with one line a fault.
    """
    network = config.get("network")
    for block in (network.get("stations") if isinstance(network, dict) else None, config.get("spectra")):
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
