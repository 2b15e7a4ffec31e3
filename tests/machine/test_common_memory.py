"""Memory that arrays have freed stays with the process: the next arrays fetch no pages from the
system.
"""

import os
import platform
import subprocess
import sys

import pytest

PROBE = """
import resource
import numpy as np
from lowalt.machine.memory import keep_freed_memory

def fetched():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(10):
        arrays = [np.ones(200_000) for _ in range(4)]
        del arrays
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

fetched()
first = fetched()
keep_freed_memory()
fetched()
print(first, fetched())
"""
PAGES = 10 * 4 * 200_000 * 8 // 4096
"""Pages that all the arrays of `fetched` fill."""


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="no glibc here")
def test_arrays_fetch_no_pages_once_freed_memory_is_kept():
    plain = {
        key: value
        for key, value in os.environ.items()
        if not key.startswith(("MALLOC_", "GLIBC_TUNABLES"))
    }
    done = subprocess.run([sys.executable, "-c", PROBE], env=plain, check=True, capture_output=True)
    before, after = map(int, done.stdout.split())
    pages = PAGES * 4096 / os.sysconf("SC_PAGE_SIZE")
    # Without this there would be nothing to keep.
    assert before > 0.5 * pages and after < 0.01 * pages
