"""How kernels are compiled: once on each machine, kept on disk, and again if the code that a kernel runs changes.

numba's own cache looks at the file of a function only. It does not look at the functions that it calls in other
files, so an edit there would leave old machine code in use. Here the key of every cache entry holds a digest of the
kernel's bytecode and options, of all kernels and constants that it uses, of those that these use, and so on. Code that
is not compiled has no part in it. Whether products are fused and sums reordered is said for every kernel, and numba's
own parts, such as the product of complex numbers, are compiled for each set of options by themselves: else the first
kernel of a process to call a function would decide how that function rounds in all others.
"""

import hashlib
from collections.abc import Callable, Iterator
from types import CodeType, FunctionType, ModuleType
from typing import Any

import numpy as np
from numba import njit
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher
from numba.core.registry import CPUDispatcher, cpu_target
from numba.core.runtime import rtsys
from numba.core.targetconfig import ConfigStack


def _text_of(value) -> str:
    """Return a constant as text that is the same in every process."""
    if isinstance(value, (set, frozenset)):
        return f"set {sorted(map(_text_of, value))}"
    if isinstance(value, tuple):
        return f"({', '.join(map(_text_of, value))})"
    if isinstance(value, np.ndarray):
        return f"array {value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    return repr(value)


def _used(function: FunctionType) -> Iterator[tuple[str, object]]:
    """Yield the names and values of globals, of attributes of modules, and of outer variables that a function uses."""
    code = function.__code__
    for name in code.co_names:
        value = function.__globals__.get(name)
        if isinstance(value, ModuleType):
            held = vars(value)
            yield from ((f"{name}.{inner}", held[inner]) for inner in code.co_names if inner in held)
        elif value is not None:
            yield name, value
    for name, cell in zip(code.co_freevars, function.__closure__ or (), strict=True):
        yield name, cell.cell_contents


def _options_of(options: dict) -> str:
    """Return the options of a kernel as text."""
    return f"{[(option, _text_of(options[option])) for option in sorted(options)]}"


def _parts(function: FunctionType, seen: set[str]) -> Iterator[str]:
    """Yield as text everything that determines the machine code of `function`; each kernel that it calls comes once."""
    name = f"{function.__module__}.{function.__qualname__}"
    if name in seen:
        return
    seen.add(name)
    code = function.__code__
    yield f"{name} {code.co_code.hex()} {code.co_names} {code.co_varnames}"
    for value in code.co_consts:
        if isinstance(value, CodeType):
            yield f"{value.co_code.hex()} {_text_of(value.co_consts)} {value.co_names}"
        elif value != function.__doc__:
            yield _text_of(value)
    for label, value in _used(function):
        if isinstance(value, Dispatcher):
            yield f"{label} {_options_of(value.targetoptions)}"
            yield from _parts(value.py_func, seen)
        elif isinstance(value, type) and hasattr(value, "_fields"):
            yield f"{label} {value._fields}"
        elif isinstance(value, (bool, int, float, complex, str, tuple, np.ndarray, np.generic)):
            yield f"{label} {_text_of(value)}"


def _fields(kind) -> tuple:
    """Return the names of the fields of a named tuple's type, of those inside it, and so on, in their order."""
    return (getattr(kind, "fields", ()), *map(_fields, getattr(kind, "types", ())))


def digest(function: FunctionType, options: dict | None = None) -> str:
    """Return the SHA-256 of a kernel's bytecode and options, and of all kernels and constants that it uses."""
    total = hashlib.sha256(_options_of(options or {}).encode())
    for part in _parts(function, set()):
        total.update(part.encode() + b"\0")
    return total.hexdigest()


