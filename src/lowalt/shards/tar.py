"""Writes tar files in which equal samples give equal bytes: fixed owner, mode and time.

The layout equals that of webdataset's `TarWriter(encoder=False, mtime=0)`: USTAR headers, members
of a sample side by side in the order of their extensions, two empty blocks at the end, the file
filled up to 10 240 bytes.
"""

import hashlib
import tarfile
from dataclasses import dataclass
from typing import BinaryIO

from lowalt.files.errors import InputError

RECORD = 10240


def member(name: str, data: bytes) -> bytes:
    """Return header, data and padding of one member.

    Raises: InputError where the name is longer than a plain tar header holds.
    """
    info = tarfile.TarInfo(name)
    info.size = len(data)
    info.mtime = 0
    info.mode = 0o444
    info.uname = info.gname = "bigdata"
    if len(name.encode()) > 100:
        raise InputError(f"shard member {name!r}: longer than the 100 bytes of a tar header")
    return info.tobuf(tarfile.USTAR_FORMAT) + data + bytes(-len(data) % tarfile.BLOCKSIZE)


@dataclass(frozen=True)
class Span:
    """Position of a sample in its shard (bytes).

    offset, size: of the whole sample; record, data: (offset, size) of its two members' contents.
    """

    offset: int
    size: int
    record: tuple[int, int]
    data: tuple[int, int]
    sha256: bytes


class Writer:
    """Writes samples to an open file and keeps the running SHA-256 of the whole shard."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._hash = hashlib.sha256()
        self.size = 0

    def _put(self, data: bytes) -> None:
        """Write bytes and count them in size and SHA-256."""
        self._file.write(data)
        self._hash.update(data)
        self.size += len(data)

    def add(self, key: str, record: bytes, extension: str, data: bytes) -> Span:
        """Append the members {key}.json and {key}.{extension} in alphabetical order.

        Return their position.
        """
        if "." in key or "/" in key:
            raise InputError(f"sample key {key!r}: expected no dot and no slash")
        offset = self.size
        written = b""
        positions = {}
        for name, content in sorted({"json": record, extension: data}.items()):
            positions[name] = (offset + len(written) + tarfile.BLOCKSIZE, len(content))
            written += member(f"{key}.{name}", content)
        self._put(written)
        digest = hashlib.sha256(written).digest()
        return Span(offset, len(written), positions["json"], positions[extension], digest)

    def close_with_checksum(self) -> str:
        """Write the end of the archive; return the SHA-256 of the whole file in hexadecimal."""
        end = self.size + 2 * tarfile.BLOCKSIZE
        self._put(bytes(2 * tarfile.BLOCKSIZE + -end % RECORD))
        return self._hash.hexdigest()
