"""Phase noise of a given spectrum at the scattered instants of a look: N symbols of M samples, long pauses between.

The spectrum is split by smooth windows that add up to one. Below 16 / T_r it is a sum of lines 1 / (2 N T_r) apart,
each with a Gaussian amplitude: exact from symbol to symbol, and inside a symbol interpolated to 1e-9. Above, two
symbols are independent, and the M samples of each are Gaussian with just the covariance of that part of the spectrum.
Phases within a symbol are worked out as even and odd part about its middle (`_toeplitz.parts`).
Source: D. B. Percival, A. T. Walden, Spectral Analysis for Univariate Time Series, 2020, ch. 11 (simulation by lines).
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from lowalt.common import normals
from lowalt.common.draws import Draws
from lowalt.effects.receiver import _toeplitz
from lowalt.effects.receiver._oscillator_loops import weighed_lines
from lowalt.effects.waveform import turned

SPACING = 90
"""Fewest samples from one symbol to the next; with fewer, the slow part would reach half the sample rate."""

BLOCK = 64
"""Samples whose fast part is summed together."""


class Grid(NamedTuple):
    """Where a spectrum is taken and how phases follow from it; weights hold the windows and the widths (Hz)."""

    slow_hz: np.ndarray
    slow_weight: np.ndarray
    """(J,) lines of the slow part."""
    node_s: np.ndarray
    blend: np.ndarray
    """(Q,) s into a symbol where the slow part is taken, and (Q, M) polynomial that carries it to every sample."""
    low_hz: np.ndarray
    low_width: np.ndarray
    low_weight: np.ndarray
    low_cosine: np.ndarray
    """(K,) nodes, evenly in log f, of the fast part's lower end, with their cosines at all lags (K, M)."""
    high_hz: np.ndarray
    high_weight: np.ndarray
    """(H,) even nodes up to half the sample rate, for an inverse FFT."""


def density(points: tuple, frequency_hz: np.ndarray) -> np.ndarray:
    """Return the two-sided spectral density of phase (rad^2/Hz) at offsets (Hz) from (offset Hz, dBc/Hz) pairs.

    Straight lines between the points in dB over log f, flat beyond them. Source: IEEE Std 1139-2008: L(f) is half the
    one-sided density of phase, which is the two-sided density.
    """
    offset, level = np.array(points, float).T
    return 10 ** (np.interp(np.log(frequency_hz), np.log(offset), level) / 10)


