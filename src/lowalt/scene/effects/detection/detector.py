"""Detection of the target's cell: a threshold (CFAR) within a gate that follows the cell.

The threshold keeps a constant false-alarm rate.

The paper takes the strongest of all cells. Behind noise in all cells, that is often a wrong one: at
an SNR of 3 dB the right one of 256 wins 11 % of the symbols, at 8 dB 58 %; behind land it is the
land's. A radar keeps a track instead. It begins where the beam was pointed, and the cells about the
predicted one are searched. Of those above their threshold the strongest is taken; where there are
none, the predicted one.

The mean of the neighbouring cells (`cell_averaging`) rises with a second target among them, which
hides weaker ones. The value that three quarters of them do not exceed (`ordered_statistic`) ignores
up to a quarter of them. Side lobes of a target in range hide others too; the window `hann` lowers
them, at the cost of a main lobe twice as wide.
"""

import math

import numpy as np
from scipy.ndimage import convolve1d
from scipy.optimize import brentq

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.errors import InputError
from lowalt.numerics.portable import log
from lowalt.scene.checks import CheckedScene
from lowalt.scene.waveform import Look

SOURCE = (
    "cell averaging: Finn & Johnson, Adaptive detection mode with threshold control, RCA Review "
    "29, 1968; ordered statistic: Rohling, Radar CFAR thresholding in clutter and multiple target "
    "situations, IEEE Trans. Aerosp. Electron. Syst. 19(4), 1983, which advises three quarters; "
    "Hann window: Harris, On the use of windows for harmonic analysis with the discrete Fourier "
    "transform, Proc. IEEE 66(1), 1978; alpha-beta filter: Benedict & Bordner, Synthesis of an "
    "optimal set of radar track-while-scan smoothing equations, IRE Trans. Automatic Control 7, "
    "1962; range error at the aim of one range cell of 30 MHz: estimate"
)
DEFAULTS = {
    "range_error_m": 5.0,
    "false_alarm": 1e-3,
    "cfar": "cell_averaging",
    "range_window": "none",
    "guard": 2,
    "training": 16,
    "gate_cells": 3,
    "gain": 0.05,
}
TRIED = True
NAMES = {"cfar": ("cell_averaging", "ordered_statistic"), "range_window": ("none", "hann")}
HANN_REACH = 2
"""Range cells farther apart than this have independent noise behind a Hann window.

The distance counts in cells.
"""


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for training cells or a gate that reach around all range cells."""
    cells = scene.network.subcarriers
    reach = {
        "guard + training": settings["guard"] + settings["training"],
        "gate_cells": settings["gate_cells"],
    }
    for name, count in reach.items():
        if 2 * count >= cells:
            raise InputError(
                f"effects.detector.{name}: {count}, expected less than half of {cells} range cells"
            )
    check_threshold(settings)


def check_threshold(settings: dict) -> None:
    """Raise InputError for an unknown name.

    Raise it also for guard cells whose noise a Hann window makes like the cell's.
    """
    for key, names in NAMES.items():
        if settings[key] not in names:
            raise InputError(
                f"effects.detector.{key}: {settings[key]!r}, expected one of {', '.join(names)}"
            )
    if settings["range_window"] == "hann" and settings["guard"] < HANN_REACH:
        raise InputError(
            f"effects.detector.guard: {settings['guard']}, expected at least {HANN_REACH} with "
            "range_window: hann, behind which noise of neighbouring cells is alike"
        )


def factor(count: int, false_alarm: float) -> float:
    """Return the threshold of a cell over the mean power of `count` cells.

    A cell of complex Gaussian noise exceeds it with the probability `false_alarm`. Source: Finn &
    Johnson 1968.
    """
    return count * (false_alarm ** (-1.0 / count) - 1.0)


def ordered_factor(count: int, rank: int, false_alarm: float) -> float:
    """Return the threshold T of a cell over the `rank`-th smallest power of `count` cells.

    The rank is 1 to `count`.

    A cell of complex Gaussian noise exceeds it with the probability `false_alarm`, the product of
    (count - i) / (count - i + T) over i = 0 .. rank - 1. Source: Rohling 1983.
    """
    left = count - np.arange(rank)
    # No factor is smaller than that of i = rank - 1 or larger than that of i = 0, which bounds T
    # from above.
    most = count * (false_alarm ** (-1.0 / rank) - 1.0)

    def excess(t: float) -> float:
        """The logarithm of the probability over that of a false alarm, turned round."""
        return log(1.0 + t / left).sum() + math.log(false_alarm)

    return float(brentq(excess, 0.0, 2.0 * most, xtol=1e-12))


def windowed(settings: dict, cells: np.ndarray) -> np.ndarray:
    """Return range cells (N, M) as `range_window` shows them, scaled to unit noise gain.

    hann: the weights 1 - cos(2 pi m / M) on the M subcarriers, which are a sum of three
    neighbouring range cells.
    """
    if settings["range_window"] == "none":
        return cells
    before = np.roll(cells, 1, axis=1)
    after = np.roll(cells, -1, axis=1)
    return (2 * cells - before - after) / math.sqrt(6)


def exceeds(settings: dict, power: np.ndarray) -> np.ndarray:
    """Return which cells of the powers (N, M), `windowed`, exceed their threshold, (N, M) bool.

    Ranges wrap around.

    The threshold follows the `training` cells on either side, beyond the `guard` cells next to the
    cell: their mean, or the value that three quarters of them do not exceed. Behind a Hann window
    every third of them is used; their noise is then independent, and the false-alarm rate is exact.
    """
    guard = settings["guard"]
    training = settings["training"]
    reach = guard + training
    step = 1 if settings["range_window"] == "none" else 1 + HANN_REACH
    used = np.arange(guard + 1, reach + 1, step)
    used = np.concatenate([-used, used])
    if settings["cfar"] == "cell_averaging":
        weights = np.zeros(2 * reach + 1)
        weights[reach + used] = 1.0 / len(used)
        mean = convolve1d(power, weights, mode="wrap")
        return power > factor(len(used), settings["false_alarm"]) * mean
    rank = math.ceil(0.75 * len(used))
    scaled = ordered_factor(len(used), rank, settings["false_alarm"]) * power
    # A cell exceeds the rank-th smallest of these thresholds where it exceeds at least `rank` of
    # them.
    below = np.zeros(power.shape, np.int32)
    for offset in used:
        below += np.roll(scaled, offset, axis=1) < power
    return below >= rank


def choose(
    settings: dict, chosen: np.ndarray, cells: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return the detected cells (N,) int64 of range cells (N, M).

    The track begins where the beam was pointed, with a normal error of `range_error_m` in range,
    drawn once per look. The alpha-beta filter corrects the predicted cell by `gain` times its
    difference to the detected one, and its rate by the beta of Benedict & Bordner (1962). The range
    window serves this search only.
    """
    seen = windowed(settings, cells)
    power = seen.real**2 + seen.imag**2
    allowed = np.where(exceeds(settings, power), power, -1.0)
    count = cells.shape[1]
    gate = np.arange(-settings["gate_cells"], settings["gate_cells"] + 1)
    alpha = settings["gain"]
    beta = alpha * alpha / (2.0 - alpha)
    error_s = 2 * settings["range_error_m"] / SPEED_OF_LIGHT * rng.standard_normal()
    predicted = (look.delay_s + error_s) / look.cell_s
    rate = 0.0
    result = np.empty(len(cells), np.int64)
    for n, powers in enumerate(allowed):
        predicted += rate
        middle = int(np.floor(predicted + 0.5))
        best = int(powers[(middle + gate) % count].argmax())
        result[n] = middle % count
        if powers[(middle + gate[best]) % count] >= 0:
            result[n] = (middle + gate[best]) % count
            off = middle + gate[best] - predicted
            predicted += alpha * off
            rate += beta * off
    return result
