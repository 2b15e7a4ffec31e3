"""Variables of MATLAB and HDF5 files, read in a process of their own: scipy's and HDF5's readers
crash on some damaged files.

    python mat_files.py FILE.mat OUT.npz MOST

Its variables have at most MOST bytes. The archive holds the numeric variables as `0`, `1`, ... and `names`, a JSON list of their names. A
field of a struct is named `struct.field`, an array in a group of HDF5 `group.array`. MATLAB files
of version 7.3 are HDF5.
"""

import contextlib
import json
import subprocess
import sys
import tempfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np

from lowalt.files.array_files import most_expanded
from lowalt.files.errors import InputError, install_command
from lowalt.machine.memory import at_most

NUMERIC = "biufc"
"""Kinds of arrays that samples can be."""
DEEPEST = 8
"""Structs inside structs that are followed."""
MEMORY_BYTES = 1 << 29
MEMORY_COPIES = 6
"""Memory that a reader may take: this, and so many copies of the numbers of a file. Sizes that a
file states and does not have would take the machine's.
"""
COMPRESSED_MATRIX = 15
"""Type of a compressed variable in MATLAB's format 5. Source: MathWorks, MAT-File Format, table 1-1."""
CHUNK_BYTES = 1 << 20
HDF5 = b"\x89HDF\r\n\x1a\n"


def read_mat(path: Path) -> dict[str, np.ndarray]:
    """Return the numeric variables of a MATLAB or HDF5 file by name.

    Raises: InputError naming the file where it cannot be read.
    """
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "variables.npz"
        # By its path, so that the process does not import the rest of this room.
        most = most_expanded(path.stat().st_size)
        line = [sys.executable, "-P", __file__, str(path), str(out), str(most)]
        ended = subprocess.run(line, capture_output=True, text=True, errors="replace")
        if ended.returncode:
            reason = ended.stderr.strip().splitlines()[-1:] or [
                f"the reader ended with {ended.returncode}"
            ]
            raise InputError(f"{path}: not a readable {path.suffix} file ({reason[0][:200]})")
        with np.load(out, allow_pickle=False) as data:
            names = json.loads(str(data["names"]))
            return {name: data[str(number)] for number, name in enumerate(names)}


def _fields(name: str, value: Any, depth: int = 0) -> Iterator[tuple[str, np.ndarray]]:
    """Name and array of each numeric value below a variable of an older file."""
    dtype = getattr(value, "dtype", None)
    if dtype is not None and dtype.names and value.size == 1 and depth < DEEPEST:
        for field in dtype.names:
            yield from _fields(f"{name}.{field}", value[field].flat[0], depth + 1)
    elif getattr(dtype, "kind", "") in NUMERIC:
        yield name, value


def _refuse_expanding(source: str, most: int) -> None:
    """End this process where the compressed variables of a file of format 5 expand to more than
    `most` bytes in all; nothing that is unpacked here is kept.
    """
    total = 0
    with Path(source).open("rb") as file:
        head = file.read(128)
        order: Literal["big", "little"] = "big" if head[126:128] == b"MI" else "little"
        while len(tag := file.read(8)) == 8:
            kind = int.from_bytes(tag[:4], order)
            size = int.from_bytes(tag[4:], order)
            if kind != COMPRESSED_MATRIX:
                file.seek(size, 1)
                continue
            unpacker = zlib.decompressobj()
            while size and not unpacker.eof:
                data = file.read(min(size, CHUNK_BYTES))
                size -= len(data)
                if not data:
                    return
                while data and total <= most:
                    total += len(unpacker.decompress(data, CHUNK_BYTES))
                    data = unpacker.unconsumed_tail
                if total > most:
                    sys.exit(f"its variables expand to more than {most} bytes")
            file.seek(size, 1)


def _old(source: str, most: int) -> dict[str, np.ndarray]:
    """Numeric variables of a file up to version 7, at most `most` bytes when unpacked."""
    from scipy.io import loadmat

    with contextlib.suppress(zlib.error):  # the reader says what is damaged
        _refuse_expanding(source, most)
    with at_most(MEMORY_BYTES + MEMORY_COPIES * most):
        variables = loadmat(source).items()
    return dict(
        pair
        for name, value in variables
        if not name.startswith("__")
        for pair in _fields(name, value)
    )


def _below(
    group, name: str, left: list[int], seen: set, depth: int = 0
) -> Iterator[tuple[str, np.ndarray]]:
    """Name and array of each numeric value below a group; links and data outside the file are not
    followed, and a group that stands in itself is entered once.

    left: the bytes that values may still have, a list of one.
    """
    import h5py

    for key in group:
        if key.startswith("#") or not isinstance(group.get(key, getlink=True), h5py.HardLink):
            continue
        item = group[key]
        path = f"{name}{key}"
        if isinstance(item, h5py.Group):
            place = h5py.h5o.get_info(item.id).addr
            if depth < DEEPEST and place not in seen:
                seen.add(place)
                yield from _below(item, f"{path}.", left, seen, depth + 1)
            continue
        pair = item.dtype.names == ("real", "imag")
        if item.attrs.get("MATLAB_class") == b"char" or not (pair or item.dtype.kind in NUMERIC):
            continue
        if item.external or item.is_virtual:
            sys.exit(f"{path} is not inside the file")
        left[0] -= item.nbytes
        if left[0] < 0:
            sys.exit(f"{path} has {item.nbytes} bytes, more than the file can hold")
        values = item[()]
        yield path, values["real"] + 1j * values["imag"] if pair else values


def _new(source: str, most: int) -> dict[str, np.ndarray]:
    """Numeric variables of an HDF5 file, at most `most` bytes; axes of MATLAB stand in the reverse
    of its order.
    """
    try:
        import h5py
    except ImportError:
        sys.exit(
            f"HDF5, as MATLAB writes with -v7.3, needs h5py, expected `{install_command('matlab')}`"
        )
    with at_most(MEMORY_BYTES + MEMORY_COPIES * most), h5py.File(source) as file:
        return dict(_below(file, "", [most], set()))


def main(arguments: list[str]) -> None:
    """Write the numeric variables of a MATLAB file into an archive of arrays."""
    source, out, most = arguments
    with Path(source).open("rb") as file:
        start = file.read(520)
    read = _new if HDF5 in (start[:8], start[512:]) else _old
    variables = read(source, int(most))
    arrays: dict[str, Any] = {str(number): value for number, value in enumerate(variables.values())}
    try:
        np.savez(out, names=np.array(json.dumps(list(variables))), **arrays)
    except OSError:
        sys.exit(f"no room for its arrays in {Path(out).parents[1]}, expected another TMPDIR")


if __name__ == "__main__":
    main(sys.argv[1:])
