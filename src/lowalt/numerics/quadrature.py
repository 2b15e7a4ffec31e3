"""Nodes and weights of Gauss and Legendre's quadrature."""

from functools import lru_cache

import numpy as np

from lowalt.numerics.portable import cos

STEPS = 6
"""Newton's steps from the first guess, whose error is below 1e-3 and is squared by each step."""


@lru_cache(maxsize=256)
def gauss_legendre(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes (count,) on [-1, 1], rising, and their weights, whose sum is 2.

    They must not be changed.

    Source: Newton's method on the Legendre polynomial from Tricomi's guess, DLMF 18.16.
    """
    x = -cos(np.pi * (np.arange(count) + 0.75) / (count + 0.5))
    slope = np.ones(count)
    for _ in range(STEPS):
        before = np.ones(count)
        value = x
        for order in range(2, count + 1):
            later = ((2 * order - 1) * x * value - (order - 1) * before) / order
            before = value
            value = later
        slope = count * (x * value - before) / (x * x - 1.0)
        x = x - value / slope
    weight = 2.0 / ((1.0 - x * x) * slope * slope)
    # Both halves are mirror images, and a middle node is 0.
    return 0.5 * (x - x[::-1]), 0.5 * (weight + weight[::-1])
