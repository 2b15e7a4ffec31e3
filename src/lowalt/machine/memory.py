"""Memory of a process: blocks that arrays have freed stay with it, so that the next arrays fetch no pages.

By default the C library hands each large freed block back to the system, which then gives zeroed pages one by one: for
up to half of the time of a sample with effects. Both functions work with glibc; with other C libraries nothing changes.
"""

import contextlib
import ctypes
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
