"""One thread for BLAS while something is computed whose last bits must not depend on the number of threads.

A BLAS with more threads cuts products of matrices and sums into other pieces, and their last bits change. It is also
slower for products as small as ours wherever other processes use the cores.
"""

import contextlib
import threading
from collections.abc import Iterator
from functools import cache
from typing import Any


class _Callers:
    """How many callers ask for one thread at the moment, and what gives the library its number back."""

    def __init__(self) -> None:
        self.lock, self.count = threading.Lock(), 0
        self.limited: Any = None

    def enter(self) -> None:
        """Let BLAS use one thread from the first caller on."""
        with self.lock:
            if self.count == 0:
                _take_over()
                self.limited = _controller().limit(limits=1, user_api="blas")
            self.count += 1

    def leave(self) -> None:
        """Give BLAS its threads back behind the last caller."""
        with self.lock:
            self.count -= 1
            if self.count == 0:
                _take_over()
                self.limited.restore_original_limits()
                _take_over()


@cache
def _controller() -> Any:
    """What sets the threads of the BLAS libraries that are loaded; looking for them takes milliseconds."""
    import numpy  # noqa: F401, so that its BLAS is loaded
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


def _take_over() -> None:
    """Let the calling thread be the one that counts: threadpoolctl heeds the first thread that sets a number alone."""
    for library in _controller().lib_controllers:
        if hasattr(library, "clear_controlling_thread"):
            library.clear_controlling_thread(force=True)


_CALLERS = _Callers()


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Compute the block with one thread of NumPy's BLAS; blocks may stand in each other and run in several threads.

    Source: threadpoolctl, which knows how each library is told.
    """
    _CALLERS.enter()
    try:
        yield
    finally:
        _CALLERS.leave()
