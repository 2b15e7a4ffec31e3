"""The tiles file of a chunk: all its PNGs one after the other, (`data` uint8, `offsets` int64) in an .npz.

The archive is stored, not compressed, so that it is written as a stream and read through a memory map: neither
needs more memory than one sample.
"""

import shutil
import struct
import tempfile
import zipfile
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from lowalt.errors import InputError
from lowalt.files import existing, replacing


def _header(dtype: str, count: int) -> bytes:
    """The .npy header of a one-dimensional array."""
    text = f"{{'descr': '{dtype}', 'fortran_order': False, 'shape': ({count},), }}"
    text = text.ljust(-(-(11 + len(text)) // 64) * 64 - 11) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text.encode()


def write(path: str | Path, images: Iterable[bytes]) -> tuple[int, int]:
    """Write encoded images in their order; return their number and bytes. Equal images give equal files."""
    offsets = [0]
    with replacing(path) as temporary, tempfile.TemporaryFile(dir=temporary.parent) as spool:
        # An array's header holds its length, which is known only at the end.
        for image in images:
            spool.write(image)
            offsets.append(offsets[-1] + len(image))
        spool.seek(0)
        with zipfile.ZipFile(temporary, "w", zipfile.ZIP_STORED) as archive:
            with archive.open(zipfile.ZipInfo("data.npy"), "w", force_zip64=True) as member:
                member.write(_header("|u1", offsets[-1]))
                shutil.copyfileobj(spool, member, 1 << 20)
            table = np.array(offsets, "<i8")
            archive.writestr(zipfile.ZipInfo("offsets.npy"), _header("<i8", len(table)) + table.tobytes())
    return len(offsets) - 1, offsets[-1]


def stored_array(path: Path, name: str) -> np.ndarray:
    """Return a one-dimensional array of an uncompressed .npz as a read-only memory map.

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
        if shape[0] == 0:
            return np.zeros(0, dtype)
        return np.memmap(path, dtype, "r", start, shape)
    except (OSError, zipfile.BadZipFile, KeyError, ValueError, struct.error) as error:
        raise InputError(f"{path}: no array {name} ({error})") from error


class Tiles:
    """Read-only view of a tiles file: `len(tiles)`, `tiles[i]` -> bytes of the i-th PNG."""

    def __init__(self, path: str | Path) -> None:
        """Open a tiles file.

        Raises: InputError naming the file where it is missing or not a tiles file.
        """
        self.path = existing(path, "tiles")
        self.offsets = np.array(stored_array(self.path, "offsets.npy"))
        self._data = stored_array(self.path, "data.npy")

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __getitem__(self, number: int) -> bytes:
        if not 0 <= number < len(self):
            raise IndexError(number)
        return self._data[self.offsets[number] : self.offsets[number + 1]].tobytes()
