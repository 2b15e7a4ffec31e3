"""Array sums of spherical waves at many points, interpolated from a few exact ones.

The exact sums are those at a few directions and ranges.

During a few symbols, a target fills a small box of direction cosines and inverse ranges. Over this
box an array sum is smooth: a polynomial of a few dozen terms takes less time than a sum over all
elements, each at its own distance.
"""

from itertools import pairwise

import numpy as np
from scipy import fft

from lowalt.machine.jit import INNER
from lowalt.numerics.chebyshev_series import chebyshev_points, orders_of
from lowalt.numerics.large_matrices import multiply
from lowalt.scene.response_loops import LOOPS, End, phasor

CHUNK = 128
"""Points per chunk, so few that their polynomials fit into the first-level cache."""
SYMBOLS = 600
"""Largest number of symbols that share a box."""


def gains(end: End, error: float) -> np.ndarray:
    """Return the array sums (R, N, Q, L) of spherical waves.

    The factor 1/r and the middle's phase are left out.

    error: largest error relative to the number of elements. Source: Balanis, Antenna Theory, 4th
    ed. 2016, 4.4.1.
    """
    paths, symbols, _, points = end.places.shape
    result = np.empty((paths, symbols, len(end.kappas), points), np.complex128)
    turned = np.flatnonzero(np.any(np.diff(end.aims, axis=0) != 0.0, axis=1)) + 1
    edges = np.unique(np.concatenate([np.arange(0, symbols, SYMBOLS), turned, [symbols]]))
    for path in range(paths):
        for first, last in pairwise(edges):
            out = result[path, first:last]
            _fill_gains(end, end.places[path, first:last], first, error, out)
    return result


def _fill_gains(end: End, places: np.ndarray, first: int, error: float, out: np.ndarray) -> None:
    """Fill out (K, Q, L) with the sums toward places (K, 3, L) of symbols that share a box.

    first: number of the first of these symbols, whose beam all have.
    """
    at = np.empty(places.shape)
    low = np.empty(3)
    high = np.empty(3)
    _directions(end, places, at, low, high)
    middle = 0.5 * (low + high)
    half = np.maximum(0.5 * (high - low), 1e-12 * np.array([1.0, 1.0, high[2]]))
    counts = _orders(end, middle, half, error)
    if counts is None or np.prod(counts) > at[:, 0].size:
        _sums(end, first, at, out)
        return
    nodes = np.stack(np.meshgrid(*map(chebyshev_points, counts), indexing="ij"))
    grid = middle[:, None] + half[:, None] * nodes.reshape(3, -1)
    values = np.empty((1, len(end.kappas), grid.shape[1]), np.complex128)
    _sums(end, first, grid[None], values)
    # The cosine transform counts the terms of order 0 twice on each axis.
    terms = fft.dctn(values.reshape(-1, *counts), axes=(1, 2, 3)) / np.prod(counts)
    for axis in (1, 2, 3):
        np.moveaxis(terms, axis, 0)[0] *= 0.5
    terms = terms.reshape(len(terms), -1)
    # Leave out terms whose sum is negligible at every frequency.
    size = abs(terms).max(axis=0)
    order = np.argsort(size)
    kept = order[np.cumsum(size[order]) > error * np.prod(end.counts)]
    powers = np.stack(np.unravel_index(kept, counts), axis=1)
    real_imag = np.concatenate([terms[:, kept].real, terms[:, kept].imag])
    _polynomials(at, (middle, half), counts, powers, real_imag, out)


def _orders(
    end: End, middle: np.ndarray, half: np.ndarray, error: float
) -> tuple[int, int, int] | None:
    """Return how many polynomials per axis the sums in a box need.

    The axes are across, up and inverse range. The result is None if the box is close to the array.

    The phase of an element at distance D from the array's corner changes by k D per unit of a
    direction cosine, and by k D^2 / 2 per unit of inverse range. A third more allows for the mixed
    terms.
    """
    wide, tall = end.spacing * (end.counts - 1)
    diagonal = float(np.hypot(wide, tall))
    nearness = diagonal * (middle[2] + half[2])
    if nearness > 0.25:
        return None
    wave = 2.0 * np.pi * 2.0 * end.turns
    across = 0.5 * wide + diagonal * nearness
    up = 0.5 * tall + diagonal * nearness
    along = 0.5 * diagonal**2
    arguments = 1.33 * (wave * np.array([across, up, along])) * half + 1e-6
    for_across, for_up, for_along = (orders_of(each, 0.1 * error) + 1 for each in arguments)
    return for_across, for_up, for_along


