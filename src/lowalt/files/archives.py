"""Archives of arrays (.npz) whose bytes depend only on the arrays.

Since Python 3.11.4 zipfile writes another version number and length into a member's header, so the
bytes of `np.savez` depend on the Python version. This module writes every byte itself; members are
uncompressed and dated 1980.
Source: PKWARE, "APPNOTE: .ZIP File Format Specification" 6.3.10, sections 4.3 and 4.5.3.
"""

import io
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from lowalt.files.errors import InputError

_LARGEST = 2**31 - 1
_VERSION = 45
"""Version of the format that a reader needs, 4.5, for the 64-bit sizes of section 4.5.3."""
_UNIX = 3
_DATE = 1 << 5 | 1
"""1 January 1980, the earliest date of the format."""
_MODE = 0o600 << 16


def _member(array: np.ndarray) -> bytes:
    """Return an array as a .npy file."""
    out = io.BytesIO()
    np.lib.format.write_array(out, np.asanyarray(array), allow_pickle=False)
    return out.getvalue()


def write_arrays(path: str | Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays by name as an uncompressed .npz, as `np.savez` of Python 3.11.4 and later does.

    Raises: InputError naming the file where it would exceed 2 GiB.
    """
    with Path(path).open("wb") as file:
        listed = []
        for name, array in arrays.items():
            data = _member(array)
            inner = f"{name}.npy".encode("ascii")
            offset = file.tell()
            if offset + len(data) > _LARGEST:
                raise InputError(
                    f"{path}: {name} would make the file longer than {_LARGEST} bytes, expected "
                    "less"
                )
            crc = zlib.crc32(data)
            long = 2**32 - 1
            file.write(
                struct.pack(
                    "<4s5H3I2H",
                    b"PK\3\4",
                    _VERSION,
                    0,
                    0,
                    0,
                    _DATE,
                    crc,
                    long,
                    long,
                    len(inner),
                    20,
                )
            )
            file.write(inner + struct.pack("<2H2Q", 1, 16, len(data), len(data)) + data)
            entry = (
                _VERSION,
                _UNIX,
                _VERSION,
                0,
                0,
                0,
                0,
                _DATE,
                crc,
                len(data),
                len(data),
                len(inner),
                0,
                0,
                0,
                0,
            )
            listed.append(struct.pack("<4s4B4H3I5H2I", b"PK\1\2", *entry, _MODE, offset) + inner)
        start = file.tell()
        size = sum(map(len, listed))
        file.write(b"".join(listed))
        file.write(
            struct.pack("<4s4H2IH", b"PK\5\6", 0, 0, len(listed), len(listed), size, start, 0)
        )
