"""Polynomials of low degree that replace functions, each with a proved error bound.

Array gains and the range-cell kernel are finite sums of cosines. Over a short interval, with B the
largest rate times half the interval, their Chebyshev coefficients are Bessel functions with |2
J_p(B)| <= 2 (B/2)^p / p!.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from lowalt.machine.jit import LEAN, VECTOR

TOP = 40
"""Largest degree of any polynomial here; intervals that need more use the pointwise kernel."""
EXTRA = 8
"""Taylor orders beyond the degree that are folded back into it (economisation)."""


class CosineSum(NamedTuple):
    """Weights and rates (K,) of sum w cos(rate x): rates >= 0, the largest first."""

    weights: np.ndarray
    rates: np.ndarray


@LEAN
def tail(band, degree):
    """Return a bound of the error of `economised`.

    The cosines have weights of sum 1 and phases up to `band` (rad).
    """
    half = 0.5 * band
    term = 4.0
    for p in range(1, degree + 2):
        term *= half / p
    ratio = half / (degree + 2)
    cut = 1.0
    for p in range(1, degree + EXTRA + 2):
        cut *= band / p
    other = band / (degree + EXTRA + 2)
    if ratio >= 0.9 or other >= 0.9:
        return np.inf
    return term / (1.0 - ratio) + cut / (1.0 - other)


@LEAN
def degree_for(band, error):
    """Return the smallest degree whose `tail` is at most `error`; TOP + 1 where none is."""
    for degree in range(TOP + 1):
        if tail(band, degree) <= error:
            return degree
    return TOP + 1


@lru_cache(maxsize=1)
def folding() -> np.ndarray:
    """Return the weights (TOP + 1, EXTRA, TOP + 1) by which `economised` folds high powers back.

    Row d, j holds x^(d + 1 + j) on [-1, 1], its Chebyshev series cut after T_d, as powers of x.
    """
    top = TOP + EXTRA + 1
    # Powers to Chebyshev polynomials by x T_n = (T_{n+1} + T_{|n-1|}) / 2, and back by T_{n+1} = 2
    # x T_n - T_{n-1}.
    shares = np.zeros((top + 1, top + 1))
    powers = np.zeros((TOP + 1, TOP + 1))
    shares[0, 0] = shares[1, 1] = powers[0, 0] = powers[1, 1] = 1.0
    for p in range(1, top):
        shares[p + 1, 1:] = shares[p, :-1] / 2
        shares[p + 1, :-1] += shares[p, 1:] / 2
        shares[p + 1, 1] += shares[p, 0] / 2
    for n in range(1, TOP):
        powers[n + 1, 1:] = 2 * powers[n, :-1]
        powers[n + 1] -= powers[n - 1]
    result = np.zeros((TOP + 1, EXTRA, TOP + 1))
    for degree in range(TOP + 1):
        result[degree] = (
            shares[degree + 1 : degree + 1 + EXTRA, : degree + 1] @ powers[: degree + 1]
        )
    return result


@VECTOR
def economised(cosines, centre, half, degree, fold, room, out):
    """Fill out[: degree + 1] with powers-of-s coefficients of a `CosineSum` at x = centre + half s.

    fold: of `folding`; room (3, at least as many as rates): work array.
    """
    weights, rates = cosines
    count = len(weights)
    term = room[0]
    even = room[1]
    odd = room[2]
    for i in range(count):
        angle = rates[i] * centre
        term[i] = weights[i]
        even[i] = math.cos(angle)
        odd[i] = -math.sin(angle)
    out[:] = 0.0
    for p in range(degree + EXTRA + 1):
        value = 0.0
        # The signs of a cosine's Taylor series are +, -, -, +.
        sign = 1.0
        if p & 2:
            sign = -1.0
        step = half / (p + 1)
        if p & 1:
            for i in range(count):
                value += term[i] * odd[i]
                term[i] *= rates[i] * step
        else:
            for i in range(count):
                value += term[i] * even[i]
                term[i] *= rates[i] * step
        value *= sign
        if p <= degree:
            out[p] += value
        else:
            for k in range(degree + 1):
                out[k] += fold[degree, p - degree - 1, k] * value


def _half(weights: np.ndarray, rates: np.ndarray) -> CosineSum:
    """Return the same sum of cosines with the rates r and -r joined."""
    order = np.argsort(-rates, kind="stable")
    weights = weights[order]
    rates = rates[order]
    keep = (len(rates) + 1) // 2
    weights = 2 * weights[:keep]
    if len(rates) % 2:
        weights[-1] /= 2
        rates = np.append(rates[: keep - 1], 0.0)
    return CosineSum(weights, np.ascontiguousarray(rates[:keep]))


MOST_RATES = 32
"""Largest number of rates of a `cell_rule`."""
CELL_REACH = 7.0
"""Distance (cells) up to which `cell_rule` holds."""


@lru_cache(maxsize=64)
def cell_rule(count: int) -> CosineSum:
    """Return a short cosine sum equal to the cell kernel of `count` subcarriers.

    Its rates are in rad per cell.

    This is the Gauss rule of the uniform discrete measure on the subcarriers (recurrence of the
    discrete Chebyshev polynomials). 32 nodes are exact to degree 63, with an error below 1e-17 at a
    distance of seven cells.
    """
    nodes = min(count, MOST_RATES)
    k = np.arange(1, nodes)
    off = np.sqrt(k**2 * (count**2 - k**2) / (4.0 * (4.0 * k**2 - 1.0)))
    values, vectors = np.linalg.eigh(np.diag(off, 1) + np.diag(off, -1))
    weights = vectors[0] ** 2
    return _half(weights / weights.sum(), 2 * np.pi / count * values)


@lru_cache(maxsize=64)
def array_rule(transmit: int, receive: int, kappa: float) -> CosineSum:
    """Return U_{T-1} U_{R-1} / (T R) as a cosine sum.

    Weights of sum 1, rates in rad per unit of direction cosine.
    """
    weights = np.convolve(np.ones(transmit), np.ones(receive)) / (transmit * receive)
    top = transmit + receive - 2
    return _half(weights, np.pi * kappa / 2 * (top - 2.0 * np.arange(top + 1)))


@lru_cache(maxsize=1)
def _nodes() -> tuple[np.ndarray, np.ndarray]:
    """Return the Chebyshev nodes on [-1, 1] and the matrix from values there to coefficients.

    There are 96 nodes, so the matrix is (96, 96).

    Computed in extended precision if the machine has it, because the rounding of a double-precision
    transform would look like coefficients.
    """
    count = 96
    angle = 4 * np.arctan(np.longdouble(1)) * (np.arange(count) + np.longdouble(0.5)) / count
    matrix = 2 * np.cos(np.arange(count)[:, None] * angle) / count
    matrix[0] /= 2
    return np.cos(angle), matrix


@lru_cache(maxsize=2)
def _expansion(kind: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the Chebyshev coefficients (96,) of a function of `smooth`.

    The error of stopping at each degree comes second.
    """
    s, matrix = _nodes()
    two_pi = 8 * np.arctan(np.longdouble(1))
    angle = two_pi * np.sqrt((1 + s) / 8)
    value = np.cos(angle)
    if kind == "sine":
        value = two_pi * np.sin(angle) / angle
    coefficients = matrix @ value
    noise = max(64 * float(np.finfo(np.longdouble).eps), 1e-17) * float(abs(coefficients).max())
    size = np.where(abs(coefficients) < noise, 0, abs(coefficients)).astype(np.float64)
    from_here_on = np.cumsum(size[::-1])[::-1]
    left_out = np.append(from_here_on[1:], 0.0)
    return coefficients, left_out + 2e-16


@lru_cache(maxsize=64)
def smooth(kind: str, degree: int) -> tuple[np.ndarray, float]:
    """Return a polynomial of `degree` in x = t^2 for |t| <= 1/2: coefficients and error bound.

    kind: "cosine" for cos(2 pi t), "sine" for sin(2 pi t) / t. The bound is the sum of the
    Chebyshev coefficients left out, computed with 96 nodes, plus rounding.
    """
    coefficients, tails = _expansion(kind)
    inner = np.polynomial.Polynomial(np.array([-1, 8], np.longdouble))
    powers = np.polynomial.Polynomial(chebyshev.cheb2poly(coefficients[: degree + 1]))(inner).coef
    return powers.astype(np.float64), float(tails[degree])
