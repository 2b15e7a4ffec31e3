"""Memory that arrays have freed stays with the process: the next arrays fetch no pages from the system."""

import os
import platform
import subprocess
import sys

PROBE = """
import resource, sys
import numpy as np
from lowalt.machine.memory import keep_freed_arrays

def fetched():
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(10):
        arrays = [np.ones(200_000) for _ in range(4)]
        del arrays
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before

fetched()
first = fetched()
if sys.argv[1] == "keep":
    keep_freed_arrays()
fetched()
print(first, fetched())
"""
PAGES = 10 * 4 * 200_000 * 8 // 4096
"""Pages that all the arrays of `fetched` fill."""


def pages(what, **more):
    """Pages that arrays fetched before and after `keep_freed_arrays`, or before and after nothing."""
    plain = {key: value for key, value in os.environ.items() if not key.startswith(("MALLOC_", "GLIBC_TUNABLES"))}
    done = subprocess.run([sys.executable, "-c", PROBE, what], env=plain | more, check=True, capture_output=True)
    return [int(word) for word in done.stdout.split()]


def test_arrays_fetch_no_pages_once_freed_memory_is_kept():
    before, after = pages("keep")
    if platform.libc_ver()[0] == "glibc" and os.sysconf("SC_PAGE_SIZE") == 4096:
        # Without this there would be nothing to keep.
        assert pages("nothing")[1] > 0.5 * PAGES
        assert after < 0.01 * PAGES
    assert after <= before


def test_thresholds_that_the_user_has_set_stay():
    before, after = pages("keep", MALLOC_TRIM_THRESHOLD_="131072")
    assert after > 0.5 * before
