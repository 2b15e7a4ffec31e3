"""Which terms of array sums of spherical waves are so small that they may be left out together."""

from lowalt.common.jit import LEAN


@LEAN
def least_of(size, allowed):
    """Return the least of the sizes (K,) that counts: those below it sum to at most `allowed`, nearly as many as may.

    It is a multiple of twice the mean share of what is allowed, found within an eighth.
    """
    most, least, higher, total = 0.0, 0.0, allowed / len(size), 0.0
    for i in range(len(size)):
        most = max(most, size[i])
    while allowed > 0.0 and total <= allowed and least <= most:
        least, higher, total = higher, 2.0 * higher, 0.0
        for i in range(len(size)):
            total += size[i] if size[i] < higher else 0.0
    step = 0.5 * least
    for _ in range(3):
        total = 0.0
        for i in range(len(size)):
            total += size[i] if size[i] < least + step else 0.0
        least += step if total <= allowed else 0.0
        step *= 0.5
    return least
