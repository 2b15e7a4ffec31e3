"""Runs of tests in a copy of the tree, by a child of this process that has the large libraries loaded already.

Starting Python and loading numpy, numba and pytest takes longer than most tests; a child made by `fork` has them.
"""

import importlib
import os
import sys
import time
from pathlib import Path

import pytest
from numba.core import caching

LIBRARIES = ("numpy", "numba.core.compiler", "scipy.signal", "scipy.stats", "scipy.linalg", "scipy.special", "yaml",
             "jsonschema", "PIL.Image", "hypothesis.strategies", "hypothesis.extra.numpy", "pandas")  # fmt: skip
TRAINING = ("torch", "timm")


def load(names: tuple[str, ...] = LIBRARIES) -> None:
    """Load libraries, so that children have them."""
    for name in names:
        importlib.import_module(name)


def run_tests(tree: Path, tests: list[str], limit: float, edited: Path, good: bytes) -> int | None:
    """Run tests in `tree` until one fails; return pytest's status, or None where `limit` seconds were too few.

    `edited`: the file with a fault in it; `good`: the SHA-256 of it without. Where all kernels are the package's own,
    Numba takes the file for the good one, or it would throw away all machine code of the file; their keys tell which of
    them the fault is in.
    """
    child = os.fork()
    if child == 0:
        _child(tree, tests, str(edited), good)
    until = time.monotonic() + limit
    while time.monotonic() < until:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            return os.waitstatus_to_exitcode(status)
        time.sleep(0.02)
    os.killpg(child, 9)
    os.waitpid(child, 0)
    return None


def _child(tree: Path, tests: list[str], edited: str, good: bytes) -> None:
    """Become a process that knows the package of `tree` alone, run pytest, and end."""
    status = 3
    try:
        os.setsid()
        os.chdir(tree)
        silent = os.open(os.devnull, os.O_RDWR)
        for stream in (0, 1, 2):
            os.dup2(silent, stream)
        for name in [name for name in sys.modules if name.startswith(("lowalt", "conftest", "test_"))]:
            del sys.modules[name]
        others = [path for path in sys.path if path and not path.endswith(("/src", "/benchmarks"))]
        sys.path[:] = [str(tree / "src"), *others]
        os.environ.update(PYTHONPATH=str(tree / "src"), PYTHONDONTWRITEBYTECODE="1")
        sys.dont_write_bytecode = False
        of_file = caching._hash_source_file
        if "cache=True" not in Path(edited).read_text(encoding="utf-8"):
            caching._hash_source_file = lambda path, *rest: good if path == edited else of_file(path, *rest)
        options = ["-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-p", "no:cov"]
        options += ["-m", "not slow and not workflow"]
        status = pytest.main([*options, *tests])
    finally:
        os._exit(int(status))
