"""User code that a setting names, FILE.py:FUNCTION or an effect's FILE.py.

Only the user may choose it.
"""

from collections.abc import Iterable
from pathlib import Path

from lowalt.files.errors import InputError


def file_of(name: str) -> Path | None:
    """Return the Python file in a backbone's name, None for the name of a library's model."""
    path, _, _ = name.rpartition(":")
    if not path.endswith(".py"):
        return None
    return Path(path)


BY_NAME = "`--backbone FILE.py:FUNCTION` (in Python `backbone=`) with code that you trust"


def own_effects(effects: Iterable[str]) -> list[str]:
    """Return those of the names of effects that are paths of the user's own Python files, sorted."""
    return sorted(name for name in effects if name.endswith(".py"))


def allowed(name: str, trusted: str, where: str | Path = "", how: str = BY_NAME) -> str:
    """Return the backbone of a file that names `name`; trusted: the FILE.py:FUNCTION that the user
    names, or "".

    where: the file or the run's folder; how: what the user may do instead.
    Raises: InputError where the file names code and the user does not.
    """
    if file_of(name) is None:
        return name
    if file_of(trusted) is None:
        source = f"{where}: " if where else ""
        raise InputError(
            f"{source}its backbone {name!r} is code, which a file may not choose; expected {how}"
        )
    return trusted