def _above(frequency_hz: np.ndarray, edge_hz: float) -> np.ndarray:
    """Window from 0 to 1 over the octave around `edge_hz`, smooth in log f."""
    place = np.clip(np.log2(frequency_hz / edge_hz) + 0.5, 0.0, 1.0)
    return place**3 * (10 + place * (6 * place - 15))


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
    # Chebyshev nodes of a tone of a radians to either side err by 2 (a / 2)^Q / Q!.
    reach = math.pi * slow_hz[-1] * useful_s
    nodes = next(q for q in range(4, 1000) if 2 * (reach / 2) ** q < 1e-9 * math.factorial(q))
    roots = chebyshev.chebpts1(nodes)
    place = 2 * (np.arange(subcarriers) + 0.5) / subcarriers - 1
    vander = chebyshev.chebvander(roots, nodes - 1)
    blend = np.linalg.solve(vander.T, chebyshev.chebvander(place, nodes - 1).T)
    node_s = (roots + 1) / 2 * useful_s - 0.5 * sample_s

    octave = max(64, math.ceil(8 * high_edge * useful_s))
    count = math.ceil(octave * (1 + math.log2(high_edge / slow_edge)))
    low_hz = slow_edge / math.sqrt(2) * 2 ** (np.arange(count) / octave)
    low_width = low_hz * math.log(2) / octave
    low_weight = 2 * low_width * _above(low_hz, slow_edge) * (1 - _above(low_hz, high_edge))
    low_cosine = np.cos(2 * np.pi * sample_s * np.outer(low_hz, np.arange(subcarriers)))

    period = subcarriers * math.ceil(max(8, 8 / (high_edge * useful_s)))
    high_hz = np.arange(1, period // 2 + 1) * band_hz / period
    high_weight = _above(high_hz, high_edge) * band_hz / period
    return Grid(
        slow_hz, slow_weight, node_s, blend, low_hz, low_width, low_weight, low_cosine, high_hz, high_weight
    )  # fmt: skip


def correlated(frequency_hz: np.ndarray, width_hz: np.ndarray | float, delay_s: float | None) -> np.ndarray | float:
    """Return the factor on the density of phi(t) - phi(t - delay): 4 sin^2(pi f delay), mean over each node's width.

    1 for delay None, an oscillator that is not shared. Source: M. C. Budge, M. P. Burt, Range
    correlation effects on phase and amplitude noise, IEEE Southeastcon 1993.
    """
    if delay_s is None:
        return 1.0
    plain = 4 * np.sin(np.pi * frequency_hz * delay_s) ** 2
    share = np.sinc(width_hz * delay_s)
    return plain * share + 2 * (1 - share)


@lru_cache(maxsize=4)
def _weighted(points: tuple, at_key: tuple) -> tuple[np.ndarray, np.ndarray]:
    """The density at the fast part's nodes, low and high, times their weights."""
    at = grid(*at_key)
    return density(points, at.low_hz) * at.low_weight, density(points, at.high_hz) * at.high_weight


def covariance(points: tuple, at_key: tuple, delay_s: float | None) -> np.ndarray:
    """Return the covariance (M,) in rad^2 of the fast part at lags 0 .. M - 1 samples; `at_key` as in `slow_phase`."""
    at = grid(*at_key)
    low, high = _weighted(points, at_key)
    low = low * correlated(at.low_hz, at.low_width, delay_s)
    high = high * correlated(at.high_hz, at.high_hz[0], delay_s)
    period = 2 * len(high)
    return low @ at.low_cosine + period * np.fft.irfft(np.append(0.0, high), period)[: at.low_cosine.shape[1]]


@lru_cache(maxsize=2)
def _lines(points: tuple, at_key: tuple) -> np.ndarray:
    """Amplitudes (J,) in rad of the slow part's lines."""
    at = grid(*at_key)
    return np.sqrt(2 * density(points, at.slow_hz) * at.slow_weight)


@lru_cache(maxsize=4)
def _twists(at_key: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Turns of the lines up to each node of a symbol: (Q, K) for every 2 N lines, (Q, 2 N) for the lines between.

    Lines are evenly apart from zero frequency, so a line's turn is the product of two.
    """
    at, turns = grid(*at_key), 2 * at_key[0]
    every = np.arange(len(at.slow_hz) // turns + 1) * turns
    return tuple(turned(2 * np.pi * at.slow_hz[0] * np.outer(at.node_s, lines)) for lines in (every, np.arange(turns)))


@lru_cache(maxsize=4)
def _blends(at_key: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Polynomials that carry even (ceil(Q / 2), ceil(M / 2)) and odd (Q // 2, M // 2) part from nodes to samples."""
    even, odd = _toeplitz.parts(grid(*at_key).blend)
    even, odd = _toeplitz.parts(even.T)[0].T, _toeplitz.parts(odd.T)[1].T
    # Both nodes of a pair have a share; a node in the middle has no other.
    pairs = slice(len(even) - len(odd), None)
    even[pairs] *= 2
    return even, 2 * odd


@lru_cache(maxsize=4)
def _weights(points: tuple, at_key: tuple, delay_s: float | None) -> list[np.ndarray]:
    """Rows that drawn numbers weigh, of the even part (:, ceil(M / 2)) and of the odd part (:, M // 2).

    Those of `_blends` come first, then a square root of the fast part's covariance; where it is zero, there is none.
    """
    blends, lags = _blends(at_key), covariance(points, at_key, delay_s)
    if lags[0] <= 0:
        return list(blends)
    # A noise floor far below that of any oscillator keeps the matrix positive definite where a spectrum has none.
    lags[0] *= 1 + 4 * np.finfo(float).eps * len(lags) ** 2
    weights = [np.empty((sum(blend.shape), blend.shape[1])) for blend in blends]
    for rows, blend in zip(weights, blends, strict=True):
        rows[: len(blend)] = blend
    _toeplitz.roots(lags, *(rows[len(blend) :] for rows, blend in zip(weights, blends, strict=True)))
    return weights


def _even_turns(step: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return sine and cosine (2, S) of every S-th multiple of step, and (2, S) of the first S, S^2 more than `count`.

    Multiples of both kinds add up to each of step, ..., count step.
    """
    side = math.isqrt(count) + 1
    few, many = step * np.arange(side), step * side * np.arange(side)
    return np.stack([np.sin(many), np.cos(many)]), np.stack([np.sin(few), np.cos(few)])


def _slow_at_nodes(points: tuple, at_key: tuple, delay_s: float | None, rng: np.random.Generator) -> np.ndarray:
    """Return the slow part (N, Q) in rad of a drawn phase, at the nodes of each symbol."""
    at, symbols = grid(*at_key), at_key[0]
    amplitude = _lines(points, at_key)
    drawn = rng.standard_normal((len(amplitude), 2))
    # Lines 2 N apart have equal phases at the symbols' starts: add them, then do one short transform a node.
    every, between = _twists(at_key)
    turns = 2 * symbols
    lines = np.empty(every.shape[1] * turns, np.complex128)
    if delay_s is None:
        lines[0], lines[len(drawn) + 1 :] = 0.0, 0.0
        lines[1 : len(drawn) + 1] = drawn.view(np.complex128)[:, 0] * amplitude
    else:
        weighed_lines(drawn, amplitude, *_even_turns(np.pi * at.slow_hz[0] * delay_s, len(amplitude)), lines)
    folded = every @ lines.reshape(-1, turns) * between
    return turns * np.fft.ifft(folded, axis=1)[:, :symbols].real.T


def slow_phase(points: tuple, at_key: tuple, delay_s: float | None, rng: np.random.Generator) -> np.ndarray:
    """Return the slow part (N, M) in rad of a drawn phase; `at_key` are the arguments of `grid`."""
    return _slow_at_nodes(points, at_key, delay_s, rng) @ grid(*at_key).blend


def _weighed(drawn: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The product (N, K) of drawn numbers (N, J + K) and weights (J + K, K) whose last K rows are a triangle."""
    size, before = weights.shape[1], len(weights) - weights.shape[1]
    result = np.empty((len(drawn), size))
    # A block of samples asks only for the draws up to its end.
    for first in range(0, size, BLOCK):
        last = min(first + BLOCK, size)
        np.matmul(drawn[:, : before + last], weights[: before + last, first:last], out=result[:, first:last])
    return result


def parts(
    points: tuple, at_key: tuple, delay_s: float | None, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return even (N, ceil(M / 2)) and odd part (N, M // 2) in rad of what `phase` returns (`_toeplitz.parts`)."""
    slow = _toeplitz.parts(_slow_at_nodes(points, at_key, delay_s, rng))
    weights = _weights(points, at_key, delay_s)
    if len(weights[0]) == slow[0].shape[1]:
        return slow[0] @ weights[0], slow[1] @ weights[1]
    even, odd = drawn = [np.empty((len(slow[0]), len(rows))) for rows in weights]
    for numbers, nodes in zip(drawn, slow, strict=True):
        numbers[:, : nodes.shape[1]] = nodes
    shape = at_key[:2]
    if isinstance(rng, Draws) and shape[1] % 2 == 0:
        normals.apart(rng.words(math.prod(shape)), even, odd)
    else:
        numbers = rng.standard_normal(shape)
        even[:, slow[0].shape[1] :], odd[:, slow[1].shape[1] :] = numbers[:, ::2], numbers[:, 1::2]
    # Both parts are products of drawn numbers and rows of samples, so one product adds slow and fast part.
    return _weighed(even, weights[0]), _weighed(odd, weights[1])


def phase(points: tuple, at_key: tuple, delay_s: float | None, rng: np.random.Generator) -> np.ndarray:
    """Return drawn phase noise (N, M) in rad of the spectrum `points` at the instants of `grid(*at_key)`.

    delay_s: return phi(t) - phi(t - delay) instead, None for phi itself.
    """
    return _toeplitz.joined(*parts(points, at_key, delay_s, rng))
