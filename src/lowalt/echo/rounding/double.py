"""One range cell of one symbol with phases in double-double and the rest in double: what most open values need.

A phase of thousands of radians is where a double loses its digits. With phases, direction cosines and distances from
the cell reduced in double-double, each factor that is left is within a few units in the last place, so the sum is known
to `share(points)` of its terms at a third of the time of `sums.cell_value`. Every operation is one that IEEE 754 fixes.
"""

import numpy as np

from lowalt.echo.rounding.sums import AMPLITUDE, CELL, TURN, constants_of, patterns, phase_of, seen
from lowalt.machine.jit import INLINED, INNER, LEAN
from lowalt.numerics.exact.arithmetic import scale
from lowalt.numerics.exact.constants import taylor
from lowalt.numerics.exact.sines import fraction, odd_sign

LANES = 8
"""Sums that run side by side: point i is added to sum i modulo 8. The padding of points is a multiple of it."""

_HALF = tuple(high for high, _ in taylor(1, 1, 14)[::-1])
"""sin(pi x) / x for |x| <= 1/2, highest order first."""
_SINE = tuple(high for high, _ in taylor(1, 2, 9)[::-1])
_COSINE = tuple(high for high, _ in taylor(0, 2, 9)[::-1])
"""sin(2 pi x) / x and cos(2 pi x) for |x| <= 1/8."""


@INLINED
def share(points):
    """Return the bound of the error of `cell_value`, relative to the sum of amplitudes of `points` points.

    In units u = 2^-53 a sine of half turns is within 10 u of itself: its series stops below 2^-60 and Horner's rule
    rounds the last coefficients alone (5 u), its argument 2 u and the product with it 1 u. A quotient of two sines is
    within 21 u, five of them with their products 110 u; amplitude, sine and cosine of the turn and their product 10 u;
    the cell's phase and the product with it 8 u; the sum's additions points / 8 + 8. All is doubled.
    """
    return (2.0 * (110 + 10 + 8 + 8) + 2.0 * points / LANES) * 2.0**-53


@INLINED
def polynomial(x, coefficients):
    """Return a polynomial in x by Horner's rule, highest order first."""
    total = coefficients[0]
    for k in range(1, len(coefficients)):
        total = total * x + coefficients[k]
    return total


@INLINED
def dirichlet(x, count):
    """Return sin(pi count x) / sin(pi x) for a double-double x, with its limits at whole x; count: a whole double."""
    f, whole = fraction(x)
    top, turns = fraction(scale(f, count))
    zero = f[0] == 0.0
    below, above = (1.0 if zero else f[0]), top[0]
    ratio = above * polynomial(above * above, _HALF) / (below * polynomial(below * below, _HALF))
    sign = odd_sign(turns) * (odd_sign(whole) if count - 2.0 * np.floor(0.5 * count) == 0.0 else 1.0)
    return sign * (count if zero else ratio)


@INNER
def times_dirichlet(work, row, count, twice, points):
    """Multiply the amplitudes (row AMPLITUDE) by U_{count-1} of a row's half turns, or by its square."""
    row, below = np.uint64(row), np.uint64(row + 1)
    for i in range(np.uint64(points)):
        u = dirichlet((work[row, i], work[below, i]), count)
        work[AMPLITUDE, i] *= u * u if twice else u


@INNER
def wave(work, points):
    """Replace row CELL and the row below it by the real and imaginary parts of all points."""
    for i in range(np.uint64(points)):
        high = work[TURN, i]
        quarter = np.rint(4.0 * high)
        f = (high - 0.25 * quarter) + work[TURN + 1, i]
        square = f * f
        s, c = f * polynomial(square, _SINE), polynomial(square, _COSINE)
        q = quarter - 4.0 * np.floor(0.25 * quarter)
        odd = q == 1.0 or q == 3.0
        a = work[AMPLITUDE, i]
        work[CELL, i] = (-a if q == 1.0 or q == 2.0 else a) * (s if odd else c)
        work[CELL + 1, i] = (-a if q >= 2.0 else a) * (c if odd else s)


@INLINED
def added(work, row, points):
    """Return the sum of a row in eight sums side by side, then of these; points: a multiple of eight."""
    a, b, c, d, e, f, g, h = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for i in range(np.uint64(0), np.uint64(points), np.uint64(LANES)):
        a += work[row, i]
        b += work[row, i + np.uint64(1)]
        c += work[row, i + np.uint64(2)]
        d += work[row, i + np.uint64(3)]
        e += work[row, i + np.uint64(4)]
        f += work[row, i + np.uint64(5)]
        g += work[row, i + np.uint64(6)]
        h += work[row, i + np.uint64(7)]
    return ((a + b) + (c + d)) + ((e + f) + (g + h))


@LEAN
def cell_value(scene, lay, radar, n, cell, work):
    """Return the real and imaginary part of range cell `cell` at symbol n; arguments as `sums.cell_value`."""
    points = len(lay.root)
    seen(scene, lay, radar, n, cell, work)
    for row, elements, squared in patterns(radar):
        if elements > 1.0:
            times_dirichlet(work, row, elements, squared, points)
    wave(work, points)
    factor = constants_of(radar.exact).scale[0] / float(radar.subcarriers)
    real, imag = factor * added(work, CELL, points), factor * added(work, CELL + 1, points)
    s, c = phase_of(cell, radar.subcarriers)
    return real * c[0] - imag * s[0], real * s[0] + imag * c[0]