class _PartsByOptions(dict):
    """numba's own parts of kernels by their names, types, and how freely the kernel that asks for one may round."""

    def _key(self, key):
        """The key together with the options of the kernel that is being compiled."""
        stack = ConfigStack()
        return key, str(stack.top().fastmath) if stack else ""

    def get(self, key, default=None):
        """Return the part that was compiled for these options, or `default`."""
        return super().get(self._key(key), default)

    def __getitem__(self, key):
        return super().__getitem__(self._key(key))

    def __setitem__(self, key, value):
        super().__setitem__(self._key(key), value)


cpu_target.target_context.cached_internal_func = _PartsByOptions()


class _DigestCache(FunctionCache):
    """Numba's cache on disk, with the digest of everything compiled in its keys."""

    options: dict[str, Any] | None = None
    """How the function is compiled."""

    def _index_key(self, sig, codegen):
        """Numba's key, the digest of code and options, and the fields of named tuples among the arguments."""
        return *super()._index_key(sig, codegen), digest(self._py_func, self.options), tuple(map(_fields, sig))

    def load_overload(self, sig, target_context):
        """Return finished machine code for a signature, or None where none is kept."""
        # numba's method first loads everything that a compilation may need, scipy.linalg included, which takes a third
        # of a job's start. Finished machine code needs at most the runtime of counted references; compilation loads
        # the rest.
        if self.options["_nrt"]:
            rtsys.initialize(target_context)
        with self._guard_against_spurious_io_errors():
            try:
                return self._load_overload(sig, target_context)
            except (ImportError, AttributeError):
                # The list of kept code names types of arguments; it is unreadable once one of them has moved.
                self.flush()
        return None


class _Inner(CPUDispatcher):
    """A kernel that only kernels call: it is compiled without an entry for Python."""

    def __call__(self, *_arguments, **_named):
        """Raise TypeError: without this, numba would jump to an entry that is not there."""
        raise TypeError(f"{self.py_func.__qualname__} has no entry for Python, only kernels call it")


_DEFAULTS: dict[str, Any] = {"fastmath": False, "error_model": "python", "_nrt": True}
"""Options of every kernel: one that is not given, numba takes from the kernel that is the first to ask for this one."""


def kernel(inner: bool = False, **options) -> Callable:
    """Return a decorator like `numba.njit(**options)` whose on-disk cache follows everything that is compiled.

    inner: only kernels call the function. Calling it from Python raises TypeError.
    """
    # Entries for Python and for C take a fifth of all compilation. No kernel is ever handed to C.
    options = _DEFAULTS | options | {"no_cfunc_wrapper": True, "no_cpython_wrapper": inner}

    def wrap(function: Callable) -> Callable:
        """Compile a function and give it a cache of this module."""
        compiled = njit(**options)(function)
        compiled._cache = _DigestCache(function)
        compiled._cache.options = options
        if inner:
            compiled.__class__ = _Inner
        return compiled

    return wrap


PLAIN = kernel()
"""Every operation is done as written."""
_LEAN: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
LEAN = kernel(**_LEAN)
"""As PLAIN, but without counted references, which took a quarter of the time. Such a function cannot allocate."""
INNER = kernel(inner=True, **_LEAN)
"""As LEAN, for functions that only kernels call."""
INLINED = kernel(inner=True, forceinline=True, **_LEAN)
"""As INNER, and copied into its callers, so that named tuples of arrays are not copied at each call."""
_REORDERED = {"contract", "reassoc", "nsz"}
VECTOR = kernel(fastmath=_REORDERED, **_LEAN)
"""As LEAN, and the compiler may reorder sums and fuse products, so that loops become vector instructions."""
INNER_VECTOR = kernel(inner=True, fastmath=_REORDERED, **_LEAN)
"""As VECTOR, for functions that only kernels call."""
ORDERED = kernel(fastmath={*_REORDERED, "nnan"}, **_LEAN)
"""As VECTOR, and no number is expected to be none, so that least and largest values become vector instructions."""
INNER_ORDERED = kernel(inner=True, fastmath={*_REORDERED, "nnan"}, **_LEAN)
"""As ORDERED, for functions that only kernels call."""
