"""Phase noise of a given spectrum at the scattered instants of a look: N symbols of M samples, long pauses between.

The spectrum is split by smooth windows that add up to one. Below 16 / T_r it is a sum of lines 1 / (2 N T_r) apart,
each with a Gaussian amplitude: exact from symbol to symbol, and inside a symbol interpolated to 1e-9. Above, two
symbols are independent, and the M samples of each are Gaussian with just the covariance of that part of the spectrum.
Phases within a symbol are worked out as even and odd part about its middle (`_toeplitz.parts`).
Source: D. B. Percival, A. T. Walden, Spectral Analysis for Univariate Time Series, 2020, ch. 11 (simulation by lines).
"""

import math
from functools import lru_cache

import numpy as np

from lowalt.common import normals
from lowalt.common.draws import Draws
from lowalt.effects.receiver import _toeplitz
from lowalt.effects.receiver._oscillator_grid import grid
from lowalt.effects.receiver._oscillator_loops import halved_lines, range_correlated, weighed_lines
from lowalt.effects.waveform import turned

BLOCK = 64
"""Samples whose fast part is summed together."""


def density(points: tuple, frequency_hz: np.ndarray) -> np.ndarray:
    """Return the two-sided spectral density of phase (rad^2/Hz) at offsets (Hz) from (offset Hz, dBc/Hz) pairs.

    Straight lines between the points in dB over log f, flat beyond them. Source: IEEE Std 1139-2008: L(f) is half the
    one-sided density of phase, which is the two-sided density.
    """
    offset, level = np.array(points, float).T
    return 10 ** (np.interp(np.log(frequency_hz), np.log(offset), level) / 10)


@lru_cache(maxsize=4)
def _weighted(points: tuple, at_key: tuple) -> tuple[np.ndarray, np.ndarray]:
    """The density at the fast part's nodes, low and high, times their weights."""
    at = grid(*at_key)
    return density(points, at.low_hz) * at.low_weight, density(points, at.high_hz) * at.high_weight


def covariance(points: tuple, at_key: tuple, delay_s: float | None) -> np.ndarray:
    """Return the covariance (M,) in rad^2 of the fast part at lags 0 .. M - 1 samples; `at_key` as in `slow_phase`."""
    at = grid(*at_key)
    low, high = _weighted(points, at_key)
    spectrum = np.zeros(len(high) + 1)
    if delay_s is None:
        spectrum[1:] = high
    else:
        low, given = np.empty(len(low)), low
        range_correlated(given, at.low_hz, at.low_width, delay_s, low)
        range_correlated(high, at.high_hz, at.high_width, delay_s, spectrum[1:])
    fast = np.fft.irfft(spectrum, 2 * len(high), norm="forward")[: at.low_blend.shape[1]]
    return low @ at.low_cosine @ at.low_blend + fast


@lru_cache(maxsize=2)
def _lines(points: tuple, at_key: tuple) -> np.ndarray:
    """Amplitudes (J,) in rad of the slow part's lines."""
    at = grid(*at_key)
    return np.sqrt(2 * density(points, at.slow_hz) * at.slow_weight)


@lru_cache(maxsize=4)
def _waves(at_key: tuple) -> tuple[np.ndarray, np.ndarray]:
    """Cosines and sines of lines from a symbol's middle to its later nodes: of every 2 N lines, and of those between.

    (Q, K), the sines behind the cosines, and none for a node in the middle; (2, ceil(Q / 2), 2 N), cosines and sines.
    """
    at, turns = grid(*at_key), 2 * at_key[0]
    later = 2 * np.pi * at.slow_hz[0] * at.node_s[len(at.node_s) // 2 :]
    every = np.outer(later, np.arange(len(at.slow_hz) // turns + 1) * turns)
    between = np.outer(later, np.arange(turns))
    sines = np.sin(every[2 * len(later) - len(at.node_s) :])
    return np.concatenate([np.cos(every), sines]), np.stack([np.cos(between), np.sin(between)])


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


def _slow_at_nodes(
    points: tuple, at_key: tuple, delay_s: float | None, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return even (N, ceil(Q / 2)) and odd part (N, Q // 2) in rad of the slow part of a drawn phase, at the nodes.

    Numbers drawn for the lines are their amplitudes at the middle of the first symbol.
    """
    at, symbols, amplitude = grid(*at_key), at_key[0], _lines(points, at_key)
    if isinstance(rng, Draws):
        drawn = normals.circular(rng.words(2 * len(amplitude)))
    else:
        drawn = np.ascontiguousarray(rng.standard_normal((len(amplitude), 2)).T)
    # Lines 2 N apart have equal phases at the symbols' middles: add them, then do one short transform a node.
    every, between = _waves(at_key)
    nodes, turns = len(every), 2 * symbols
    lines = np.empty((every.shape[1], 2, turns))
    step = None if delay_s is None else np.pi * at.slow_hz[0] * delay_s
    weighed_lines(drawn, amplitude, *_delays(step, every.shape[1], turns), lines)
    folded = (every @ lines.reshape(-1, 2 * turns)).reshape(nodes, 2, turns)
    halves = np.empty((nodes, symbols + 1), np.complex128)
    halved_lines(folded, between, halves)
    found = np.fft.irfft(halves, turns, norm="forward")[:, :symbols].T
    return found[:, : between.shape[1]], found[:, between.shape[1] :]


def _delays(step: float | None, rows: int, turns: int) -> tuple[np.ndarray, np.ndarray]:
    """Return unit phasors (R,) of every multiple of `turns` steps (rad) and (turns,) of the steps between.

    The sine of a product's angle is half the factor on a line's amplitude; without a step, the factor is one.
    """
    if step is None:
        return np.full(rows, 0.5j), np.ones(turns, np.complex128)
    return turned(step * turns * np.arange(rows)), turned(step * np.arange(turns))


def slow_phase(points: tuple, at_key: tuple, delay_s: float | None, rng: np.random.Generator) -> np.ndarray:
    """Return the slow part (N, M) in rad of a drawn phase; `at_key` are the arguments of `grid`."""
    slow = _slow_at_nodes(points, at_key, delay_s, rng)
    return _toeplitz.joined(*(nodes @ blend for nodes, blend in zip(slow, _blends(at_key), strict=True)))


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
    slow = _slow_at_nodes(points, at_key, delay_s, rng)
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
