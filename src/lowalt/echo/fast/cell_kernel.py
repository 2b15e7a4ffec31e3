"""The range-cell kernel as polynomials of a point's range, so that a few moments of the points give every near cell.

With v the range on [-1, 1] and M_k the sum of z v^k, cell j is sum_k c_jk M_k. The polynomials depend on where
between two cells the target stands; they are tabulated at fixed places and for targets of one depth.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lowalt.echo.fast.polynomials import CELL_REACH, EXTRA, TOP, cell_rule, degree_for, folding, tail

PLACES = 32
"""Places between two whole cells at which the kernel is tabulated."""
SIDE = 4
"""Cells on either side of the nearest whole cell whose sums the moments give."""


class CellPolynomials(NamedTuple):
    """Kernels (PLACES + 1, 2 SIDE + 1, degree + 1) and sines of pi times the range (PLACES + 1, degree + 1).

    half: the range in cells at |v| = 1; error: bound of every polynomial's error on [-1, 1]; sizes: largest |c_0| and
    |c_1| and largest sum of the other |c_k| of any kernel: they weight the moments' roundings.
    """

    kernels: np.ndarray
    sines: np.ndarray
    half: float
    error: float
    sizes: tuple[float, float, float]


def cell_polynomials(count: int, deep: float, error: float) -> CellPolynomials | None:
    """Return polynomials to `error` for targets within `deep` cells of their reference; None if they are too long.

    count: subcarriers M.
    """
    half = deep + 0.5 / PLACES
    band = math.pi * half
    degree = degree_for(band, error)
    # Moments are computed four at a time, so a degree of one less than a multiple of four costs nothing more.
    degree |= 3
    if degree > TOP or SIDE + 0.5 + half > CELL_REACH or count < 2 * SIDE + 3:
        return None
    return _cell_polynomials(count, half, degree)


@lru_cache(maxsize=256)
def _cell_polynomials(count: int, half: float, degree: int) -> CellPolynomials:
    """Compute the polynomials of `degree` for targets within `half` cells of a grid place."""
    weights, rates = cell_rule(count)
    places = np.arange(PLACES + 1) / PLACES - 0.5
    away = places[:, None] - np.arange(-SIDE, SIDE + 1)
    kernels = _expand(weights, rates, 0.0, away, half, degree)
    sines = _expand(np.ones(1), np.array([np.pi]), -0.5 * np.pi, places, half, degree)
    size = np.abs(kernels)
    sizes = (float(size[..., 0].max()), float(size[..., 1].max()), float(size[..., 2:].sum(axis=-1).max()))
    return CellPolynomials(kernels, sines, half, float(tail(np.pi * half, degree)), sizes)


def _expand(weights, rates, phase: float, centres, half: float, degree: int) -> np.ndarray:
    """Coefficients (*centres, degree + 1) of sum w cos(rate x + phase) at x = centre + half v; compare
    `polynomials.economised`."""
    orders = np.arange(degree + EXTRA + 1)
    angle = np.asarray(centres)[..., None] * rates + phase
    # The p-th derivative of a cosine is the cosine p quarters of a turn later.
    waves = np.stack([np.cos(angle), -np.sin(angle), -np.cos(angle), np.sin(angle)])
    factorial = np.cumprod(np.concatenate([[1.0], orders[1:]]))
    powers = weights[:, None] * (rates[:, None] * half) ** orders / factorial
    taylor = np.stack([waves[p % 4] @ powers[:, p] for p in orders], axis=-1)
    return np.ascontiguousarray(
        taylor[..., : degree + 1] + taylor[..., degree + 1 :] @ folding()[degree][:, : degree + 1]
    )
