"""The names of a user's files in records: which ones a record may use. Nothing is opened here."""

from pathlib import PureWindowsPath

from lowalt.files.errors import InputError

FORBIDDEN = "{}\\"
"""Characters that a name must not have: Snakemake takes braces for a wildcard, and a backslash is a folder on Windows
only."""


def record_files(record: dict) -> list[str]:
    """Return the user's files that a merged record names, relative to the folder of inputs, each once, in order."""
    files = [mesh["file"] for part in record.get("parts", {}).values() for mesh in part.get("meshes", [])]
    return list(dict.fromkeys([*files, *(record[key] for key in ("skeleton", "motion") if key in record)]))


def check_file_name(name: object, where: str) -> None:
    """Refuse a file name that leaves the folder of inputs or that the workflow cannot pass on.

    Raises: InputError naming `where`, the name and what was expected.
    """
    expected = "expected a path inside the folder of inputs"
    if not isinstance(name, str) or not name.strip():
        raise InputError(f"{where} is {name!r}, {expected}")
    path = PureWindowsPath(name)
    if path.drive or path.root or ".." in path.parts:
        raise InputError(f"{where} is {name!r}, {expected}")
    wrong = sorted({letter for letter in name if letter in FORBIDDEN or not letter.isprintable()})
    if wrong:
        raise InputError(f"{where} is {name!r}, expected a name without {wrong}: rename the file")
