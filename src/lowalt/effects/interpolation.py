"""Interpolation of smooth functions on [-1, 1] from their values at Chebyshev points."""

from functools import lru_cache

import numpy as np


def points(count: int) -> np.ndarray:
    """Return the Chebyshev points (count,) of the first kind on [-1, 1], from 1 downwards."""
    return np.cos(np.pi * (np.arange(count) + 0.5) / count)


def weights(count: int, at: np.ndarray) -> np.ndarray:
    """Return the Lagrange weights (len(at), count) that turn values at `points(count)` into those at `at` (K,).

    Source: Trefethen, Approximation Theory and Approximation Practice, 2013, chapters 2 to 5.
    """
    return polynomials(count, at).T @ coefficients(count)


def polynomials(count: int, at: np.ndarray) -> np.ndarray:
    """Return the Chebyshev polynomials (count, K) of order 0 .. count - 1 at `at` (K,) on [-1, 1]."""
    return np.cos(np.arange(count)[:, None] * np.arccos(at))


def samples(count: int) -> np.ndarray:
    """Return where `count` evenly spaced samples of a symbol stand in it, from -1 at its beginning up to below 1."""
    return 2.0 * np.arange(count) / count - 1.0


@lru_cache(maxsize=64)
def coefficients(count: int) -> np.ndarray:
    """Return the matrix (count, count) from values at `points(count)` to the coefficients of Chebyshev polynomials.

    It is kept and must not be changed.
    """
    order = np.arange(count)
    angle = np.pi * (order + 0.5) / count
    result = np.cos(order[:, None] * angle) * np.where(order == 0, 1.0, 2.0)[:, None] / count
    result.flags.writeable = False
    return result
