"""What a target's record may say: the keys of each source with their types and meaning, and the
files it may name.
"""

import functools
from pathlib import Path, PureWindowsPath

from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml

PATH = Path(__file__).with_name("records.schema.yaml")
COMMON = "every record"
"""Section of the keys that records of all sources have."""
FORBIDDEN = "{}\\"
"""Characters that a file's name must not have: Snakemake takes braces for a wildcard, and a
backslash is a folder on Windows only."""


@functools.cache
def schema() -> dict:
    """Return the whole schema: `$defs`, under `sources` a JSON schema for each source and for
    COMMON, and the built-in `models` with sets of their `figures`."""
    return load_yaml(PATH)


def check(section: str, record: dict, where: str) -> dict:
    """Return a record's keys with their numbers read as meant, if they are as a section of the
    schema says.

    Raises: InputError naming `where`, the key, its value and what was expected.
    """
    from lowalt.config.schema import (
        faults,
        with_numbers,
    )  # slow to import, and a cloud is made without it

    wanted = {"$defs": schema()["$defs"], **schema()["sources"][section]}
    record = with_numbers(record, wanted)
    if wrong := faults(record, wanted, "record"):
        raise InputError(f"{where}: {wrong[0]}")
    return record


def figures(model: str) -> dict[str, str]:
    """Return the figures that a built-in model needs by name, each a length, ratio, offset, count
    or whole number.
    """
    sets = [
        schema()["figures"][item] if isinstance(item, str) else item
        for item in schema()["models"][model]["figures"]
    ]
    return {name: kind for needed in sets for name, kind in needed.items()}


def record_files(record: dict) -> list[str]:
    """Return the user's files that a merged record names, relative to the folder of inputs, each
    once, in order.
    """
    files = [
        mesh["file"] for part in record.get("parts", {}).values() for mesh in part.get("meshes", [])
    ]
    return list(
        dict.fromkeys([*files, *(record[key] for key in ("skeleton", "motion") if key in record)])
    )


def check_file_name(name: str, where: str) -> None:
    """Refuse a file name that leaves the folder of inputs or that the workflow cannot pass on.

    Raises: InputError naming `where`, the name and what was expected.
    """
    path = PureWindowsPath(name)
    if not name.strip() or path.drive or path.root or ".." in path.parts:
        raise InputError(f"{where}: file is {name!r}, expected a path inside the folder of inputs")
    if wrong := sorted(
        {letter for letter in name if letter in FORBIDDEN or not letter.isprintable()}
    ):
        raise InputError(
            f"{where}: file is {name!r}, expected a name without {wrong}: rename the file"
        )
