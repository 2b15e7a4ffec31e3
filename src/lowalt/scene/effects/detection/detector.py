"""Detection of the target's cell: a threshold at a constant false-alarm rate (CFAR), within a gate that follows it.

The paper takes the strongest of all cells. Behind noise in all cells, that is often a wrong one: at an SNR of 3 dB the
right one of 256 wins 11 % of the symbols, at 8 dB 58 %; behind land it is the land's. A radar keeps a track instead. It
begins where the beam was pointed, and the cells about the predicted one are searched. Of those above their threshold
the strongest is taken; where there are none, the predicted one.
"""

import numpy as np
from scipy.ndimage import convolve1d

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.errors import InputError
from lowalt.scene.checks import CheckedScene
from lowalt.scene.waveform import Look

SOURCE = (
    "cell averaging: Finn & Johnson, Adaptive detection mode with threshold control, RCA Review 29, 1968; alpha-beta "
    "filter: Benedict & Bordner, Synthesis of an optimal set of radar track-while-scan smoothing equations, IRE Trans. "
    "Automatic Control 7, 1962; range error at the aim of one range cell of 30 MHz: estimate"
)
DEFAULTS = {
    "range_error_m": 5.0, "false_alarm": 1e-3, "guard": 2, "training": 16, "gate_cells": 3, "gain": 0.05,
}  # fmt: skip


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for training cells or a gate that reach around all range cells."""
    cells = scene.network.subcarriers
    reach = {"guard + training": settings["guard"] + settings["training"], "gate_cells": settings["gate_cells"]}
    for name, count in reach.items():
        if 2 * count >= cells:
            raise InputError(f"effects.detector.{name}: {count}, expected less than half of {cells} range cells")


def factor(count: int, false_alarm: float) -> float:
    """Return the threshold of a cell over the mean power of `count` cells.

    A cell of complex Gaussian noise exceeds it with the probability `false_alarm`. Source: Finn & Johnson 1968.
    """
    return count * (false_alarm ** (-1.0 / count) - 1.0)


def exceeds(settings: dict, power: np.ndarray) -> np.ndarray:
    """Return which cells of the powers (N, M) exceed their threshold, (N, M) bool; ranges wrap around.

    The threshold follows the mean of `training` cells on either side, beyond the `guard` cells next to the cell.
    """
    guard, training = settings["guard"], settings["training"]
    weights = np.full(2 * (guard + training) + 1, 0.5 / training)
    weights[training:-training] = 0.0
    return power > factor(2 * training, settings["false_alarm"]) * convolve1d(power, weights, mode="wrap")


def choose(settings: dict, chosen: np.ndarray, cells: np.ndarray, look: Look, rng: np.random.Generator) -> np.ndarray:
    """Return the detected cells (N,) int64 of range cells (N, M).

    The track begins where the beam was pointed, with a normal error of `range_error_m` in range, drawn once a look. The
    alpha-beta filter takes over `gain` of the difference between a detected and the predicted cell, and its rate what
    suits that gain (Benedict & Bordner 1962).
    """
    power = cells.real**2 + cells.imag**2
    allowed, count = np.where(exceeds(settings, power), power, -1.0), cells.shape[1]
    gate, alpha = np.arange(-settings["gate_cells"], settings["gate_cells"] + 1), settings["gain"]
    beta = alpha * alpha / (2.0 - alpha)
    error_s = 2 * settings["range_error_m"] / SPEED_OF_LIGHT * rng.standard_normal()
    place, rate, result = (look.delay_s + error_s) / look.cell_s, 0.0, np.empty(len(cells), np.int64)
    for n, powers in enumerate(allowed):
        place += rate
        middle = int(np.floor(place + 0.5))
        best = int(powers[(middle + gate) % count].argmax())
        result[n] = middle % count
        if powers[(middle + gate[best]) % count] >= 0:
            result[n] = (middle + gate[best]) % count
            off = middle + gate[best] - place
            place += alpha * off
            rate += beta * off
    return result
