"""Variables of MATLAB and HDF5 files, read in a process of their own: scipy's and HDF5's readers
crash on some damaged files.

    python mat_files.py FILE.mat OUT.npz

The archive holds the numeric variables as `0`, `1`, ... and `names`, a JSON list of their names. A
field of a struct is named `struct.field`, an array in a group of HDF5 `group.array`. MATLAB files
of version 7.3 are HDF5.
"""

import json
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from lowalt.files.errors import InputError, install_command

NUMERIC = "biufc"
"""Kinds of arrays that samples can be."""
DEEPEST = 8
"""Structs inside structs that are followed."""
INFLATED = 1100
"""Largest size of a variable over its file's: HDF5 compresses to a thousandth at most, more is not
in the file.
"""
HDF5 = b"\x89HDF\r\n\x1a\n"


def read_mat(path: Path) -> dict[str, np.ndarray]:
    """Return the numeric variables of a MATLAB or HDF5 file by name.

    Raises: InputError naming the file where it cannot be read.
    """
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "variables.npz"
        # By its path, so that the process does not import the rest of this room.
        line = [sys.executable, "-P", __file__, str(path), str(out)]
        ended = subprocess.run(line, capture_output=True, text=True, errors="replace")
        if ended.returncode:
            reason = ended.stderr.strip().splitlines()[-1:] or [
                f"the reader ended with {ended.returncode}"
            ]
            raise InputError(f"{path}: not a readable {path.suffix} file ({reason[0][:200]})")
        with np.load(out, allow_pickle=False) as data:
            names = json.loads(str(data["names"]))
            return {name: data[str(number)] for number, name in enumerate(names)}


def _fields(name: str, value: object, depth: int = 0) -> Iterator[tuple[str, np.ndarray]]:
    """Name and array of each numeric value below a variable of an older file."""
    dtype = getattr(value, "dtype", None)
    if dtype is not None and dtype.names and value.size == 1 and depth < DEEPEST:
        for field in dtype.names:
            yield from _fields(f"{name}.{field}", value[field].flat[0], depth + 1)
    elif getattr(dtype, "kind", "") in NUMERIC:
        yield name, value


def _old(source: str) -> dict[str, np.ndarray]:
    """Numeric variables of a file up to version 7."""
    from scipy.io import loadmat

    variables = loadmat(source).items()
    return dict(
        pair
        for name, value in variables
        if not name.startswith("__")
        for pair in _fields(name, value)
    )


def _below(group, name: str, largest: int, depth: int = 0) -> Iterator[tuple[str, np.ndarray]]:
    """Name and array of each numeric value below a group; links and data outside the file are not
    followed.
    """
    import h5py

    for key in group:
        if key.startswith("#") or not isinstance(group.get(key, getlink=True), h5py.HardLink):
            continue
        item = group[key]
        path = f"{name}{key}"
        if isinstance(item, h5py.Group):
            if depth < DEEPEST:
                yield from _below(item, f"{path}.", largest, depth + 1)
            continue
        pair = item.dtype.names == ("real", "imag")
        if item.attrs.get("MATLAB_class") == b"char" or not (pair or item.dtype.kind in NUMERIC):
            continue
        if item.external or item.is_virtual or item.nbytes > largest:
            sys.exit(f"{path} is not inside the file")
        values = item[()]
        yield path, values["real"] + 1j * values["imag"] if pair else values


def _new(source: str) -> dict[str, np.ndarray]:
    """Numeric variables of an HDF5 file; axes of MATLAB stand in the reverse of its order."""
    try:
        import h5py
    except ImportError:
        sys.exit(
            f"HDF5, as MATLAB writes with -v7.3, needs h5py, expected `{install_command('matlab')}`"
        )
    with h5py.File(source) as file:
        return dict(_below(file, "", INFLATED * Path(source).stat().st_size))


def main(arguments: list[str]) -> None:
    """Write the numeric variables of a MATLAB file into an archive of arrays."""
    source, out = arguments
    with Path(source).open("rb") as file:
        start = file.read(520)
    variables = _new(source) if HDF5 in (start[:8], start[512:]) else _old(source)
    arrays = {str(number): value for number, value in enumerate(variables.values())}
    np.savez(out, names=np.array(json.dumps(list(variables))), **arrays)


if __name__ == "__main__":
    main(sys.argv[1:])
