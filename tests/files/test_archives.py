"""Archives of arrays: bytes that follow from the arrays alone, whatever Python and NumPy write
them.
"""

import hashlib
import sys

import numpy as np
import pytest

from lowalt.files import archives
from lowalt.files.errors import InputError

ARRAYS = {
    "points": np.arange(12.0).reshape(4, 3),
    "columns": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
    "names": np.array(["body", "wing"]),
    "empty": np.zeros((0, 0, 3)),
    "record": np.array('{"a": 1}'),
}
DIGEST = "3c47178ac28852c5e1ee3f8bd8ab3d4b4cbeac01bec9fe3a45cd3ad08dfa15c4"


def test_bytes_are_these_whatever_python_and_numpy(tmp_path):
    archives.write_arrays(tmp_path / "a.npz", ARRAYS)
    assert hashlib.sha256((tmp_path / "a.npz").read_bytes()).hexdigest() == DIGEST
    with np.load(tmp_path / "a.npz", allow_pickle=False) as data:
        assert list(data.files) == list(ARRAYS)
        assert all(
            (data[name] == array).all() and data[name].dtype == array.dtype
            for name, array in ARRAYS.items()
        )


@pytest.mark.skipif(sys.version_info < (3, 11, 4), reason="zipfile wrote other headers before")
def test_bytes_are_those_of_numpy(tmp_path):
    archives.write_arrays(tmp_path / "a.npz", ARRAYS)
    np.savez(tmp_path / "b.npz", **ARRAYS)
    assert (tmp_path / "a.npz").read_bytes() == (tmp_path / "b.npz").read_bytes()


def test_a_file_that_would_be_too_long_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(archives, "_LARGEST", 500)
    with pytest.raises(
        InputError, match=r"a\.npz: names would make the file longer than 500 bytes"
    ):
        archives.write_arrays(tmp_path / "a.npz", ARRAYS)
