"""Kernels run by the interpreter: the same text as their machine code, without waiting for a compiler.

A test that calls a kernel this way is quick to start, may look into its work arrays, and tells which lines it runs.
"""

import math
from fractions import Fraction
from types import FunctionType, ModuleType, SimpleNamespace

from numba.core.dispatcher import Dispatcher

from lowalt.numerics.exact import arithmetic


def fused(a, b, c):
    """a b + c with one rounding; `arithmetic.fma` exists in compiled code alone."""
    return (
        float(Fraction(float(a)) * Fraction(float(b)) + Fraction(float(c))) if math.isfinite(a * b + c) else a * b + c
    )


def interpreted(kernel, **changes):
    """Return a kernel as a function of Python that calls all others as functions of Python.

    changes: names of its module to be replaced, there and in every kernel that it calls.
    """
    return _plain(kernel, changes, {})


def _plain(value, changes: dict, known: dict):
    """A kernel as a function of Python; any other value as it is."""
    if value is arithmetic.fma:
        return fused
    if not isinstance(value, Dispatcher):
        return value
    if value not in known:
        function = value.py_func
        names = dict(function.__globals__)
        known[value] = FunctionType(function.__code__, names, function.__name__, function.__defaults__)
        for name in function.__code__.co_names:
            held = names.get(name)
            if held is None:
                continue
            if name in changes:
                names[name] = changes[name]
            elif isinstance(held, ModuleType):
                inner = {key: _plain(thing, changes, known) for key, thing in vars(held).items()
                         if key in function.__code__.co_names or not isinstance(thing, Dispatcher)}  # fmt: skip
                names[name] = SimpleNamespace(**inner)
            else:
                names[name] = _plain(held, changes, known)
    return known[value]
