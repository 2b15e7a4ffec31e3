"""Where the spectrum of an oscillator is taken for a look, and what carries its parts to the samples of a symbol.

Source of the nodes and their errors: L. N. Trefethen, Approximation Theory and Approximation Practice, 2013, ch. 7, 8.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

SPACING = 90
"""Fewest samples from one symbol to the next; with fewer, the slow part would reach half the sample rate."""

ROUNDING = 1e-17
"""Error of cosines that are carried from some lags to the others."""


class Grid(NamedTuple):
    """Where a spectrum is taken and how phases follow from it; weights hold the windows and the widths (Hz)."""

    slow_hz: np.ndarray
    slow_weight: np.ndarray
    """(J,) lines of the slow part."""
    node_s: np.ndarray
    blend: np.ndarray
    """(Q,) s from a symbol's middle where the slow part is taken, and (Q, M) polynomial that carries it to every
    sample."""
    low_hz: np.ndarray
    low_width: np.ndarray
    low_weight: np.ndarray
    low_cosine: np.ndarray
    low_blend: np.ndarray
    """(K,) nodes, evenly in log f, of the fast part's lower end, with their cosines at some lags (K, L) and the
    polynomial (L, M) that carries these to all lags."""
    high_hz: np.ndarray
    high_width: np.ndarray
    high_weight: np.ndarray
    """(H,) even nodes up to half the sample rate, for an inverse FFT."""


def _above(frequency_hz: np.ndarray, edge_hz: float) -> np.ndarray:
    """Window from 0 to 1 over the octave around `edge_hz`, smooth in log f."""
    place = np.clip(np.log2(frequency_hz / edge_hz) + 0.5, 0.0, 1.0)
    return place**3 * (10 + place * (6 * place - 15))


def _nodes(reach: float, error: float, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return Chebyshev nodes (Q,) from -1 to 1 and the polynomials (Q, P) that carry a function from them to `place`.

    Tones of up to `reach` radians to either side of zero then err by at most `error`: 2 (reach / 2)^Q / Q!.
    """
    rise, limit = math.log(reach / 2), math.log(error / 2)
    count = next(q for q in range(4, 100_000) if q * rise - math.lgamma(q + 1) < limit)
    roots = chebyshev.chebpts1(count)
    vander = chebyshev.chebvander(roots, count - 1)
    return roots, np.linalg.solve(vander.T, chebyshev.chebvander(place, count - 1).T)


def _lag_nodes(reach: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return lags (L,) in samples and the polynomials (L, M) that carry cosines from them to lags 0 .. M - 1.

    To rounding, for cosines of up to `reach` radians at lag M; all `count` lags where no fewer do.
    """
    roots, blend = _nodes(reach, ROUNDING, np.arange(count) / count)
    # Cosines are the same at both nodes of a pair; a node in the middle has no other.
    half = len(roots) // 2
    if len(roots) - half >= count:
        return np.arange(count, dtype=float), np.eye(count)
    later, earlier = blend[half:].copy(), blend[:half][::-1]
    later[len(later) - half :] += earlier
    return roots[half:] * count, later


@lru_cache(maxsize=8)
def grid(symbols: int, subcarriers: int, interval_s: float, sample_s: float) -> Grid:
    """Return the grid of a look of N symbols, `interval_s` apart, of M samples, `sample_s` apart.

    Needs interval_s of at least SPACING samples.
    """
    useful_s, band_hz = subcarriers * sample_s, 1 / sample_s
    slow_edge = 16 / interval_s
    high_edge = max(min(8, subcarriers / 8) / useful_s, 2 * slow_edge)

    step = 1 / (2 * symbols * interval_s)
    slow_hz = step * np.arange(1, math.ceil(math.sqrt(2) * slow_edge / step))
    slow_weight = step * (1 - _above(slow_hz, slow_edge))
    roots, blend = _nodes(math.pi * slow_hz[-1] * useful_s, 1e-9, 2 * (np.arange(subcarriers) + 0.5) / subcarriers - 1)

    octave = max(64, math.ceil(8 * high_edge * useful_s))
    count = math.ceil(octave * (1 + math.log2(high_edge / slow_edge)))
    low_hz = slow_edge / math.sqrt(2) * 2 ** (np.arange(count) / octave)
    low_width = low_hz * math.log(2) / octave
    low_weight = 2 * low_width * _above(low_hz, slow_edge) * (1 - _above(low_hz, high_edge))
    lags, low_blend = _lag_nodes(2 * math.pi * low_hz[-1] * useful_s, subcarriers)
    low_cosine = np.cos(2 * np.pi * sample_s * np.outer(low_hz, lags))

    period = subcarriers * math.ceil(max(8, 8 / (high_edge * useful_s)))
    high_hz = np.arange(1, period // 2 + 1) * band_hz / period
    high_weight = _above(high_hz, high_edge) * band_hz / period
    return Grid(
        slow_hz, slow_weight, roots / 2 * useful_s, blend, low_hz, low_width, low_weight, low_cosine, low_blend,
        high_hz, np.full(len(high_hz), high_hz[0]), high_weight,
    )  # fmt: skip
