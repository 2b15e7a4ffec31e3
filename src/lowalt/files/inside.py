"""Files that a record names relative to its own folder, outside of which nothing is opened."""

from pathlib import Path, PurePosixPath

from lowalt.files.errors import InputError


def inside(folder: str | Path, name: str, where: str, key: str = "file") -> Path:
    """Return the path of a file by its name relative to a folder.

    where, key: the file that names it, and under which key.
    Raises: InputError where the name is absolute, has a part `..`, or leads out of the folder by a
    link.
    """
    path = PurePosixPath(name)
    if path.is_absolute() or ".." in path.parts:
        raise InputError(
            f"{where}: {key} is {name!r}, expected the name of a file in its own folder or below"
        )
    found = Path(folder) / name
    try:
        real = found.resolve()
    except (OSError, ValueError, RuntimeError):
        raise InputError(f"{where}: {key} is {name!r}, expected the name of a file") from None
    if not real.is_relative_to(Path(folder).resolve()):
        raise InputError(
            f"{where}: {key} is {name!r}, a link to {real}, expected a file in its own folder or "
            "below: copy it there"
        )
    return found
