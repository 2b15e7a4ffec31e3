"""A process keeps the memory of arrays that it has freed, so that the next ones need not fetch theirs page by page.

A sample with effects makes dozens of arrays of a few megabytes. By default the allocator hands each of them back to
the system, which then gives zeroed pages one by one, for up to half of the sample's time.
"""

from functools import cache

import numpy as np

LARGEST = 31 << 20
"""Size (bytes) of the largest array whose memory is kept; the allocator takes no larger value than 32 MB."""


@cache
def keep_freed() -> None:
    """Make the allocator keep up to twice LARGEST of what arrays free, once a process.

    glibc follows a program: from the first freed array of this size on, it takes arrays up to that size from its own
    heap, and returns memory to the system only where twice as much is free. Other allocators are left as they are, and
    so is one whose thresholds the user has set.
    Source: mallopt(3), M_MMAP_THRESHOLD and M_TRIM_THRESHOLD, the dynamic adjustment.
    """
    np.empty(LARGEST, np.uint8)