@LOOPS
def _directions(end, places, at, low, high):
    """Fill at (K, 3, L) with direction cosines and inverse ranges of places (K, 3, L).

    low, high: (3,), their bounds.
    """
    low[:] = np.inf
    high[:] = -np.inf
    for n in range(len(places)):
        for i in range(places.shape[2]):
            x = places[n, 0, i] - end.station[0]
            y = places[n, 1, i] - end.station[1]
            z = places[n, 2, i] - end.station[2]
            inverse = 1.0 / np.sqrt(x * x + y * y + z * z)
            at[n, 0, i] = (end.axes[0] * x + end.axes[1] * y) * inverse
            at[n, 1, i] = z * inverse
            at[n, 2, i] = inverse
            for k in range(3):
                low[k] = min(low[k], at[n, k, i])
                high[k] = max(high[k], at[n, k, i])


@LOOPS
def _sums(end, symbol, at, result):
    """Fill result (K, Q, L) with the sums over elements at given directions.

    at: (K, 3, L), direction cosines and inverse ranges.

    An element at e from the corner is sqrt(r^2 - 2 r e.u + e^2) away. Its weight has the beam of
    `symbol`.
    """
    h = 0.5 * (end.counts[0] - 1)
    v = 0.5 * (end.counts[1] - 1)
    aims = end.aims[symbol]
    real, imag = np.empty((2, at.shape[2]))
    for n in range(len(at)):
        across = at[n, 0]
        up = at[n, 1]
        inverse = at[n, 2]
        for q in range(len(end.kappas)):
            real[:] = 0.0
            imag[:] = 0.0
            for a in range(end.counts[0]):
                for b in range(end.counts[1]):
                    x = end.spacing * a
                    y = end.spacing * b
                    beam = end.beam * ((a - h) * aims[0] + (b - v) * aims[1])
                    for i in range(np.uint64(len(real))):
                        # (distance - r) / r, without cancellation far away.
                        square = inverse[i] * (
                            inverse[i] * (x * x + y * y) - 2.0 * (x * across[i] + y * up[i])
                        )
                        longer = square / (1.0 + np.sqrt(1.0 + square))
                        # In spacings, without the path of the array's middle, which
                        # `response_loops` adds.
                        away = longer / (inverse[i] * end.spacing) + h * across[i] + v * up[i]
                        c, s = phasor(-0.5 * (end.kappas[q] * away + beam))
                        real[i] += c / (1.0 + longer)
                        imag[i] += s / (1.0 + longer)
            for i in range(len(real)):
                result[n, q, i] = complex(real[i], imag[i])


@INNER
def _scaled(values, middle, half, table):
    """Fill table (K, L) with the Chebyshev polynomials of (values - middle) / half.

    There are at most L values.
    """
    for i in range(np.uint64(len(values))):
        table[0, i] = 1.0
    if len(table) > 1:
        for i in range(np.uint64(len(values))):
            table[1, i] = (values[i] - middle) / half
    for p in range(2, len(table)):
        older = table[p - 2]
        old = table[p - 1]
        new = table[p]
        linear = table[1]
        for i in range(np.uint64(len(values))):
            new[i] = 2.0 * linear[i] * old[i] - older[i]


@LOOPS
def _polynomials(at, box, counts, powers, terms, result):
    """Fill result (K, Q, L) with sums of polynomials of directions and inverse ranges.

    at: (K, 3, L), these; powers: (T, 3), of each term on the three axes.

    terms: (2 Q, T), the factors' real parts at every frequency, then their imaginary parts.
    """
    # Chunks of nearly equal size, because the last one is also computed at full size.
    chunks = (at.shape[2] + CHUNK - 1) // CHUNK
    size = (at.shape[2] + chunks - 1) // chunks
    middle, half = box
    across = np.zeros((counts[0], size))
    up = np.zeros((counts[1], size))
    near = np.zeros((counts[2], size))
    table = np.empty((len(powers), size))
    sums = np.empty((len(terms), size))
    for n in range(len(at)):
        for first in range(0, at.shape[2], size):
            last = min(first + size, at.shape[2])
            _scaled(at[n, 0, first:last], middle[0], half[0], across)
            _scaled(at[n, 1, first:last], middle[1], half[1], up)
            _scaled(at[n, 2, first:last], middle[2], half[2], near)
            for t in range(len(powers)):
                x = across[powers[t, 0]]
                y = up[powers[t, 1]]
                z = near[powers[t, 2]]
                term = table[t]
                for i in range(np.uint64(size)):
                    term[i] = x[i] * y[i] * z[i]
            multiply(terms, table, sums)
            for q in range(result.shape[1]):
                real = sums[q]
                imag = sums[q + result.shape[1]]
                out = result[n, q]
                for i in range(last - first):
                    out[first + i] = complex(real[i], imag[i])
