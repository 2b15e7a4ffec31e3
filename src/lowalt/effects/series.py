"""A smooth function of one number at many places: as a Chebyshev series over the stretch that the places cover."""

from collections.abc import Callable

import numpy as np

from lowalt.common.jit import VECTOR

STRIP = 256
"""Places that pass through the loops together."""
ENOUGH = 1e-14
"""Share of the largest coefficient below which the last quarter of a series must be."""
LONGEST = 64
"""Terms of a series, at most; a function that needs more is asked at every place."""


@VECTOR
def summed(places, middle, half, terms, work, out):
    """Fill out (K,) with the Chebyshev series `terms` (count,) complex at places (K,), Clenshaw's rule; count is even.

    The series runs from middle - half to middle + half; work: (5, STRIP).
    """
    x, re, im, last_re, last_im = work[0], work[1], work[2], work[3], work[4]
    for first in range(0, len(places), STRIP):
        size = min(STRIP, len(places) - first)
        for i in range(size):
            x[i] = 2.0 * (places[first + i] - middle) / half
            re[i], im[i], last_re[i], last_im[i] = 0.0, 0.0, 0.0, 0.0
        # Two orders a pass; the last pass holds orders 1 and 0.
        for k in range(len(terms) - 1, 0, -2):
            a, b, c, d = terms[k].real, terms[k].imag, terms[k - 1].real, terms[k - 1].imag
            step = 1.0 if k > 1 else 0.5
            for i in range(size):
                last_re[i] = a + x[i] * re[i] - last_re[i]
                last_im[i] = b + x[i] * im[i] - last_im[i]
                re[i] = c + step * x[i] * last_re[i] - re[i]
                im[i] = d + step * x[i] * last_im[i] - im[i]
        for i in range(size):
            out[first + i] = complex(re[i], im[i])


def at(function: Callable[[np.ndarray], np.ndarray], places: np.ndarray) -> np.ndarray:
    """Return the complex values of a smooth function at real places (any shape), to rounding; `function` is pointwise.

    The number of terms is doubled until the last quarter of them is below rounding. Source: Aurentz & Trefethen,
    Chopping a Chebyshev series, ACM Trans. Math. Softw. 43(4), 2017, whose plateau is this quarter.
    """
    low, high = float(places.min()), float(places.max())
    middle, half = 0.5 * (low + high), max(0.5 * (high - low), 1e-12)
    count = 8
    # For few places, calling the function itself costs less than the series.
    while count <= LONGEST and 4 * count < places.size:
        nodes = middle + half * np.cos(np.pi * (np.arange(count) + 0.5) / count)
        found = np.asarray(function(nodes), np.complex128)
        order = np.arange(count)
        transform = np.cos(order[:, None] * np.pi * (order + 0.5) / count) * (2.0 / count)
        terms = transform @ found
        terms[0] *= 0.5
        if abs(terms[-count // 4 :]).max() <= ENOUGH * abs(terms).max():
            out = np.empty(places.shape, np.complex128)
            flat = np.ascontiguousarray(places, np.float64).reshape(-1)
            summed(flat, middle, half, terms, np.empty((5, STRIP)), out.reshape(-1))
            return out
        count *= 2
    return np.asarray(function(places), np.complex128)
