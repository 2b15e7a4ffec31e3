"""Code of the user's own that a setting names: FILE.py:FUNCTION, or FILE.py of an effect.

Only the user may choose such code: a file from a stranger could otherwise run anything.
"""

from collections.abc import Iterable
from pathlib import Path

from lowalt.files.errors import InputError


def file_and_function(name: str) -> tuple[str, str]:
    """Return the two sides of a backbone's name FILE.py:FUNCTION; the first is "" without a colon."""
    file, _, function = name.rpartition(":")
    return file, function


def file_of(name: str) -> Path | None:
    """Return the Python file in a backbone's name, None for the name of a library's model."""
    path, _ = file_and_function(name)
    if not path.endswith(".py"):
        return None
    return Path(path)


BY_NAME = "`--backbone FILE.py:FUNCTION` (in Python `backbone=`) with code that you trust"
"""What a user may do to have the code of a backbone loaded, as a message says it."""


def own_effects(effects: Iterable[str]) -> list[str]:
    """Return those of the names of effects that are paths of the user's own Python files, sorted."""
    return sorted(name for name in effects if name.endswith(".py"))


def allowed(name: str, trusted: str, where: str | Path = "", how: str = BY_NAME) -> str:
    """Return the backbone to load for a file that names the backbone `name`.

    It is `name` itself if a library defines it, and otherwise `trusted`, the FILE.py:FUNCTION that
    the user names, or "". where: the file or the run's folder; how: what the user may do instead.
    Raises: InputError if the file names code and the user names none.
    """
    if file_of(name) is None:
        return name
    if file_of(trusted) is None:
        prefix = ""
        if where:
            prefix = f"{where}: "
        raise InputError(
            f"{prefix}its backbone {name!r} is code, which a file may not choose; expected {how}"
        )
    return trusted
