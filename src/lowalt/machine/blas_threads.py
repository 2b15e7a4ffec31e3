"""One thread for BLAS while something is computed whose last bits must not depend on the number of threads.

A BLAS with more threads cuts products of matrices and sums into other pieces, and their last bits change. It is also
slower for products as small as ours wherever other processes use the cores.
"""

import contextlib
from collections.abc import Iterator
from functools import cache
from typing import Any


@cache
def _controller() -> Any:
    """What sets the threads of the BLAS libraries that are loaded; looking for them takes milliseconds."""
    import numpy  # noqa: F401, so that its BLAS is loaded
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Compute the block with one thread of NumPy's BLAS; blocks may stand in each other.

    Blocks of several threads of one program may end with the others' number, so last bits may differ there.
    Source: threadpoolctl, which knows how each library is told.
    """
    with _controller().limit(limits=1, user_api="blas"):
        yield
