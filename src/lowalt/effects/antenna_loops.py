"""The compiled loop of an antenna element's gain: angles and powers as polynomials, in short vectorised passes."""

import math
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev

from lowalt.common.jit import INNER_ORDERED, ORDERED
from lowalt.echo.fast.vector_loops import horner

STRETCH = 0.7
"""Largest exponent of the polynomial for exp; larger ones are halved so often, and the result is squared as often."""


def _powers(function, low: float, high: float, degree: int) -> np.ndarray:
    """Coefficients (1, degree + 1) of a polynomial through a function's Chebyshev points on [low, high]."""
    middle, half = 0.5 * (low + high), 0.5 * (high - low)
    fitted = chebyshev.Chebyshev(chebyshev.chebinterpolate(lambda x: function(middle + half * x), degree), (low, high))
    coefficients = fitted.convert(kind=np.polynomial.Polynomial, domain=(-1, 1), window=(-1, 1)).coef
    # Leading coefficients of zero are left out by the conversion.
    return np.pad(coefficients, (0, degree + 1 - len(coefficients)))[None]


def _over(x: np.ndarray) -> np.ndarray:
    """arctan(sqrt(x)) / sqrt(x)."""
    root = np.sqrt(x)
    return np.arctan(root) / root


# Each order of arctan's series in t^2 is (1 + sqrt 2)^-2 times the one before on [0, 1], 0.04 times up to tan(pi / 8).
EIGHTH = math.tan(math.pi / 8)
TURNS = 11
"""Degree of ARCTANGENT."""
ARCTANGENT = _powers(_over, 0.0, EIGHTH**2, TURNS)
"""arctan(t) / t as a polynomial of t^2, t up to tan(pi / 8), to rounding."""
GROWTH = 12
"""Degree of EXPONENTIAL."""
EXPONENTIAL = _powers(np.exp, -STRETCH, 0.0, GROWTH)
"""exp(x) on [-STRETCH, 0], to rounding."""


@lru_cache(maxsize=16)
def halvings(largest: float) -> int:
    """Return how often exponents up to `largest` must be halved to be within STRETCH."""
    return max(0, math.ceil(math.log2(max(largest, 1e-300) / STRETCH)))


@INNER_ORDERED
def arctangent(below, above, square, turn, angle, size):
    """Fill angle[:size] with the arctangent of below / above, both at least 0; zero where both are 0."""
    for i in range(np.uint64(size)):
        small, large = min(below[i], above[i]), max(max(below[i], above[i]), 1e-300)
        # From tan(pi / 8) on, compute pi / 4 minus the angle.
        far = small > EIGHTH * large
        one, other = (large - small, large + small) if far else (small, large)
        turn[i] = one / other
        square[i] = turn[i] * turn[i]
    horner(square, ARCTANGENT, 0, TURNS, angle, size)
    for i in range(np.uint64(size)):
        small, large = min(below[i], above[i]), max(below[i], above[i])
        part = angle[i] * turn[i]
        part = 0.25 * math.pi - part if small > EIGHTH * large else part
        angle[i] = 0.5 * math.pi - part if below[i] > above[i] else part


@ORDERED
def power_gain(planes, station, axes, tilt, peak, rate, most, squarings, work, out):
    """Fill out (N, L) with the power gain toward places in planes (N, 3, L) m.

    axes: (4,) horizontal components of the panel's normal and of its horizontal axis; tilt: (2,) cosine and sine of the
    downtilt; peak: largest power gain; rate: loss (nepers of power) per rad^2; most: largest loss, 2^squarings
    STRETCH at most; work: (7, L). Source: 3GPP TR 38.901, Table 7.3-1.
    """
    ahead, side, up, flat, square, turn, angle = work[0], work[1], work[2], work[3], work[4], work[5], work[6]
    size, share = planes.shape[2], 0.5**squarings
    s0, s1, s2, n0, n1, h0, h1 = station[0], station[1], station[2], axes[0], axes[1], axes[2], axes[3]
    cosine, sine = tilt[0], tilt[1]
    for n in range(len(planes)):
        px, py, pz, row = planes[n, 0], planes[n, 1], planes[n, 2], out[n]
        for i in range(np.uint64(size)):
            x, y, z = px[i] - s0, py[i] - s1, pz[i] - s2
            front = x * n0 + y * n1
            a, s, u = cosine * front - sine * z, x * h0 + y * h1, sine * front + cosine * z
            ahead[i], side[i], up[i] = a, abs(s), abs(u)
            flat[i] = math.sqrt(a * a + s * s)
        arctangent(up, flat, square, turn, angle, size)
        for i in range(np.uint64(size)):
            up[i] = min(rate * angle[i] * angle[i], most)
            flat[i] = abs(ahead[i])
        arctangent(side, flat, square, turn, angle, size)
        for i in range(np.uint64(size)):
            across = math.pi - angle[i] if ahead[i] < 0.0 else angle[i]
            loss = min(up[i] + min(rate * across * across, most), most)
            square[i] = -loss * share
        horner(square, EXPONENTIAL, 0, GROWTH, angle, size)
        for _ in range(squarings):
            for i in range(np.uint64(size)):
                angle[i] *= angle[i]
        for i in range(np.uint64(size)):
            row[i] = peak * angle[i]
