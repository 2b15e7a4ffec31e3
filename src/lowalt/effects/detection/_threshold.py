"""Thresholds of detectors at a constant false-alarm rate (CFAR), and the search for a target's cell with them."""

from functools import lru_cache

import numpy as np
from scipy.optimize import brentq

from lowalt.common.jit import LEAN, kernel

LOOPS = kernel(error_model="numpy")


@lru_cache(maxsize=64)
def factor(kind: str, count: int, rank: int, false_alarm: float) -> float:
    """Return the threshold of a cell over the noise estimate of `count` cells.

    A cell of noise exceeds it with the probability `false_alarm`.

    kind: ca, where the estimate is the cells' mean power, or os, where it is the power of rank `rank` (1 the smallest).
    Noise is complex Gaussian. Source: Finn & Johnson 1968 (ca); Rohling 1983, Eq. 12 (os).
    """
    if kind == "ca":
        return count * (false_alarm ** (-1.0 / count) - 1.0)
    order = count - np.arange(rank)
    return float(brentq(lambda a: -np.log1p(a / order).sum() - np.log(false_alarm), 0.0, 1e9, xtol=1e-9))


@LOOPS
def _exceeds(padded, cell, guard, training, rank, scale):
    """Whether a cell exceeds `scale` times the mean of its training cells, or their ordered statistic (rank > 0).

    It exceeds the statistic of rank k where it exceeds k of the training cells, which needs no sorting.
    """
    value, total, below = padded[cell + guard + training], 0.0, 0
    for k in range(training):
        left, right = padded[cell + k], padded[cell + 2 * guard + training + 1 + k]
        total += left + right
        below += int(scale * left < value) + int(scale * right < value)
    return below >= rank if rank > 0 else value > scale * total / (2 * training)


@LOOPS
def search(power, low, high, scale, guard, training, rank, padded):
    """Return the strongest of cells low .. high - 1 (mod M) of `power` (M,) above its threshold, -1 for none.

    scale: factor on the noise estimate, 0 for no threshold; padded: work array (M + 2 guard + 2 training,).
    """
    count, reach = len(power), guard + training
    if scale > 0.0:
        padded[reach : reach + count] = power
        padded[:reach] = power[count - reach :]
        padded[reach + count :] = power[:reach]
    best, most = -1, -1.0
    for place in range(low, high):
        cell = place % count
        if power[cell] > most and (scale == 0.0 or _exceeds(padded, cell, guard, training, rank, scale)):
            best, most = cell, power[cell]
    return best


@LOOPS
def follow(power, start, gate, gain, scale, guard, training, rank, chosen, found):
    """Fill chosen (N,) and found (N,) with the cell of each symbol's power (N, M), and whether it was detected.

    gate: half the width of the gate round the predicted cell, negative for none; start: the cell predicted for the
    first symbol; gain: of the alpha-beta filter. A symbol without a detection takes the predicted cell.
    """
    count = power.shape[1]
    padded = np.empty(count + 2 * (guard + training))
    place, rate = float(start), 0.0
    second = gain * gain / (2.0 - gain)
    for n in range(len(power)):
        place += rate
        middle = int(np.floor(place + 0.5))
        low, high = (0, count) if gate < 0 else (middle - gate, middle + gate + 1)
        cell = search(power[n], low, high, scale, guard, training, rank, padded)
        found[n] = cell >= 0
        chosen[n] = cell if cell >= 0 else middle % count
        if cell >= 0 and gate < 0:
            place = float(cell)
        elif cell >= 0:
            off = cell - place
            off -= count * np.floor(off / count + 0.5)
            place += gain * off
            rate += second * off


@LEAN
def powers(cells, out):
    """Fill out (N, M) with the power |Y|^2 of range cells (N, M) complex."""
    for n in range(len(cells)):
        given, row = cells[n], out[n]
        for m in range(np.uint64(len(row))):
            row[m] = given[m].real * given[m].real + given[m].imag * given[m].imag
