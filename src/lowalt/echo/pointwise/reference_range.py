"""Range of one reference point a symbol in double-double arithmetic: the only place that needs more than a double.

Every other point's range is this one plus a difference that a double holds to its last digit, so phase errors do
not grow with range. Compiled without any fast-math flag: the compensations below must not be simplified away.
"""

import math

import numpy as np

from lowalt.common.jit import LEAN


@LEAN
def _two_sum(a, b):
    s = a + b
    t = s - a
    return s, (a - (s - t)) + (b - t)


@LEAN
def _two_product(a, b):
    p = a * b
    x = 134217729.0 * a
    a_high = x - (x - a)
    a_low = a - a_high
    y = 134217729.0 * b
    b_high = y - (y - b)
    b_low = b - b_high
    return p, ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low


@LEAN
def _fraction(r, r_lo, k, k_lo):
    """Whole part and fraction, within about [-1/2, 1/2], of (r + r_lo) (k + k_lo)."""
    p, q = _two_product(r, k)
    whole = np.rint(p)
    return whole, (p - whole) + (q + (r * k_lo + r_lo * k))


@LEAN
def _fill(place, station, turns, turns_lo, cells, cells_lo, out):
    for n in range(len(place)):
        h2, h2_lo = 0.0, 0.0
        for i in range(3):
            d, d_lo = _two_sum(place[n, i], -station[i])
            out[n, i] = d
            p, q = _two_product(d, d)
            h2, more = _two_sum(h2, p)
            h2_lo += more + q + 2.0 * d * d_lo
        r = math.sqrt(h2)
        r_lo = 0.0
        if r > 0.0:
            p, q = _two_product(r, r)
            r_lo = ((h2 - p) - q + h2_lo) / (2.0 * r)
        out[n, 3] = r
        _, out[n, 4] = _fraction(r, r_lo, turns, turns_lo)
        out[n, 5], out[n, 6] = _fraction(r, r_lo, cells, cells_lo)


def reference(place, station, turns, turns_lo, cells, cells_lo) -> np.ndarray:
    """Return the reference geometry of every symbol, (N, 7).

    place: (N, 3) m, a point near the target; station: (3,) m. Columns: vector from the station (m, 3), range (m),
    fraction of a turn of its phase, nearest whole range cell, and the rest of the range in cells.
    """
    out = np.empty((len(place), 7))
    _fill(place, station, turns, turns_lo, cells, cells_lo, out)
    return out
