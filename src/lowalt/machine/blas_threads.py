"""Limits BLAS to one thread where last bits must not depend on the number of threads.

With another number of threads, BLAS splits matrix products and sums differently, which changes the
last bits. For the small products here, more threads are also slower while other processes use the
cores.
"""

import contextlib
from collections.abc import Iterator
from functools import cache
from typing import Any


@cache
def _controller() -> Any:
    """Controller of the loaded BLAS libraries; cached, because finding them takes milliseconds."""
    import numpy  # noqa: F401, so that its BLAS is loaded
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextlib.contextmanager
def one_blas_thread() -> Iterator[None]:
    """Run the block with one BLAS thread; blocks may be nested.

    The limit is per process, so it does not hold if several Python threads use such blocks at the
    same time.
    Source: threadpoolctl.
    """
    with _controller().limit(limits=1, user_api="blas"):
        yield
