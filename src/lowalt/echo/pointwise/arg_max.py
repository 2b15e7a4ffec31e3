"""The choice of the strongest range cell among computed sums, as both kernels make it.

Each kernel has its own bound for the cells that it did not compute.
"""

import math

from lowalt.machine.jit import INNER

NEAR_TIE = 1e-12
"""Relative gap below which the two strongest cells count as a near-tie."""


@INNER
def strongest_of(sums, first, last):
    """Return (largest |sum|, second largest, row of the largest) of rows first..last of sums.

    sums: (cells, 2), columns real and imaginary part. Of equal sums the first row wins. The second
    largest is -1 where only one row is given.
    """
    best = -1.0
    second = -1.0
    which = first
    for j in range(first, last + 1):
        strength = sums[j, 0] * sums[j, 0] + sums[j, 1] * sums[j, 1]
        if strength > best:
            second = best
            best = strength
            which = j
        elif strength > second:
            second = strength
    if second > 0.0:
        second = math.sqrt(second)
    return math.sqrt(best), second, which
