"""The schema of a target's record: which keys each source knows, their types and their meaning in words."""

import functools
from pathlib import Path

import jsonschema

from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml

PATH = Path(__file__).with_name("records.schema.yaml")
COMMON = "every record"
"""Section of the keys that records of all sources have."""


@functools.cache
def schema() -> dict:
    """Return the whole schema: `$defs`, and under `sources` a JSON schema for each source and for COMMON."""
    return load_yaml(PATH)


def keys(section: str) -> tuple[str, ...]:
    """Return the names of the keys of a source, or of COMMON."""
    return tuple(schema()["sources"][section]["properties"])


@functools.cache
def _validator(section: str) -> jsonschema.Draft202012Validator:
    """Return the validator of a section, made once."""
    return jsonschema.Draft202012Validator({"$defs": schema()["$defs"], **schema()["sources"][section]})


def check(section: str, record: dict, where: str) -> None:
    """Refuse keys of a record that are unknown to a section, missing, or of another type than it says.

    Raises: InputError naming `where`, the key and what is wrong with it.
    """
    fault = jsonschema.exceptions.best_match(_validator(section).iter_errors(record))
    if fault is not None:
        place = ".".join(str(key) for key in fault.absolute_path) or "record"
        raise InputError(f"{where}: {place}: {fault.message}")
