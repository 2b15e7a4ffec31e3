"""Machine code of kernels, compiled by numba and cached by the digest of all code it runs.

Every kernel states whether products may be fused and sums reordered. numba's internal functions,
such as the product of complex numbers, are compiled separately for each set of options. Otherwise
the first kernel in a process to call a function would determine how that function rounds in all
others.
"""

import functools
import sys
from collections.abc import Callable
from typing import Any

from llvmlite.binding import Linkage
from numba import njit
from numba.core.caching import FunctionCache
from numba.core.codegen import CPUCodeLibrary
from numba.core.dispatcher import Dispatcher
from numba.core.registry import cpu_target
from numba.core.runtime import rtsys
from numba.core.targetconfig import ConfigStack

from lowalt.files.errors import InputError


def _fields(kind) -> tuple:
    """Return the names of the fields of a named tuple's type, and of those inside it, in order."""
    return (getattr(kind, "fields", ()), *map(_fields, getattr(kind, "types", ())))


class _ByOptions(dict):
    """numba's own functions by name, types, and how freely the asking kernel may round."""

    def _key(self, key):
        """The key together with the options of the kernel that is being compiled."""
        stack = ConfigStack()
        return key, str(stack.top().fastmath) if stack else ""

    def get(self, key, default=None):
        """Return the function that was compiled for these options, or `default`."""
        return super().get(self._key(key), default)

    def __getitem__(self, key):
        return super().__getitem__(self._key(key))

    def __setitem__(self, key, value):
        super().__setitem__(self._key(key), value)


# Fault: a kernel that is done as written may round like one that fuses products. No issue upstream.
# Cause: numba compiles its internal functions, such as the product of complex numbers, once for all
# kernels, with the options of the first. Held in: numba 0.68. Cure: one copy for each set of
# options.
cpu_target.target_context.cached_internal_func = _ByOptions()
_numba_finalizes = CPUCodeLibrary._finalize_final_module


def _finalize(library: CPUCodeLibrary) -> None:
    """Finish a kernel's machine code as numba does, but with its own copies of other functions."""
    # Fault: a kernel calls another copy of a function than it was compiled with. No issue upstream.
    # Held in numba 0.68.
    # Cause: by numba's linking, all kernels of a process share the copy of a function loaded first.
    # Copies round differently, since each is optimised with its kernel, and a process that compiles
    # loads other copies than one that finds its kernels in the cache. Even functions of two sources
    # are shared if they have the same name.
    # Cure: the copies are a kernel's own.
    functions = [
        function for function in library._final_module.functions if not function.is_declaration
    ]
    if functions:
        # Keep a copy of the module as it is, for kernels that call this one; numba makes it of
        # finished libraries only.
        library._finalized = True
        library._get_module_for_linking()
    for function in functions:
        if function.linkage == Linkage.linkonce_odr:
            function.linkage = Linkage.internal
    _numba_finalizes(library)


CPUCodeLibrary._finalize_final_module = _finalize


class _DigestCache(FunctionCache):
    """Numba's cache on disk, with the digest of everything compiled in its keys."""

    options: dict[str, Any]
    """How the function is compiled."""
    digest: Callable[[], str]
    """Gives the digest of all code that the function runs."""

    def _index_key(self, sig, codegen):
        """numba's key, the digest of code and options, the linking, fields of named tuples."""
        return (
            *super()._index_key(sig, codegen),
            self.digest(),
            "own functions",
            tuple(map(_fields, sig)),
        )

    def load_overload(self, sig, target_context):
        """Return finished machine code for a signature, or None where none is kept."""
        # numba's method first loads everything that a compilation may need, including scipy.linalg,
        # which takes a third of a job's start. Finished machine code needs at most the runtime of
        # reference counting; a compilation loads the rest.
        if self.options["_nrt"]:
            rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            try:
                kept = self._load_overload(sig, target_context)
                if kept is not None:
                    return kept
            except (ImportError, AttributeError):
                # The index of cached code names argument types; it is unreadable if one of them has
                # moved.
                self.flush()
        say_once()
        return None


@functools.cache
def say_once() -> None:
    """Print to standard error that kernels are being compiled."""
    print(
        "lowalt: compiling for this machine; the machine code is kept for later calls",
        file=sys.stderr,
        flush=True,
    )


def dispatcher(
    function: Callable, options: dict[str, Any], digest: Callable[[], str]
) -> Dispatcher:
    """Return numba's dispatcher of a function, with the cache of this module.

    options: those of `njit`; digest: gives the digest of all code that the function runs, which the
    key needs.
    Raises: InputError where no folder can be written that keeps machine code.
    """
    compiled = njit(**options)(function)
    try:
        compiled._cache = _DigestCache(function)
    except RuntimeError:
        raise InputError(
            f"machine code can be kept neither beside {function.__code__.co_filename} nor in this "
            "user's cache, expected XDG_CACHE_HOME: a folder that this user may write"
        ) from None
    compiled._cache.options = options
    compiled._cache.digest = digest
    return compiled
