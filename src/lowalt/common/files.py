"""Files at the edges of the stages: nothing half-written stays behind, every file has a checksum and a plain name."""

import contextlib
import hashlib
import os
import re
from collections.abc import Iterator
from pathlib import Path

from lowalt.common.errors import InputError


@contextlib.contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path beside `path` that takes its place only if the block ends without an error."""
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    # The suffix stays, since many writers choose the format by it.
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        yield temporary
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def sha256(path: str | Path) -> str:
    """Return a file's SHA-256 as 64 hexadecimal digits."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def existing(path: str | Path, what: str) -> Path:
    """Return `path` as a Path.

    Raises: InputError naming `what` and the path where there is no such file.
    """
    path = Path(path)
    if not path.is_file():
        raise InputError(f"{what}: no file at {path}")
    return path


def slug(name: str) -> str:
    """Return the file name of a subtype or scheme: lower case, runs of other characters than letters and digits as
    one "-"."""
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
