"""Phase noise of a given spectrum at the scattered instants of a look: N symbols of M samples, long pauses between.

The spectrum is split by smooth windows that add up to one. Below 16 / T_r it is a sum of lines 1 / (2 N T_r) apart,
each with a Gaussian amplitude: exact from symbol to symbol, and inside a symbol interpolated to 1e-9. Above, two
symbols are independent, and the M samples of each are Gaussian with just the covariance of that part of the spectrum.
Phases within a symbol are worked out as even and odd part about its middle (`_toeplitz.parts`).
Source: D. B. Percival, A. T. Walden, Spectral Analysis for Univariate Time Series, 2020, ch. 11 (simulation by lines).
"""

import math
from dataclasses import dataclass
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


@dataclass(frozen=True, eq=False)
class _Amounts:
    """What a spectrum amounts to on a grid; told apart by identity, since points are many numbers to compare."""

    low: np.ndarray
    high: np.ndarray
    """(K,), (H,) rad^2, the density at the fast part's nodes times their weights."""
    lines: np.ndarray
    """(J,) rad, amplitudes of the slow part's lines."""


@lru_cache(maxsize=4)
def _amounts(points: tuple, at_key: tuple) -> _Amounts:
    """The amounts of a spectrum on `grid(*at_key)`."""
    at = grid(*at_key)
    low, high = density(points, at.low_hz) * at.low_weight, density(points, at.high_hz) * at.high_weight
    return _Amounts(low, high, np.sqrt(2 * density(points, at.slow_hz) * at.slow_weight))


def covariance(points: tuple, at_key: tuple, delay_s: float | None) -> np.ndarray:
    """Return the covariance (M,) in rad^2 of the fast part at lags 0 .. M - 1 samples; `at_key` as in `slow_phase`."""
    return _covariance(_amounts(points, at_key), at_key, delay_s)


def _covariance(amounts: _Amounts, at_key: tuple, delay_s: float | None) -> np.ndarray:
    """The result of `covariance`."""
    at, low, high = grid(*at_key), amounts.low, amounts.high
    spectrum = np.zeros(len(high) + 1)
    if delay_s is None:
        spectrum[1:] = high
    else:
        low = np.empty(len(low))
        range_correlated(amounts.low, at.low_hz, at.low_width, delay_s, low)
        range_correlated(high, at.high_hz, at.high_width, delay_s, spectrum[1:])
    fast = np.fft.irfft(spectrum, 2 * len(high), norm="forward")[: at.low_blend.shape[1]]
    return low @ at.low_cosine @ at.low_blend + fast


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
def _weights(amounts: _Amounts, at_key: tuple, delay_s: float | None) -> list[np.ndarray]:
    """Rows that drawn numbers weigh, of the even part (:, ceil(M / 2)) and of the odd part (:, M // 2).

    Those of `_blends` come first, then a square root of the fast part's covariance.
    """
    blends, lags = _blends(at_key), _covariance(amounts, at_key, delay_s)
    weights = [np.empty((sum(blend.shape), blend.shape[1])) for blend in blends]
    for rows, blend in zip(weights, blends, strict=True):
        rows[: len(blend)] = blend
    even, odd = (rows[len(blend) :] for rows, blend in zip(weights, blends, strict=True))
    if lags[0] > 0:
        # A noise floor far below that of any oscillator keeps the matrix positive definite where a spectrum has none.
        lags[0] *= 1 + 4 * np.finfo(float).eps * len(lags) ** 2
        _toeplitz.roots(lags, even, odd)
    else:
        even[:], odd[:] = 0.0, 0.0
    return weights


def _slow_at_nodes(
    amplitude: np.ndarray, at_key: tuple, delay_s: float | None, drawn: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return even (N, ceil(Q / 2)) and odd part (N, Q // 2) in rad of the slow part of a drawn phase, at the nodes.

    amplitude (J,) rad of the lines; drawn (2, J): real and imaginary parts of the lines, over their amplitudes, at the
    middle of the first symbol.
    """
    at, symbols = grid(*at_key), at_key[0]
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
    amplitude = _amounts(points, at_key).lines
    slow = _slow_at_nodes(amplitude, at_key, delay_s, np.array(rng.standard_normal((len(amplitude), 2)).T, order="C"))
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
    amounts, shape = _amounts(points, at_key), at_key[:2]
    weights, amplitude = _weights(amounts, at_key, delay_s), amounts.lines
    even, odd = drawn = [np.empty((shape[0], len(rows))) for rows in weights]
    first = len(even[0]) - weights[0].shape[1], len(odd[0]) - weights[1].shape[1]
    if isinstance(rng, Draws) and shape[1] % 2 == 0:
        # All words at once, and each part of the numbers where it is asked for.
        words = rng.words(2 * len(amplitude) + math.prod(shape))
        lines = normals.circular(words[: 2 * len(amplitude)])
        normals.apart(words[2 * len(amplitude) :], even, odd)
    else:
        lines = np.array(rng.standard_normal((len(amplitude), 2)).T, order="C")
        numbers = rng.standard_normal(shape)
        even[:, first[0] :], odd[:, first[1] :] = numbers[:, ::2], numbers[:, 1::2]
    for numbers, nodes in zip(drawn, _slow_at_nodes(amplitude, at_key, delay_s, lines), strict=True):
        numbers[:, : nodes.shape[1]] = nodes
    # Slow and fast part are products of drawn numbers and rows of samples, so one product adds them.
    return _weighed(even, weights[0]), _weighed(odd, weights[1])


def phase(points: tuple, at_key: tuple, delay_s: float | None, rng: np.random.Generator) -> np.ndarray:
    """Return drawn phase noise (N, M) in rad of the spectrum `points` at the instants of `grid(*at_key)`.

    delay_s: return phi(t) - phi(t - delay) instead, None for phi itself.
    """
    return _toeplitz.joined(*parts(points, at_key, delay_s, rng))
