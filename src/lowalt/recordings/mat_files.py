"""Variables of MATLAB files, read in a process of their own: scipy's reader crashes on some damaged files.

    python -m lowalt.recordings.mat_files FILE.mat OUT.npz

The archive holds the numeric variables as `0`, `1`, ... and `names`, a JSON list of their names.
"""

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from lowalt.common.errors import InputError

NUMERIC = "biufc"
"""Kinds of arrays that samples can be."""


def read_mat(path: Path) -> dict[str, np.ndarray]:
    """Return the numeric variables of a MATLAB file by name.

    Raises: InputError naming the file where it cannot be read.
    """
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "variables.npz"
        line = [sys.executable, "-m", "lowalt.recordings.mat_files", str(path), str(out)]
        found = subprocess.run(line, capture_output=True, text=True, errors="replace")
        if found.returncode:
            reason = found.stderr.strip().splitlines()[-1:] or [f"the reader ended with {found.returncode}"]
            raise InputError(f"{path}: not a readable .mat file ({reason[0][:200]})")
        with np.load(out, allow_pickle=False) as data:
            names = json.loads(str(data["names"]))
            return {name: data[str(number)] for number, name in enumerate(names)}


def main(arguments: list[str]) -> None:
    """Write the numeric variables of a MATLAB file into an archive of arrays."""
    from scipy.io import loadmat

    source, out = arguments
    held = {
        name: value
        for name, value in loadmat(source).items()
        if not name.startswith("__") and getattr(getattr(value, "dtype", None), "kind", "") in NUMERIC
    }
    arrays = {str(number): value for number, value in enumerate(held.values())}
    np.savez(out, names=np.array(json.dumps(list(held))), **arrays)


if __name__ == "__main__":
    main(sys.argv[1:])
