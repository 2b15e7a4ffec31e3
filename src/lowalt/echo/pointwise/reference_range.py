"""Range of one reference point for each symbol, in double-double arithmetic.

The range of any other point is this one plus a difference that a double represents accurately, so
phase errors do not grow with range. Compiled without fast-math flags, which would optimise the
corrections away.
"""

import math

import numpy as np

from lowalt.echo.radar import Radar
from lowalt.machine.jit import INNER, LEAN
from lowalt.numerics import double_double

X, Y, Z, RANGE, TURN, CELL, REST = range(7)
"""Columns of the table of reference ranges.

They are the vector from the station (m), range (m), fraction of a turn of its phase, nearest whole
range cell, and the rest of the range in cells.
"""

two_sum = LEAN(double_double.two_sum)
two_product = LEAN(double_double.two_product)


@INNER
def _fraction(r, r_lo, k, k_lo):
    """Whole part and fraction, within about [-1/2, 1/2], of (r + r_lo) (k + k_lo)."""
    p, q = two_product(r, k)
    whole = np.rint(p)
    return whole, (p - whole) + (q + (r * k_lo + r_lo * k))


@LEAN
def _fill(position, radar, out):
    """Fill `out` (N, 7) with the reference ranges of positions (N, 3) m.

    The columns are those of `reference`.
    """
    for n in range(len(position)):
        h2 = 0.0
        h2_lo = 0.0
        for i in range(3):
            d, d_lo = two_sum(position[n, i], -radar.station[i])
            out[n, i] = d
            p, q = two_product(d, d)
            h2, more = two_sum(h2, p)
            h2_lo += more + q + 2.0 * d * d_lo
        r = math.sqrt(h2)
        r_lo = 0.0
        if r > 0.0:
            p, q = two_product(r, r)
            r_lo = ((h2 - p) - q + h2_lo) / (2.0 * r)
        out[n, RANGE] = r
        _, out[n, TURN] = _fraction(r, r_lo, radar.turns, radar.turns_lo)
        out[n, CELL], out[n, REST] = _fraction(r, r_lo, radar.cells, radar.cells_lo)


def reference(position: np.ndarray, radar: Radar) -> np.ndarray:
    """Return the table (N, 7) of reference ranges of positions (N, 3) m seen by one station.

    Columns: X, Y, Z, RANGE, TURN, CELL, REST.
    """
    out = np.empty((len(position), 7))
    _fill(position, radar, out)
    return out
