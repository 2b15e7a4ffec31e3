"""Slowly moving rigid parts: their choice, their poses as short series in time, and interpolation weights.

The difference between a pose and its series is measured at every symbol and counted as error. `node_count` says how
many nodes are needed.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.polynomial import chebyshev

from lowalt.common.jit import INNER_VECTOR, PLAIN
from lowalt.echo.fast.range_bounds import norm

BLOCK = 512
"""Most symbols interpolated over at a time."""
DEGREE = 8
"""Degree in time of the poses' series."""
INTERPOLATION_COST = 40_000
"""Cost of fitting and interpolating, in points x symbols of the exact plan."""
SWING = 150.0
"""Largest phase (rad) that a part's edge may sweep, by its first step, to be considered; a mere guess to save time."""


@lru_cache(maxsize=64)
def fit(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return two matrices (orders, count): one takes values at `count` symbols to Chebyshev coefficients by least
    squares, the other holds the Chebyshev polynomials at the symbols."""
    values = chebyshev.chebvander(np.linspace(-1.0, 1.0, count), min(DEGREE, count // 4))
    return np.linalg.pinv(values), np.ascontiguousarray(values.T)


@lru_cache(maxsize=256)
def weights(count: int, degree: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return interpolation weights from degree + 1 nodes to `count` symbols, both (count, degree + 1), and values.

    The first weights are those of the polynomial through the nodes (barycentric, Berrut and Trefethen 2004), the second
    are linear between nodes; the values (degree + 1, orders) are the Chebyshev polynomials at the nodes.
    """
    nodes = -np.cos(np.pi * np.arange(degree + 1) / degree)
    symbols = np.linspace(-1.0, 1.0, count)
    sign = (-1.0) ** np.arange(degree + 1)
    sign[[0, -1]] *= 0.5
    away = symbols[:, None] - nodes
    hit = away == 0.0
    polynomial = sign / np.where(hit, 1.0, away)
    polynomial /= polynomial.sum(axis=1, keepdims=True)
    polynomial[hit.any(axis=1)] = 0.0
    polynomial[hit] = 1.0
    linear = np.stack([np.interp(symbols, nodes, row) for row in np.eye(degree + 1)], axis=1)
    return polynomial, np.ascontiguousarray(linear), chebyshev.chebvander(nodes, min(DEGREE, count // 4))


@PLAIN
def candidates(rotation, lay, steps, turns, enough):
    """Return parts (P,) bool with at least `enough` points that, by their first step, turn slowly enough.

    lay: `layout.Layout`; steps: symbols of a block; turns: turns of phase per metre of range.
    """
    parts, starts, centres, radii = lay.parts, lay.starts, lay.centres, lay.radii
    counts, result = np.zeros(rotation.shape[1], np.int64), np.ones(rotation.shape[1], np.bool_)
    for group in range(len(parts)):
        p = parts[group]
        change = 0.0
        for i in range(3):
            for j in range(3):
                change += (rotation[1, p, i, j] - rotation[0, p, i, j]) ** 2
        reach = math.sqrt(centres[group, 0] ** 2 + centres[group, 1] ** 2 + centres[group, 2] ** 2) + radii[group]
        counts[p] += starts[group + 1] - starts[group]
        result[p] &= np.pi * turns * math.sqrt(change) * reach * steps < SWING
    return result & (counts >= enough)


@INNER_VECTOR
def _column(project, back, values, found, column):
    """Fit values (B,) into found[:, column]; returns the largest difference at any symbol. values is overwritten."""
    worst = 0.0
    for k in range(len(project)):
        total = 0.0
        for n in range(len(values)):
            total += project[k, n] * values[n]
        found[k, column] = total
    for k in range(len(project)):
        c = found[k, column]
        for n in range(len(values)):
            values[n] -= c * back[k, n]
    for n in range(len(values)):
        worst = max(worst, abs(values[n]))
    return worst


@PLAIN
def series(rotation, translation, refs, first, chosen, fits):
    """Fit the poses of the parts `chosen` (K,) over the symbols of refs (B, 7), the reference being part `first`.

    Returns Chebyshev coefficients (orders, 3) of the reference from the station, (orders, K, 3) of the parts' origins
    from the reference, (orders, K, 3, 3) of the rotations, and the largest residual of each, (2 K + 1,): reference,
    origins, rotations.
    """
    project, back = fits
    orders, count, parts = len(project), len(refs), len(chosen)
    reference, offset = np.empty((orders, 3)), np.empty((orders, parts, 3))
    turned = np.empty((orders, parts, 3, 3))
    left, values = np.zeros(2 * parts + 1), np.empty(count)
    flat_offset, flat_turned = offset.reshape(orders, 3 * parts), turned.reshape(orders, 9 * parts)
    for i in range(3):
        for n in range(count):
            values[n] = refs[n, i]
        left[0] += _column(project, back, values, reference, i) ** 2
    for row in range(parts):
        p = chosen[row]
        for i in range(3):
            for n in range(count):
                values[n] = translation[n, p, i] - translation[n, first, i]
            left[1 + row] += _column(project, back, values, flat_offset, 3 * row + i) ** 2
            for j in range(3):
                for n in range(count):
                    values[n] = rotation[n, p, i, j]
                left[1 + parts + row] += _column(project, back, values, flat_turned, 9 * row + 3 * i + j) ** 2
    return reference, offset, turned, np.sqrt(left)


@PLAIN
def series_sizes(reference, offset, turned, left, row_of, centres, radii):
    """Return (|reference| (orders,), largest |offset of a point| (orders,), largest error of a point's place (m)).

    Arguments: the results of `series`, then for each group of points its part's row, its centre and its radius.
    """
    orders, parts = offset.shape[0], offset.shape[1]
    moves, sizes = np.empty(orders), np.zeros(orders)
    stray = 0.0
    for k in range(orders):
        moves[k] = math.sqrt(reference[k, 0] ** 2 + reference[k, 1] ** 2 + reference[k, 2] ** 2)
        for group in range(len(row_of)):
            row, total = row_of[group], 0.0
            for i in range(3):
                at = offset[k, row, i]
                for j in range(3):
                    at += turned[k, row, i, j] * centres[group, j]
                total += at * at
            sizes[k] = max(sizes[k], math.sqrt(total) + norm(turned, k, row) * radii[group])
    for group in range(len(row_of)):
        c = centres[group]
        reach = math.sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]) + radii[group]
        stray = max(stray, left[1 + row_of[group]] + left[1 + parts + row_of[group]] * reach)
    return moves, sizes, stray
