"""Files of arrays (.npy, .npz) from users: errors of damaged files, limits of their stated size."""

import struct
import sys
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import IO

import numpy as np

from lowalt.files.atomic import existing
from lowalt.files.errors import InputError

UNREADABLE = (
    OSError,
    ValueError,
    KeyError,
    TypeError,
    EOFError,
    NotImplementedError,
    MemoryError,
    OverflowError,
    RuntimeError,
    SyntaxError,
    struct.error,
    tokenize.TokenError,
    zipfile.BadZipFile,
    zlib.error,
)
"""Errors that numpy and zipfile raise on a file that is damaged or no array file."""

FREE_BYTES = 64 << 20
"""Members of an archive up to this size (bytes) may have any compression ratio."""
MOST_EXPANSION = 16
"""Larger members may be this many times their compressed size; the project's own files are not
compressed.
"""


def array_of(path: str | Path, what: str, mapped: bool = False) -> np.ndarray:
    """Return the array of a .npy file, or a read-only memory map of it.

    Raises: InputError naming the file where it is missing, cut or no array file.
    """
    path = existing(path, what)
    try:
        array = np.load(path, mmap_mode="r" if mapped else None, allow_pickle=False)
    except UNREADABLE as error:
        raise InputError(f"{path}: not a whole {what} file ({error})") from error
    if not isinstance(array, np.ndarray):
        raise InputError(f"{path}: an archive of arrays, expected {what}, one array (.npy)")
    return array


def checked_archive(path: str | Path, what: str) -> Path:
    """Return the path of a .npz whose members are arrays of plausible sizes, its texts valid.

    Raises: InputError naming the file where it is missing, is no archive, or has a member that
    would fill the memory, is not an array (NumPy would return bytes), or holds invalid characters
    (which would fail later).
    """
    path = existing(path, what)
    try:
        with zipfile.ZipFile(path) as archive:
            members = archive.infolist()
            large = next((member for member in members if _expands(member)), None)
            if large is None:
                for member in members:
                    with archive.open(member) as file:
                        _check_array(file)
    except UNREADABLE as error:
        raise InputError(f"{path}: not a {what} file ({error})") from error
    if large:
        raise InputError(
            f"{path}: {large.filename} says that {large.compress_size} bytes expand to "
            f"{large.file_size}, expected at most {MOST_EXPANSION} times as many"
        )
    return path


def _expands(member: zipfile.ZipInfo) -> bool:
    """Whether the stated size of an archive's member would fill the memory."""
    return member.file_size > max(FREE_BYTES, MOST_EXPANSION * member.compress_size)


def _check_array(file: IO[bytes]) -> None:
    """Read the header of a .npy file, and its characters where it holds text.

    Raises: errors of UNREADABLE.
    """
    if np.lib.format.read_magic(file) == (1, 0):
        _, _, dtype = np.lib.format.read_array_header_1_0(file)
    else:
        _, _, dtype = np.lib.format.read_array_header_2_0(file)
    if dtype.kind == "U":
        codes = np.frombuffer(file.read(), np.dtype("u4").newbyteorder(dtype.byteorder))
        if codes.max(initial=0) > sys.maxunicode:
            raise ValueError(f"its text has the code {codes.max()}, which is no character")
