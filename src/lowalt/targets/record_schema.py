"""The schema of a target's record: which keys each source knows, their types and their meaning in words."""

import functools
from pathlib import Path

from lowalt.config.schema import faults
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


def check(section: str, record: dict, where: str) -> None:
    """Refuse keys of a record that are unknown to a section, missing, or of another value than it says.

    Raises: InputError naming `where`, the key, its value and what was expected.
    """
    if found := faults(record, {"$defs": schema()["$defs"], **schema()["sources"][section]}, "record"):
        raise InputError(f"{where}: {found[0]}")
