"""Atomic writing of files, opening of files from users, checksums, and plain file names."""

import contextlib
import csv
import errno
import hashlib
import io
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


MOST_TEXT_BYTES = 64 << 20
"""Largest size of a text that is read as a whole; what Python makes of it takes some ten times as
much memory.
"""
MOST_TABLE_BYTES = 512 << 20
"""Largest size of a text that is read line by line."""
LONGEST_LINE = 1 << 20
"""Largest number of characters of a line."""


def existing(path: str | Path, what: str, most_bytes: int | None = None) -> Path:
    """Return `path` as a Path; every reader of a file from a user calls this before it opens it.

    most_bytes: largest size of the file, None for any.
    Raises: InputError naming `what` and the path where there is no such file, the name is not
    valid, it is no regular file (a pipe would never end), or larger.
    """
    path = Path(path)
    try:
        there = path.is_file()
        other = path.exists() and not path.is_dir()
    except OSError as error:
        raise InputError(f"{what}: no file at {path} ({error.strerror})") from error
    except ValueError:
        there = other = False  # a null byte in the name
    if not there and other:
        raise InputError(f"{what}: {path} is a pipe, socket or device, expected a regular file")
    if not there:
        raise InputError(f"{what}: no file at {path}")
    size = path.stat().st_size
    if most_bytes is not None and size > most_bytes:
        raise InputError(f"{path}: {size} bytes, expected a {what} of at most {most_bytes}")
    return path


def bytes_of(path: str | Path, what: str, most_bytes: int) -> bytes:
    """Return the bytes of a file of at most `most_bytes`.

    Raises: InputError as `existing`, and where the file has more bytes than its size says, as those
    of /proc have.
    """
    path = existing(path, what, most_bytes)
    size = path.stat().st_size
    with path.open("rb") as file:
        data = file.read(size + 1)
    if len(data) > size:
        raise InputError(f"{path}: longer than the {size} bytes of its size, expected a whole file")
    return data


class _Lines(io.TextIOWrapper):
    """A text whose lines are bounded: one that never ends would fill the memory."""

    def __next__(self) -> str:  # type: ignore[override]
        """Return the next line. Raises: InputError naming the file for a longer one."""
        line = self.readline(LONGEST_LINE + 1)
        if not line:
            raise StopIteration
        if len(line) > LONGEST_LINE:
            raise InputError(
                f"{self.name}: a line of more than {LONGEST_LINE} characters, expected shorter ones"
            )
        return line


@contextlib.contextmanager
def text_file(
    path: str | Path, what: str, most_bytes: int = MOST_TABLE_BYTES, errors: str = "strict"
) -> Iterator[TextIO]:
    """Yield a file opened as UTF-8 text, with or without a byte order mark.

    Line ends are left as they are. errors: what becomes of bytes that are no UTF-8, as in
    `bytes.decode`.
    Raises: InputError naming `what` and the path as `existing`, and where it is no UTF-8, has a
    line longer than LONGEST_LINE, or is no CSV where it is read as CSV.
    """
    raw = existing(path, what, most_bytes).open("rb")
    try:
        with _Lines(raw, encoding="utf-8-sig", errors=errors, newline="") as file:
            yield file
    except (UnicodeDecodeError, csv.Error) as error:
        raise InputError(f"{path}: not a {what} in UTF-8 text ({error})") from error


def text_of(
    path: str | Path, what: str, most_bytes: int = MOST_TEXT_BYTES, errors: str = "strict"
) -> str:
    """Return the text of a file.

    Raises: as `bytes_of`, and where it is no UTF-8.
    """
    data = bytes_of(path, what, most_bytes)
    try:
        return data.decode("utf-8-sig", errors)
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: not a {what} in UTF-8 text ({error})") from error


def slug(name: str) -> str:
    """Return the file name of a subtype or scheme.

    It is in lower case; each run of characters other than letters and digits is one "-".
    """
    return re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
