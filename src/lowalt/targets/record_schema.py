"""What a target's record may say: the keys of each source, and the files that it may name."""

import functools
from pathlib import Path, PureWindowsPath

from lowalt.files.errors import InputError
from lowalt.files.yaml_files import load_yaml

PATH = Path(__file__).with_name("records.schema.yaml")
COMMON = "every record"
"""Section of the keys that records of all sources have."""
FORBIDDEN = "{}\\"
"""Characters that a file's name must not have.

Snakemake takes braces for a wildcard, and a backslash is a folder on Windows only.
"""


@functools.cache
def schema() -> dict:
    """Return the whole schema of records.

    `sources` holds a JSON schema for each source and for COMMON, `$defs` what they share, and
    `models` the built-in models with sets of their `figures`.
    """
    return load_yaml(PATH)


def check(section: str, record: dict, where: str) -> dict:
    """Return a record with its numbers read as meant, if it is as a section of the schema says.

    Raises: InputError naming `where`, the key, its value and what was expected.
    """
    # Slow to import, and a cloud is made without it.
    from lowalt.config.schema import faults, with_numbers

    wanted = {"$defs": schema()["$defs"], **schema()["sources"][section]}
    record = with_numbers(record, wanted)
    if wrong := faults(record, wanted, "record"):
        raise InputError(f"{where}: {wrong[0]}")
    return record


def figures(model: str) -> dict[str, str]:
    """Return the kind of each figure that a built-in model needs, by its name.

    A kind is length, ratio, offset, count or whole.
    """
    result: dict[str, str] = {}
    for item in schema()["models"][model]["figures"]:
        # A word names a set of figures that several models share.
        result |= schema()["figures"][item] if isinstance(item, str) else item
    return result


def figures_si(record: dict) -> dict[str, float]:
    """Return the figures of a merged built-in record by name, in SI units."""
    return {name: figure["si"] for name, figure in record["figures"].items()}


def record_files(record: dict) -> list[str]:
    """Return the user's files that a merged record names, each once, in order.

    They are relative to the folder of inputs.
    """
    files = []
    for part in record.get("parts", {}).values():
        files += [mesh["file"] for mesh in part.get("meshes", [])]
    files += [record[key] for key in ("skeleton", "motion") if key in record]
    return list(dict.fromkeys(files))


def check_file_name(name: str, where: str) -> None:
    """Refuse a file name that leaves the folder of inputs or that the workflow cannot pass on.

    Raises: InputError naming `where`, the name and what was expected.
    """
    path = PureWindowsPath(name)
    if not name.strip() or path.drive or path.root or ".." in path.parts:
        raise InputError(f"{where}: file is {name!r}, expected a path inside the folder of inputs")
    wrong = {letter for letter in name if letter in FORBIDDEN or not letter.isprintable()}
    if wrong:
        raise InputError(
            f"{where}: file is {name!r}, expected a name without {sorted(wrong)}: rename the file"
        )
