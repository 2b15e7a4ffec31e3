"""Files of arrays (.npy, .npz) from users: errors of damaged files, limits of their stated size."""

import math
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
        # A map first: its size is compared with that of the file before memory is asked for.
        array = np.load(path, mmap_mode="r", allow_pickle=False)
        if not mapped and isinstance(array, np.memmap):
            array = np.array(array)
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
            total = sum(member.file_size for member in members)
            whole = total <= most_expanded(path.stat().st_size)
            if large is None and whole:
                for member in members:
                    with archive.open(member) as file:
                        _check_array(file, member.file_size)
    except UNREADABLE as error:
        raise InputError(f"{path}: not a {what} file ({error})") from error
    if large:
        raise InputError(
            f"{path}: {large.filename} says that {large.compress_size} bytes expand to "
            f"{large.file_size}, expected at most {MOST_EXPANSION} times as many"
        )
    if not whole:
        raise InputError(
            f"{path}: {len(members)} members of {total} bytes in all, expected at most "
            f"{MOST_EXPANSION} times as many as the file has"
        )
    return path


def most_expanded(size: int) -> int:
    """Return how many bytes a compressed file or member of `size` bytes may expand to."""
    return max(FREE_BYTES, MOST_EXPANSION * size)


def _expands(member: zipfile.ZipInfo) -> bool:
    """Whether the stated size of an archive's member would fill the memory."""
    return member.file_size > most_expanded(member.compress_size)


def _check_array(file: IO[bytes], size: int) -> None:
    """Read the header of a .npy file of `size` bytes, and its characters where it holds text.

    Raises: errors of UNREADABLE.
    """
    if np.lib.format.read_magic(file) == (1, 0):
        shape, _, dtype = np.lib.format.read_array_header_1_0(file)
    else:
        shape, _, dtype = np.lib.format.read_array_header_2_0(file)
    if math.prod(shape) * dtype.itemsize > size:
        raise ValueError(f"an array {shape} of {dtype} is longer than its {size} bytes")
    if dtype.kind == "U":
        codes = np.frombuffer(file.read(), np.dtype("u4").newbyteorder(dtype.byteorder))
        if codes.max(initial=0) > sys.maxunicode:
            raise ValueError(f"its text has the code {codes.max()}, which is no character")
