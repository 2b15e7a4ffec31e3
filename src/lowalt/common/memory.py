"""Memory of a process: the settings of the C library at its start."""

import contextlib
import ctypes


def keep_freed_memory() -> None:
    """Let the C library keep large freed blocks instead of returning each to the system.

    A stage frees arrays of the same sizes for each sample, and training frees its activations in each step; mapping
    them again costs page faults. This works with glibc; with other C libraries nothing changes.
    """
    with contextlib.suppress(OSError, AttributeError):
        mallopt = ctypes.CDLL(None).mallopt
        mmap_threshold, trim_threshold = -3, -1
        mallopt(mmap_threshold, 1 << 30)
        mallopt(trim_threshold, (1 << 31) - 1)
