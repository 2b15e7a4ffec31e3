"""Chebyshev series.

The module says how many terms a wave needs; it has points, interpolation, a band of waves, and a
smooth function.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy.special import jv

from lowalt.machine.jit import LEAN
from lowalt.numerics.large_matrices import matrix_product
from lowalt.numerics.portable import sine_cosine, sine_cosine_turns

STRIP = 256
"""Positions that pass through the loop together."""
FEW = 256
"""Number of positions up to which a function is called at each of them."""
SHORTEST = 1e-12
"""Least half length of the interval of a series, so that equal positions divide by no zero."""
COUNTS = (8, 16, 32, 64)
"""Numbers of terms that are tried in turn."""
ENOUGH = 1e-14
"""Share of the largest coefficient below which the last quarter of a series must be."""
SPARE = 24
"""Points of a wave's series beyond its terms.

What is left of the series then does not fold back into them.
"""


def orders_of(argument: float, error: float) -> int:
    """Return how many Chebyshev polynomials hold exp(j argument x), |x| <= 1, within `error`.

    From an order above the argument on, each Bessel function is below half the one before it.
    """
    order = int(argument) + 1
    while 4.0 * abs(float(jv(order, argument))) > error:
        order += 1
    return order


def chebyshev_points(count: int) -> np.ndarray:
    """Return the Chebyshev points (count,) of the first kind on [-1, 1], from 1 downwards."""
    return sine_cosine_turns((np.arange(count) + 0.5) / (2 * count))[1]


def polynomials(count: int, at: np.ndarray) -> np.ndarray:
    """Return the Chebyshev polynomials T_0 to T_(count - 1) at `at` (K,), shape (count, K)."""
    result = np.ones((count, len(at)))
    if count > 1:
        result[1] = at
    for order in range(2, count):
        result[order] = 2.0 * at * result[order - 1] - result[order - 2]
    return result


def to_terms(count: int, terms: int) -> np.ndarray:
    """Return the matrix (count, terms) from values at Chebyshev points to a series' first terms.

    The points are `chebyshev_points(count)`.
    """
    # Whole turns of a cosine are left out as whole numbers.
    eighths = np.outer(2 * np.arange(count) + 1, np.arange(terms)) % (4 * count)
    result = 2.0 / count * sine_cosine_turns(eighths / (4 * count))[1]
    result[:, 0] *= 0.5
    return result


def interpolation(count: int, at: np.ndarray) -> np.ndarray:
    """Return the Lagrange weights (count, K) from values at Chebyshev points to those at `at` (K,).

    The points are `chebyshev_points(count)`.

    Source: Trefethen, Approximation Theory and Approximation Practice, 2013, chapters 2 to 5.
    """
    return matrix_product(to_terms(count, count), polynomials(count, np.clip(at, -1.0, 1.0)))


@lru_cache(maxsize=64)
def band_tables(
    nodes: int, spread: float, count: int, error: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the matrices from moments to K frequencies of the band, and from these to subcarriers.

    Their shapes are (2 Q P, 2 K) and (K, M).

    Rows of the first stand for the moments of each of Q nodes, P real parts and then P imaginary
    ones; columns for K real parts and then K imaginary ones.
    spread: largest |u| = 1 times the band, in turns: the phase of subcarrier m is 2 pi spread x u /
    2, x = (2 m - M + 1) / M; error: largest one, relative to the sum of the amplitudes. Both must
    not be changed.
    """
    argument = np.pi * spread * max(count - 1, 1) / count
    orders = orders_of(argument, error)
    kept = orders_of(argument, error) + nodes
    band = np.zeros(1)
    if count > 1:
        band = np.linspace(-1.0, 1.0, count)
    points = chebyshev_points(kept)
    # By the Jacobi-Anger expansion the terms are eps_p (-j)^p J_p; the waves' own series needs no
    # Bessel functions.
    along_wave = chebyshev_points(orders + SPARE)
    sine, cosine = sine_cosine(argument * points[:, None] * along_wave)
    to_series = to_terms(orders + SPARE, orders)
    real = matrix_product(cosine, to_series).T
    imag = -matrix_product(sine, to_series).T
    weights = interpolation(nodes, points)[:, None, None]
    complex_product = np.block([[real, imag], [-imag, real]]).reshape(1, 2 * orders, 2, kept)
    to_nodes = (weights * complex_product).reshape(2 * nodes * orders, 2 * kept)
    return to_nodes, interpolation(kept, band)


def over_band(moments: np.ndarray, tables: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Return the waves' sum at all subcarriers, (N, 2, M), from their moments (N, 2 Q P).

    tables: of `band_tables`.

    Index 1 tells the real from the imaginary part.
    """
    to_nodes, to_band = tables
    nodes = matrix_product(moments, to_nodes).reshape(2 * len(moments), len(to_band))
    return matrix_product(nodes, to_band).reshape(len(moments), 2, -1)


@LEAN
def _summed(x, terms, work, out):
    """Fill out (K,) with the series of terms (T,) complex at x (K,), by Clenshaw's rule.

    x: from -1 to 1; work: (4, STRIP).
    """
    for first in range(0, len(x), STRIP):
        size = min(STRIP, len(x) - first)
        re = work[0]
        im = work[1]
        last_re = work[2]
        last_im = work[3]
        for i in range(size):
            re[i] = 0.0
            im[i] = 0.0
            last_re[i] = 0.0
            last_im[i] = 0.0
        for k in range(len(terms) - 1, -1, -1):
            a = terms[k].real
            b = terms[k].imag
            # Clenshaw's last step takes x once, the others twice.
            twice = 2.0
            if k == 0:
                twice = 1.0
            for i in range(size):
                last_re[i] = a + twice * x[first + i] * re[i] - last_re[i]
                last_im[i] = b + twice * x[first + i] * im[i] - last_im[i]
            re, im, last_re, last_im = last_re, last_im, re, im
        for i in range(size):
            out[first + i] = complex(re[i], im[i])


def at(function: Callable[[np.ndarray], np.ndarray], positions: np.ndarray) -> np.ndarray:
    """Return the complex values of a smooth function at real positions (any shape), to rounding.

    `function` is pointwise.

    The number of terms is doubled until the last quarter of them is below rounding, up to 64; a
    function that needs more is called at every position, as it is for few positions. Source:
    Aurentz & Trefethen, Chopping a Chebyshev series, ACM Trans. Math. Softw. 43(4), 2017, whose
    plateau is this quarter.
    """
    if positions.size <= FEW:
        return function(positions).astype(np.complex128)
    middle = 0.5 * (positions.max() + positions.min())
    half = max(0.5 * float(np.ptp(positions)), SHORTEST)
    for count in COUNTS:
        values = function(middle + half * chebyshev_points(count)).astype(np.complex128)
        real_imag = np.stack([values.real, values.imag])
        series = matrix_product(real_imag, to_terms(count, count))
        terms = series[0] + 1j * series[1]
        last_quarter = terms[-count // 4 :]
        if abs(last_quarter).max() <= ENOUGH * abs(terms).max():
            out = np.empty(positions.shape, np.complex128)
            scaled = ((positions - middle) / half).ravel()
            _summed(scaled, terms, np.empty((4, STRIP)), out.reshape(-1))
            return out
    return function(positions).astype(np.complex128)
