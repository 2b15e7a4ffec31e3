"""Memory of a process: blocks that arrays have freed stay with it, so that the next arrays fetch no pages.

By default the C library hands each large freed block back to the system, which then gives zeroed pages one by one: for
a fifth of the time of a sample with many effects. With other C libraries than glibc nothing changes.
"""

import contextlib
import ctypes


def keep_freed_memory() -> None:
    """Let the C library keep freed blocks of any size, in a process that is the project's own.

    A stage frees arrays of the same sizes for each sample, and training frees its activations in each step.
    Source: mallopt(3), M_MMAP_THRESHOLD and M_TRIM_THRESHOLD.
    """
    with contextlib.suppress(OSError, AttributeError):
        mallopt = ctypes.CDLL(None).mallopt
        mmap_threshold, trim_threshold = -3, -1
        mallopt(mmap_threshold, 1 << 30)
        mallopt(trim_threshold, (1 << 31) - 1)
