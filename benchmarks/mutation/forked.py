"""Runs of tests in a copy of the tree, by a child of this process that has the large libraries loaded already.

Starting Python and loading numpy, numba and pytest takes longer than most tests; a child made by `fork` has them.
"""

import importlib
import os
import resource
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import pytest
from numba.core import caching

LIBRARIES = ("numpy", "numba.core.compiler", "scipy.signal", "scipy.stats", "scipy.linalg", "scipy.special", "yaml",
             "jsonschema", "PIL.Image", "hypothesis.strategies", "hypothesis.extra.numpy", "pandas")  # fmt: skip
TRAINING = ("torch", "timm")


def load(names: tuple[str, ...] = LIBRARIES) -> None:
    """Load libraries, so that children have them."""
    for name in names:
        importlib.import_module(name)


class Limits(NamedTuple):
    """`processor_s`: processor time of the process that runs tests, and as much of each process that it starts;
    `wall_s`: time on the clock until all of them are stopped."""

    processor_s: int
    wall_s: float


def run_tests(tree: Path, tests: list[str], limits: Limits, edited: Path, good: bytes) -> int | None:
    """Run tests in `tree` until one fails; return pytest's status, or None where the time on the clock was too short.

    A process that runs out of processor time is ended by SIGXCPU: the status is then the number of this signal with a
    minus sign. A process started by a test that ends so fails its test.
    `edited`: the file with a fault in it; `good`: the SHA-256 of it without. Where all kernels are the package's own,
    Numba takes the file for the good one, or it would throw away all machine code of the file; their keys tell which of
    them the fault is in.
    """
    child = os.fork()
    if child == 0:
        _child(tree, tests, limits.processor_s, str(edited), good)
    until = time.monotonic() + limits.wall_s
    status = None
    while status is None and time.monotonic() < until:
        time.sleep(0.02)
        done, ended = os.waitpid(child, os.WNOHANG)
        status = os.waitstatus_to_exitcode(ended) if done else None
    # What the tests started may still run.
    with suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    if status is None:
        os.waitpid(child, 0)
    return status


def _child(tree: Path, tests: list[str], processor_s: int, edited: str, good: bytes) -> None:
    """Become a process that knows the package of `tree` alone, run pytest, and end."""
    status = 3
    try:
        os.setsid()
        _, most = resource.getrlimit(resource.RLIMIT_CPU)
        resource.setrlimit(resource.RLIMIT_CPU, (processor_s, most))
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
