"""Atomic writing of files, checksums, and plain file names."""

import contextlib
import csv
import errno
import hashlib
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import TextIO

from lowalt.files.errors import InputError, SpaceError
from lowalt.files.processes import lives

FULL = (errno.ENOSPC, errno.EDQUOT)
NEARLY_FULL_BYTES = 1 << 20
"""NumPy and torch raise write errors without a number; with less than this free (bytes) they mean a
full disk.
"""


@contextlib.contextmanager
def replacing(path: str | Path, size: int | None = None) -> Iterator[Path]:
    """Yield a temporary path next to `path`, which replaces it if the block ends without an error.

    size: minimum size of the file (bytes), if known before it is written.
    Raises: SpaceError naming the file, the size and the free space where the disk is too small or
    becomes full.
    """
    path = Path(path)
    # Keep the suffix: many writers choose the format by it.
    temporary = path.with_name(f".{path.stem}.{os.getpid()}.part{path.suffix}")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _sweep(path)
        if size is not None and size > free_bytes(path):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        yield temporary
        # A C library that buffers can lose the last bytes without an error.
        if size is not None and temporary.stat().st_size < size:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        temporary.replace(path)
    except (OSError, RuntimeError) as error:
        if not _is_full(error, path):
            raise
        written = temporary.stat().st_size if temporary.exists() else 0
        if size is None:
            needed = f"more than the {_megabytes(written)} written so far"
        else:
            needed = _megabytes(size)
        free = _megabytes(free_bytes(path) + written)
        raise SpaceError(
            f"{path}: the disk is full; the file needs {needed}, {free} are free without it"
        ) from error
    finally:
        # A folder that could not be made holds no file either.
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def write_file(path: str | Path, content: str | bytes) -> None:
    """Write a whole file by `replacing`, text in UTF-8."""
    if isinstance(content, str):
        content = content.encode()
    with replacing(path) as temporary:
        temporary.write_bytes(content)


def _sweep(path: Path) -> None:
    """Remove temporary files of `path` left by killed processes, to free disk space."""
    begin = f".{path.stem}."
    end = f".part{path.suffix}"
    for entry in os.scandir(path.parent):
        number = entry.name.removeprefix(begin).removesuffix(end)
        if entry.name == f"{begin}{number}{end}" and number.isdigit() and not lives(int(number)):
            Path(entry.path).unlink(missing_ok=True)


def free_bytes(path: str | Path) -> int:
    """Return the bytes that this user may still write on the disk of `path`.

    The path itself need not exist.
    """
    path = Path(path).absolute()
    while not path.exists():
        path = path.parent
    return shutil.disk_usage(path).free


def _is_full(error: Exception, path: Path) -> bool:
    """Whether an error of a writer means that the disk is full."""
    if isinstance(error, OSError) and error.errno is not None:
        return error.errno in FULL
    # numpy's "N requested and M written" has no number of its own, torch's writer raises a
    # RuntimeError.
    return free_bytes(path) < NEARLY_FULL_BYTES


def _megabytes(size: int) -> str:
    """A size in MB, as text."""
    return f"{size / 1e6:.1f} MB"


def sha256(path: str | Path) -> str:
    """Return a file's SHA-256 as 64 hexadecimal digits."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def existing(path: str | Path, what: str) -> Path:
    """Return `path` as a Path.

    Raises: InputError naming `what` and the path where there is no such file, or the name is not
    valid.
    """
    path = Path(path)
    try:
        there = path.is_file()
    except OSError as error:
        raise InputError(f"{what}: no file at {path} ({error.strerror})") from error
    if not there:
        raise InputError(f"{what}: no file at {path}")
    return path


@contextlib.contextmanager
def text_file(path: str | Path, what: str) -> Iterator[TextIO]:
    """Yield a file opened as UTF-8 text, with or without a byte order mark.

    Line ends are left as they are.
    Raises: InputError naming `what` and the path where there is no such file, it is no UTF-8, or no
    CSV where it is read as CSV.
    """
    try:
        with existing(path, what).open(encoding="utf-8-sig", newline="") as file:
            yield file
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not a {what} in UTF-8 text ({error})") from error


def text_of(path: str | Path, what: str) -> str:
    """Return the text of a file.

    Raises: as `text_file`.
    """
    with text_file(path, what) as file:
        return file.read()


def slug(name: str) -> str:
    """Return the file name of a subtype or scheme.

    It is in lower case; each run of characters other than letters and digits is one "-".
    """
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
