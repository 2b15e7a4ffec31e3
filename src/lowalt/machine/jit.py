"""Compilation of kernels: at the first call, once per machine, and again after a change of code.

numba's own cache only checks the file of a function, not the functions that it calls in other
files, so after an edit there old machine code would stay in use. Here the key of a cache entry
contains a digest of the kernel's bytecode and options and, recursively, of all kernels and
constants that it uses. Code that is not compiled is not part of the key. `machine_code.py`
compiles. numba takes half a second to import, so a command without kernels does not import it.
"""

import functools
import hashlib
from collections.abc import Callable, Iterator
from types import CodeType, ModuleType
from typing import Any

import numpy as np


def _text_of(value) -> str:
    """Return a constant as text that is the same in every process."""
    if isinstance(value, (set, frozenset)):
        return f"set {sorted(map(_text_of, value))}"
    if isinstance(value, tuple):
        return f"({', '.join(map(_text_of, value))})"
    if isinstance(value, np.ndarray):
        return f"array {value.dtype} {value.shape} {hashlib.sha256(value.tobytes()).hexdigest()}"
    return repr(value)


def _used(function: Any) -> Iterator[tuple[str, object]]:
    """Yield names and values of globals, module attributes and outer variables of a function."""
    code = function.__code__
    for name in code.co_names:
        value = function.__globals__.get(name)
        if isinstance(value, ModuleType):
            held = vars(value)
            yield from (
                (f"{name}.{inner}", held[inner]) for inner in code.co_names if inner in held
            )
        elif value is not None:
            yield name, value
    for name, cell in zip(code.co_freevars, function.__closure__ or (), strict=True):
        yield name, cell.cell_contents


def _options_of(options: dict) -> str:
    """Return the options of a kernel as text."""
    return f"{[(option, _text_of(options[option])) for option in sorted(options)]}"


def _parts(function: Any, seen: set[str]) -> Iterator[str]:
    """Yield as text all that determines the machine code of `function`, each called kernel once."""
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
        if isinstance(value, Kernel):
            yield f"{label} {_options_of(value.options)}"
            yield from _parts(value.function, seen)
        elif isinstance(value, type) and hasattr(value, "_fields"):
            yield f"{label} {value._fields}"
        elif isinstance(value, (bool, int, float, complex, str, tuple, np.ndarray, np.generic)):
            yield f"{label} {_text_of(value)}"


def digest(function: Callable, options: dict | None = None) -> str:
    """Return the SHA-256 of a kernel's bytecode and options, and of what it calls and uses."""
    total = hashlib.sha256(_options_of(options or {}).encode())
    for part in _parts(function, set()):
        total.update(part.encode() + b"\0")
    return total.hexdigest()


_DEFAULTS: dict[str, Any] = {"fastmath": False, "error_model": "python", "_nrt": True}
"""Options of every kernel. numba would take missing ones from the first kernel that calls this one.
"""


class Kernel:
    """A function that numba compiles at the first call, or when a kernel that uses it is compiled.

    function: what is compiled; options: those of numba's `njit`; inner: whether only kernels call
    it.
    """

    def __init__(self, function: Callable, options: dict[str, Any], inner: bool):
        functools.update_wrapper(self, function)
        self.function = function
        self.options = options
        self.inner = inner

    @functools.cached_property
    def dispatcher(self) -> Any:
        """numba's dispatcher of the function."""
        from lowalt.machine.machine_code import dispatcher

        return dispatcher(
            self.function, self.options, functools.partial(digest, self.function, self.options)
        )

    @property
    def _numba_type_(self) -> Any:
        """The type by which numba knows the dispatcher where a kernel uses this one."""
        return self.dispatcher._numba_type_

    def __call__(self, *arguments: Any) -> Any:
        """Run the machine code.

        Raises: TypeError for an inner kernel, which has no entry that Python could jump to.
        """
        if self.inner:
            raise TypeError(
                f"{self.function.__qualname__} has no entry for Python, only kernels call it"
            )
        return self.dispatcher(*arguments)


def kernel(inner: bool = False, **options) -> Callable[[Callable], Kernel]:
    """Return a decorator like `numba.njit(**options)` that compiles later and keeps machine code.

    The code is kept by its digest.
    inner: only kernels call the function. Calling it from Python raises TypeError.
    """
    # Entry points for Python and C take a fifth of the compilation time. No kernel is passed to C.
    options = _DEFAULTS | options | {"no_cfunc_wrapper": True, "no_cpython_wrapper": inner}
    return lambda function: Kernel(function, options, inner)


PLAIN = kernel()
"""Every operation is done as written."""
_LEAN: dict[str, Any] = {"error_model": "numpy", "_nrt": False}
LEAN = kernel(**_LEAN)
"""As PLAIN, but without reference counting, which took a quarter of the time. Such a function
cannot allocate.
"""
INNER = kernel(inner=True, **_LEAN)
"""As LEAN, for functions that only kernels call."""
INLINED = kernel(inner=True, forceinline=True, **_LEAN)
"""As INNER, and copied into its callers, so that named tuples of arrays are not copied at each
call.
"""
_REORDERED = {"contract", "reassoc", "nsz"}
VECTOR = kernel(fastmath=_REORDERED, **_LEAN)
"""As LEAN, and the compiler may reorder sums and fuse products, so that it can vectorise loops."""
INNER_VECTOR = kernel(inner=True, fastmath=_REORDERED, **_LEAN)
"""As VECTOR, for functions that only kernels call."""
_ORDERED = {"nnan", "nsz"}
ORDERED = kernel(fastmath=_ORDERED, **_LEAN)
"""As LEAN, and neither NaN nor the sign of a zero matters, so that minima and maxima can be
vectorised; sums keep their order.
"""
INNER_ORDERED = kernel(inner=True, fastmath=_ORDERED, **_LEAN)
"""As ORDERED, for functions that only kernels call."""
