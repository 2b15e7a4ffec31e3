"""Which cell is the strongest, for certain: near cells computed, the others excluded by a bound, more if it fails."""

import math

from lowalt.echo import lanes
from lowalt.echo.answers import NEAR_TIE
from lowalt.echo.compile import LEAN
from lowalt.echo.segment import FIRST, WIDEST

RING = 8
"""Cells added on either side where the bound cannot yet decide."""
FINE, AGAIN = 0, 1
"""State of a symbol: done, or to be computed again with the finest plan or the general kernel."""


@LEAN
def far_limit(c0, c1, a2, distance, reach, count):
    """Bound of |sum| in every cell at least `distance` from the expansion's centre; see `answers.far_bound`."""
    if distance - reach <= 0.0:
        return math.inf
    step = math.pi / count
    s, k = math.sin(step * distance), math.cos(step * distance)
    near = math.sin(step * (distance - reach))
    return (c0 / s + c1 * step * abs(k) / (s * s) + a2 * step * step / near**3) / count


@LEAN
def near_cells(place, deep, window):
    """Cells first..last of the window that can well be a symbol's strongest; the bound looks after the others."""
    margin = 0.6 + 1.5 * deep
    first, last = math.ceil(place - margin), math.floor(place + margin)
    return max(0, min(first, window - 1)), max(0, min(last, window - 1))


@LEAN
def rank(sums, lowest, highest):
    """Largest and second largest |sum| of the cells lowest..highest, and the place of the largest."""
    best, second, which = -1.0, -1.0, lowest
    for cell in range(lowest, highest + 1):
        strength = abs(sums[cell])
        if strength > best:
            best, second, which = strength, best, cell
        elif strength > second:
            second = strength
    return best, second, which


@LEAN
def one_cell(row, degree, at, size, u, weight, real, imag):
    """Sum of one symbol's points in one cell of the window."""
    lanes.horner(u[at : at + size], row, degree, weight[at : at + size], size)
    re, im = lanes.weigh(weight, real, imag, at, size)
    return complex(re, im)


@LEAN
def certify(
    place, deep, c0, c1, a2, slack, bound, sums, first, last, window, at, size, typed, degree, shape, arrays
):  # fmt: skip
    """Strongest cell of one symbol: (state, place in `sums`, near-tie, gap), more cells as the bound asks.

    gap: lower bound of how much larger |sum| is there than in any other cell, negative where none is proved.
    sums: (RING + WIDEST + RING,), the window's cells from RING on. shape: (count, half-width, centre) of the cells.
    arrays: sin(pi u), u, real and imaginary parts and room for weights, needed only where the first bound fails.
    """
    count, half, centre = int(shape[0]), shape[1], shape[2]
    lowest, highest = first + RING, last + RING
    for grow in range(3):
        if grow == 1:
            sin_u, u, real, imag, weight = arrays
            for cell in range(window):
                if cell < first or cell > last:
                    sums[RING + cell] = one_cell(typed[FIRST + cell], degree, at, size, u, weight, real, imag)
            lowest, highest = RING, RING + window - 1
        if grow == 2:
            if count < 3 * RING + WIDEST:
                break
            for j in range(1, RING + 1):
                for cell in (-j, window - 1 + j):
                    re, im = lanes.distant_cell(cell, half, centre, count, sin_u, u, real, imag, at, size)
                    # Only an upper bound of the size, since the sine is coarse; no value is taken from here.
                    sums[RING + cell] = math.hypot(re, im) + slack
            lowest, highest = 0, 2 * RING + window - 1
        best, second, which = rank(sums, lowest, highest)
        if grow == 2 and not RING <= which < RING + window:
            break
        gap = min(place - (lowest - 1 - RING), highest + 1 - RING - place, 0.5 * count)
        far = far_limit(c0, c1, a2, gap, deep, count)
        if far + bound < best * (1.0 - NEAR_TIE) - bound:
            return FINE, which, best - second <= NEAR_TIE * best, best - max(second, far) - 2.0 * bound
        if size == 0:
            break
    return AGAIN, 0, False, 0.0
