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


class Tiles:
    """Read-only view of a tiles file: `len(tiles)`, `tiles[i]` -> bytes of the i-th PNG."""

    def __init__(self, path: str | Path) -> None:
        """Open a tiles file.

        Raises: InputError naming the file where it is missing or not a tiles file.
        """
        self.path = existing(path, "tiles")
        try:
            with zipfile.ZipFile(self.path) as archive:
                with archive.open("offsets.npy") as member:
                    self.offsets = np.lib.format.read_array(member)
                info = archive.getinfo("data.npy")
            self._data = np.memmap(self.path, np.uint8, "r")
            local = bytes(self._data[info.header_offset : info.header_offset + 30])
            start = info.header_offset + 30 + sum(struct.unpack("<HH", local[26:30]))
            self._start = start + 10 + int.from_bytes(bytes(self._data[start + 8 : start + 10]), "little")
        except (zipfile.BadZipFile, KeyError, ValueError, struct.error, EOFError) as error:
            raise InputError(f"{self.path}: not a tiles file ({error})") from error
        if self._start + int(self.offsets[-1]) > len(self._data):
            raise InputError(f"{self.path}: ends before its last image")

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __getitem__(self, number: int) -> bytes:
        if not 0 <= number < len(self):
            raise IndexError(number)
        first, last = (self._start + int(self.offsets[number + k]) for k in (0, 1))
        return self._data[first:last].tobytes()
