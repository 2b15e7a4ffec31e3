"""The tiles file of a chunk: all its PNGs one after the other in an .npz.

Its arrays are `data` uint8 and `offsets` int64.

The archive is not compressed, so it can be written as a stream and read image by image, with the
memory of one sample.
"""

import os
import struct
import zipfile
from collections.abc import Iterable
from pathlib import Path

import deflate
import numpy as np

from lowalt.files.array_files import UNREADABLE
from lowalt.files.atomic import existing, replacing
from lowalt.files.errors import InputError


def npy_header(dtype: str, shape: tuple[int, ...]) -> bytes:
    """Return the .npy header (format 1.0) of an array.

    The padding of NumPy's own changed between versions.
    """
    text = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': {tuple(map(int, shape))}, }}"
    text = text.ljust(-(-(11 + len(text)) // 64) * 64 - 11) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


def _crc_behind(header: bytes, size: int) -> int:
    """CRC-32 of a header followed by `size` zero bytes."""
    crc = deflate.crc32(header)
    zeros = bytes(min(size, 1 << 20))
    for _ in range(size >> 20):
        crc = deflate.crc32(zeros, crc)
    return deflate.crc32(zeros[: size & ((1 << 20) - 1)], crc)


def write(path: str | Path, images: Iterable[bytes]) -> tuple[int, int]:
    """Write encoded images in their order; return their number and bytes.

    Equal images give equal files.
    """
    offsets = [0]
    blank = npy_header("|u1", (0,))
    with (
        replacing(path) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as archive,
    ):
        info = zipfile.ZipInfo("data.npy")
        with archive.open(info, "w", force_zip64=True) as member:
            member.write(blank)
            for image in images:
                member.write(image)
                offsets.append(offsets[-1] + len(image))
        # The array's length is known only now; its header has room for it. A CRC is linear, so the
        # change of the CRC by a new header does not depend on the data.
        header = npy_header("|u1", (offsets[-1],))
        info.CRC ^= _crc_behind(blank, offsets[-1]) ^ _crc_behind(header, offsets[-1])
        assert archive.fp is not None  # open until the block ends
        archive.fp.seek(info.header_offset)
        archive.fp.write(info.FileHeader(zip64=True) + header)
        table = np.array(offsets, "<i8")
        content = npy_header("<i8", (len(table),)) + table.tobytes()
        archive.writestr(zipfile.ZipInfo("offsets.npy"), content)
    return len(offsets) - 1, offsets[-1]


def stored_array(path: Path, name: str) -> tuple[np.dtype, int, int]:
    """Return type, length and first byte of a one-dimensional array of an uncompressed .npz.

    Raises: InputError naming the file where it has no such array or is cut off.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            info = archive.getinfo(name)
        with path.open("rb") as file:
            file.seek(info.header_offset + 26)
            file.seek(sum(struct.unpack("<HH", file.read(4))), 1)
            if np.lib.format.read_magic(file) != (1, 0):
                raise ValueError(f"{name} is not of version 1.0")
            shape, _, dtype = np.lib.format.read_array_header_1_0(file)
            start = file.tell()
        if info.compress_type != zipfile.ZIP_STORED or len(shape) != 1:
            raise ValueError(f"{name} is compressed or not one-dimensional")
        if not 0 <= shape[0] * dtype.itemsize <= path.stat().st_size - start:
            raise ValueError(f"{name} is said to have {shape[0]} values")
        return dtype, shape[0], start
    except UNREADABLE as error:
        raise InputError(f"{path}: no array {name} ({error})") from error


def map_array(path: Path, name: str) -> np.ndarray:
    """Return a one-dimensional array of an uncompressed .npz as a read-only memory map.

    Raises: InputError naming the file where it has no such array or is cut off.
    """
    dtype, count, start = stored_array(path, name)
    if dtype.hasobject:
        raise InputError(f"{path}: {name} holds objects, expected plain values")
    if count == 0:
        return np.zeros(0, dtype)
    return np.memmap(path, dtype, "r", start, (count,))


class Tiles:
    """Read-only view of a tiles file: `len(tiles)`, `tiles[i]` -> bytes of the i-th PNG."""

    def __init__(self, path: str | Path) -> None:
        """Open a tiles file.

        Raises: InputError naming the file where it is missing or not a tiles file.
        """
        self.path = existing(path, "tiles")
        self.offsets = ends = np.array(map_array(self.path, "offsets.npy"))
        kind, size, self._start = stored_array(self.path, "data.npy")
        if ends.dtype.kind not in "iu" or kind != np.uint8:
            raise InputError(
                f"{self.path}: data of {kind} parted by {ends.dtype}, expected bytes and whole "
                "numbers"
            )
        rising = len(ends) and ends[0] >= 0 and (np.diff(ends) >= 0).all()
        if not rising or ends[-1] != size:
            raise InputError(
                f"{self.path}: offsets.npy does not part data.npy's {size} bytes, the file is "
                "damaged"
            )
        # Read instead of mapping: gigabytes of mapped pages would count as memory of this process.
        self._file = self.path.open("rb")

    def __len__(self) -> int:
        """Number of tiles."""
        return len(self.offsets) - 1

    def __getitem__(self, number: int) -> bytes:
        """Bytes of one PNG. Raises: IndexError for a number out of range."""
        if not 0 <= number < len(self):
            raise IndexError(number)
        first = int(self.offsets[number])
        size = int(self.offsets[number + 1]) - first
        return os.pread(self._file.fileno(), size, self._start + first)
