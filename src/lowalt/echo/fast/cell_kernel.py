"""The range-cell kernel as polynomials of a point's range.

A few moments of the points then give all near cells.

With v the range scaled to [-1, 1] and the moments M_k = sum z v^k, cell j is sum_k c_jk M_k. The
polynomials depend on the target's position between two cells and on its depth; they are tabulated
at fixed positions for each depth.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lowalt.echo.fast.polynomials import (
    CELL_REACH,
    MOST_RATES,
    TOP,
    CosineSum,
    cell_rule,
    degree_for,
    economised,
    folding,
    tail,
)

POSITIONS = 32
"""Number of positions between two whole cells at which the kernel is tabulated."""
SIDE = 4
"""The moments give the sums of this many cells on either side of the nearest whole cell."""


class CellPolynomials(NamedTuple):
    """Tables of the cell kernels' polynomials, by the target's position between two cells.

    kernels: (POSITIONS + 1, 2 SIDE + 1, degree + 1); sines: of pi times the range, (POSITIONS + 1,
    degree + 1).

    half: the range in cells at |v| = 1; error: bound of every polynomial's error on [-1, 1]; sizes:
    largest |c_0| and |c_1| and largest sum of the other |c_k| of any kernel: they weight the
    moments' roundings.
    """

    kernels: np.ndarray
    sines: np.ndarray
    half: float
    error: float
    sizes: tuple[float, float, float]


@lru_cache(maxsize=256)
def cell_polynomials(count: int, deep: float, error: float) -> CellPolynomials | None:
    """Return polynomials to `error`, or None if they are too long.

    deep: how far (cells) the target extends from its reference; count: subcarriers M.
    """
    half = deep + 0.5 / POSITIONS
    # Moments are computed four at a time, so round the degree up to one less than a multiple of
    # four at no cost.
    degree = degree_for(math.pi * half, error) | 3
    if degree > TOP or SIDE + 0.5 + half > CELL_REACH or count < 2 * SIDE + 3:
        return None
    rule = cell_rule(count)
    room = np.empty((3, MOST_RATES))
    fold = folding()
    # sin(pi x) is cos(pi (x - 1/2)).
    sine = CosineSum(np.ones(1), np.array([np.pi]))
    kernels = np.empty((POSITIONS + 1, 2 * SIDE + 1, degree + 1))
    sines = np.empty((POSITIONS + 1, degree + 1))
    for number, row in enumerate(kernels):
        position = number / POSITIONS - 0.5
        for j in range(2 * SIDE + 1):
            economised(rule, position - (j - SIDE), half, degree, fold, room, row[j])
        economised(sine, position - 0.5, half, degree, fold, room, sines[number])
    size = np.abs(kernels)
    sizes = (
        float(size[..., 0].max()),
        float(size[..., 1].max()),
        float(size[..., 2:].sum(axis=-1).max()),
    )
    return CellPolynomials(kernels, sines, half, float(tail(np.pi * half, degree)), sizes)
