"""Canceller of static clutter on range cells, over the symbols of a look.

The filters that let noise through stronger or weaker are scaled to unit noise gain, so that a set SNR means the same
before and behind them.
"""

import math
from itertools import pairwise

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.effects.waveform import Frame

SOURCE = (
    "M. A. Richards, Fundamentals of Radar Signal Processing, 2nd ed. 2014, 5.2 (pulse cancellers, their response and "
    "noise gain); M. I. Skolnik, Radar Handbook, 3rd ed. 2008, ch. 2 (recursive MTI filters)"
)
DEFAULTS = {"kind": "mean", "order": 1, "memory": 0.95}
DRAWS_NOTHING = True
ALONG_SYMBOLS = True
"""Every cell is filtered alike, so responses are too (`detecting.FiltersSymbols`)."""


def idle(settings: dict) -> bool:
    """Return True for kind none, or a difference of order 0."""
    return settings["kind"] == "none" or (settings["kind"] == "pulse" and settings["order"] == 0)


def gain(settings: dict) -> float:
    """Return the root of the filter's gain on white noise, by which it is divided.

    pulse: sum of squared binomials, C(2k, k); exponential: 2 a^2 / (1 + a); mean: taken as 1 (it is 1 - 1/N).
    """
    if settings["kind"] == "pulse":
        return math.sqrt(math.comb(2 * settings["order"], settings["order"]))
    if settings["kind"] == "exponential":
        return settings["memory"] * math.sqrt(2 / (1 + settings["memory"]))
    return 1.0


def response(settings: dict, turns: np.ndarray) -> np.ndarray:
    """Return the settled amplitude response at Doppler frequencies of `turns` cycles a symbol interval (f T_r).

    pulse: |2 sin(pi f T_r)|^k; exponential: a |1 - z^-1| / |1 - a z^-1|; mean: 1 except at 0. Divided by `gain`.
    Source: Richards 2014, 5.2.
    """
    delay = np.exp(-2j * np.pi * np.asarray(turns, float))
    if settings["kind"] == "pulse":
        return np.abs(1 - delay) ** settings["order"] / gain(settings)
    if settings["kind"] == "exponential":
        memory = settings["memory"]
        return memory * np.abs(1 - delay) / np.abs(1 - memory * delay) / gain(settings)
    return np.where(np.mod(turns, 1.0) == 0, 0.0, 1.0)


def amplifies(settings: dict) -> float:
    """Return how much larger an output symbol's error can be than the largest input symbol's, start-up included.

    The sum of the filter's absolute weights. pulse: of binomials; exponential: a on the newest symbol and as much on
    the older ones together, since constant echoes cancel; mean: 1 - 1/N twice, taken as 2.
    """
    if settings["kind"] == "pulse":
        return 2 ** settings["order"] / gain(settings)
    if settings["kind"] == "exponential":
        return 2 * settings["memory"] / gain(settings)
    return 2.0


def process(settings: dict, cells: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return range cells, or responses, (N, M) without echoes that stand still.

    mean: subtracts the look's mean. pulse: `order` first differences over symbols. exponential: subtracts a running
    mean with weights memory^n. The last two start as if the first symbol had lasted forever: their first output is
    zero, and clutter leaves no transient, though a moving target does. Source: Richards 2014, 5.2; nothing is drawn.
    """
    if settings["kind"] == "mean":
        given = np.ascontiguousarray(cells, np.complex128)
        moved = np.empty(given.shape, np.complex128)
        _without_mean(given.view(np.float64), np.zeros(2 * given.shape[1]), moved.view(np.float64))
        return moved
    if settings["kind"] == "pulse":
        for _ in range(settings["order"]):
            cells = _step(cells)
        return cells / gain(settings)
    result = _step(cells) * (settings["memory"] / gain(settings))
    for earlier, now in pairwise(result):
        now += settings["memory"] * earlier
    return result


def _step(cells: np.ndarray) -> np.ndarray:
    """First difference over symbols (N, M), zero at the first."""
    result = np.zeros_like(cells)
    np.subtract(cells[1:], cells[:-1], out=result[1:])
    return result


@LEAN
def _without_mean(cells, sums, out):
    """Fill out (N, K) with cells (N, K) less their mean over symbols; sums (K,): work space, zeros."""
    first = cells[0]
    for n in range(len(cells)):
        given, row = cells[n], out[n]
        # Subtract the first symbol before the mean: an echo that stands still then cancels to the last bit.
        for i in range(np.uint64(len(sums))):
            row[i] = given[i] - first[i]
            sums[i] += row[i]
    share = 1.0 / len(cells)
    for i in range(np.uint64(len(sums))):
        sums[i] *= share
    for n in range(len(out)):
        row = out[n]
        for i in range(np.uint64(len(sums))):
            row[i] -= sums[i]
