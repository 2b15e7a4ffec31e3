"""Memory of a process: blocks that arrays have freed stay with it, so that the next arrays fetch no pages.

By default the C library hands each large freed block back to the system, which then gives zeroed pages one by one: for
up to half of the time of a sample with effects. Both functions work with glibc; with other C libraries nothing changes.
"""

import contextlib
import ctypes
import math
from functools import cache

import numpy as np

LARGEST = 31 << 20
"""Size (bytes) of the largest block that `keep_freed_arrays` keeps; glibc raises its threshold to 32 MB at most."""


def keep_freed_memory() -> None:
    """Let the C library keep freed blocks of any size, in a process that is the project's own.

    A stage frees arrays of the same sizes for each sample, and training frees its activations in each step.
    """
    with contextlib.suppress(OSError, AttributeError):
        mallopt = ctypes.CDLL(None).mallopt
        mmap_threshold, trim_threshold = -3, -1
        mallopt(mmap_threshold, 1 << 30)
        mallopt(trim_threshold, (1 << 31) - 1)


@cache
def keep_freed_arrays() -> None:
    """Let the C library keep up to twice LARGEST of what arrays free, once, in a process that may be a caller's.

    glibc follows a program: from the first freed block of this size on, it takes blocks up to that size from its own
    heap, and returns memory to the system only where twice as much is free. A process that has set its thresholds, as
    `keep_freed_memory` does, is left as it is.
    Source: mallopt(3), M_MMAP_THRESHOLD and M_TRIM_THRESHOLD, the dynamic adjustment.
    """
    np.empty(LARGEST, np.uint8)


LINE = 64
"""Bytes of a line of the cache."""


def aligned(*shape: int) -> np.ndarray:
    """Return a new float64 array of this shape that begins with a line of the cache, for work space of compiled loops.

    NumPy's arrays begin 16 bytes behind such a line, so that every second vector instruction would read two lines.
    """
    count = math.prod(shape)
    room = np.empty(count + LINE // 8)
    first = -room.__array_interface__["data"][0] % LINE // 8
    return room[first : first + count].reshape(shape)


def aligned_complex(*shape: int) -> np.ndarray:
    """Return a new complex128 array of this shape that begins with a line of the cache."""
    return aligned(*shape[:-1], 2 * shape[-1]).view(np.complex128)


def aligned_copy(values: np.ndarray) -> np.ndarray:
    """Return float64 values of any shape in a new array that begins with a line of the cache."""
    result = aligned(*values.shape)
    result[...] = values
    return result
