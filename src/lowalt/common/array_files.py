"""Files of arrays (.npy, .npz) from users: the errors that damaged files raise, and limits of their stated size."""

import struct
import tokenize
import zipfile
import zlib
from pathlib import Path

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.files import existing

UNREADABLE = (
    OSError, ValueError, KeyError, TypeError, EOFError, NotImplementedError, MemoryError, OverflowError, RuntimeError,
    SyntaxError, struct.error, tokenize.TokenError, zipfile.BadZipFile, zlib.error,
)  # fmt: skip
"""Errors that numpy and zipfile raise on a file that is damaged or no array file."""

FREE_BYTES = 64 << 20
"""Up to this size a member of an archive may expand as it likes."""
MOST_EXPANSION = 16
"""Larger members may be this many times their compressed size; the project's own files are not compressed."""


def array_of(path: str | Path, what: str, mapped: bool = False) -> np.ndarray:
    """Return the array of a .npy file, or a read-only memory map of it.

    Raises: InputError naming the file where it is missing, cut or no array file.
    """
    path = existing(path, what)
    try:
        found = np.load(path, mmap_mode="r" if mapped else None, allow_pickle=False)
    except UNREADABLE as error:
        raise InputError(f"{path}: not a whole {what} file ({error})") from error
    if not isinstance(found, np.ndarray):
        raise InputError(f"{path}: an archive of arrays, expected {what}, one array (.npy)")
    return found


def checked_archive(path: str | Path, what: str) -> Path:
    """Return the path of a .npz whose members state plausible sizes; nothing is unpacked.

    Raises: InputError naming the file where it is missing, no archive, or has a member that would fill the memory.
    """
    path = existing(path, what)
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
    except UNREADABLE as error:
        raise InputError(f"{path}: not a {what} file ({error})") from error
    for member in members:
        if member.file_size > max(FREE_BYTES, MOST_EXPANSION * member.compress_size):
            raise InputError(
                f"{path}: {member.filename} says that {member.compress_size} bytes expand to {member.file_size}, "
                f"expected at most {MOST_EXPANSION} times as many"
            )
    return path
