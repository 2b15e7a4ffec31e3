"""How the kernels are compiled: once a machine, kept on disk, and anew whenever any kernel's source changes.

numba's own cache looks at the file of a function only, not at the functions it calls in other files: an edit there
would leave old machine code in use. Here the key of every entry holds a digest of the whole folder.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path

from numba import njit
from numba.core.caching import FunctionCache


def _digest() -> str:
    total = hashlib.sha256()
    for path in sorted(Path(__file__).parent.glob("*.py")):
        total.update(path.name.encode() + b"\0" + path.read_bytes())
    return total.hexdigest()


DIGEST = _digest()
"""SHA-256 of the folder's sources."""


class _SourceCache(FunctionCache):
    def _index_key(self, sig, codegen):
        return (*super()._index_key(sig, codegen), DIGEST)


def kernel(**options) -> Callable:
    """Return a decorator like `numba.njit(**options)` with an on-disk cache that follows all sources of the folder."""

    def wrap(function: Callable) -> Callable:
        compiled = njit(**options)(function)
        compiled._cache = _SourceCache(function)
        return compiled

    return wrap


PLAIN = kernel()
"""Every operation as written."""
LEAN = kernel(error_model="numpy", _nrt=False)
"""Without counted references (they took a quarter of the time), so without allocation."""
VECTOR = kernel(error_model="numpy", _nrt=False, fastmath={"contract", "reassoc", "nsz"})
"""Lean, and sums may be reordered and products fused: the loops become vector instructions."""
