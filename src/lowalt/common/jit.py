"""How the kernels are compiled: once a machine, kept on disk, and anew whenever any kernel's source changes.

numba's own cache looks at the file of a function only, not at the functions it calls in other files: an edit there
would leave old machine code in use. Here the key of every entry holds a digest of the whole folder.
"""

import hashlib
from collections.abc import Callable
from pathlib import Path

from numba import njit
from numba.core.caching import FunctionCache
from numba.core.runtime import rtsys


def _digest() -> str:
    total = hashlib.sha256()
    for path in sorted((Path(__file__).parents[1] / "echo").rglob("*.py")):
        total.update(path.name.encode() + b"\0" + path.read_bytes())
    return total.hexdigest()


DIGEST = _digest()
"""SHA-256 of the folder's sources."""


class _SourceCache(FunctionCache):
    counted = True
    """Whether the function may use counted references, and so allocate."""

    def _index_key(self, sig, codegen):
        return (*super()._index_key(sig, codegen), DIGEST)

    def load_overload(self, sig, target_context):
        """Return finished machine code for a signature, or None; as numba's own, but for what it loads first."""
        # numba's own would first load everything that a compilation may need, scipy.linalg included: a third of a
        # job's start. Finished machine code needs the counted references' runtime at most; compilation loads the rest.
        if self.counted:
            rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def kernel(**options) -> Callable:
    """Return a decorator like `numba.njit(**options)` with an on-disk cache that follows all sources of the folder."""

    def wrap(function: Callable) -> Callable:
        compiled = njit(**options)(function)
        compiled._cache = _SourceCache(function)
        compiled._cache.counted = options.get("_nrt", True)
        return compiled

    return wrap


PLAIN = kernel()
"""Every operation as written."""
LEAN = kernel(error_model="numpy", _nrt=False)
"""Without counted references (they took a quarter of the time, and their runtime loads slowly), so no allocation."""
VECTOR = kernel(error_model="numpy", _nrt=False, fastmath={"contract", "reassoc", "nsz"})
"""Lean, and sums may be reordered and products fused: the loops become vector instructions."""
