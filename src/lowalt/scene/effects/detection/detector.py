"""Detection of the target's cell: a threshold at a constant false-alarm rate (CFAR), within a gate that follows it.

The paper takes the strongest of all cells. Behind noise in all cells, that is often a wrong one: at an SNR of 3 dB the
right one of 256 wins 11 % of the symbols, at 8 dB 58 %; behind land it is the land's. A radar keeps a track instead. It
begins where the beam was pointed, and the cells about the predicted one are searched. Of those above their threshold
the strongest is taken; where there are none, the predicted one.
"""

import numpy as np
from scipy.ndimage import convolve1d
from scipy.optimize import brentq

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.errors import InputError
from lowalt.scene.checks import CheckedScene
from lowalt.scene.waveform import Look

SOURCE = (
    "cell averaging: Finn & Johnson, Adaptive detection mode with threshold control, RCA Review 29, 1968; ordered "
    "statistic: Rohling, Radar CFAR thresholding in clutter and multiple target situations, IEEE Trans. AES 19, 1983; "
    "alpha-beta filter: Benedict & Bordner, Synthesis of an optimal set of radar track-while-scan smoothing equations, "
    "IRE Trans. Automatic Control 7, 1962; range error at the aim of one range cell of 30 MHz: estimate"
)
DEFAULTS = {
    "start": "aim", "range_error_m": 5.0, "acquire": 32,
    "cfar": "ca", "false_alarm": 1e-3, "guard": 2, "training": 16, "rank": 0.75, "gate_cells": 3, "gain": 0.05,
}  # fmt: skip


def idle(settings: dict) -> bool:
    """Return True without threshold and gate: the strongest of all cells is then chosen, as without this effect."""
    return settings["cfar"] == "none" and settings["gate_cells"] is None


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for training cells or a gate that reach around all range cells."""
    cells = scene.network.subcarriers
    reach = {
        "guard + training": settings["guard"] + settings["training"] if settings["cfar"] != "none" else 0,
        "gate_cells": settings["gate_cells"] or 0,
    }
    for name, count in reach.items():
        if 2 * count >= cells:
            raise InputError(f"effects.detector.{name}: {count}, expected less than half of {cells} range cells")


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


def exceeds(settings: dict, power: np.ndarray) -> np.ndarray:
    """Return which cells of the powers (N, M) exceed their threshold, (N, M) bool; ranges wrap around."""
    if settings["cfar"] == "none":
        return np.ones(power.shape, bool)
    guard, training = settings["guard"], settings["training"]
    count = 2 * training
    away = [side * (guard + 1 + k) for side in (-1, 1) for k in range(training)]
    if settings["cfar"] == "ca":
        weights = np.full(2 * (guard + training) + 1, 1.0 / count)
        weights[training:-training] = 0.0
        return power > factor("ca", count, 0, settings["false_alarm"]) * convolve1d(power, weights, mode="wrap")
    rank = min(max(round(settings["rank"] * count), 1), count)
    scale = factor("os", count, rank, settings["false_alarm"])
    # A cell exceeds the statistic of rank k where it exceeds k of the training cells, which needs no sorting.
    return sum((scale * np.roll(power, place, axis=1) < power).astype(np.int16) for place in away) >= rank


def follow(settings: dict, power: np.ndarray, start: float) -> tuple[np.ndarray, np.ndarray]:
    """Return chosen cells (N,) int64 and whether each was detected (N,) bool, from the power (N, M) of the cells.

    start: the cell, a real number, at which the track begins. The alpha-beta filter takes over `gain` of the difference
    between a detected and the predicted cell, and its rate what suits that gain (Benedict & Bordner 1962).
    """
    symbols, count = power.shape
    allowed = np.where(exceeds(settings, power), power, -1.0)
    if settings["gate_cells"] is None:
        chosen = allowed.argmax(axis=1)
        detected = allowed[np.arange(symbols), chosen] >= 0
        # A symbol without a detection keeps the last cell.
        last = np.maximum.accumulate(np.where(detected, np.arange(symbols), -1))
        return np.where(last < 0, round(start) % count, chosen[last]), detected
    gate = np.arange(-settings["gate_cells"], settings["gate_cells"] + 1)
    alpha = settings["gain"]
    beta = alpha * alpha / (2.0 - alpha)
    chosen, detected = np.empty(symbols, np.int64), np.empty(symbols, bool)
    place, rate = start, 0.0
    for n in range(symbols):
        place += rate
        middle = int(np.floor(place + 0.5))
        cells = (middle + gate) % count
        best = int(allowed[n, cells].argmax())
        detected[n] = allowed[n, cells[best]] >= 0
        chosen[n] = cells[best] if detected[n] else middle % count
        if detected[n]:
            off = middle + gate[best] - place
            place += alpha * off
            rate += beta * off
    return chosen, detected


def choose(settings: dict, chosen: np.ndarray, cells: np.ndarray, look: Look, rng: np.random.Generator) -> np.ndarray:
    """Return the detected cells (N,) int64 of range cells (N, M).

    start: aim begins the track where the beam was pointed, with a normal error of `range_error_m` in range, drawn once
    a look; strongest begins it at the cell with the most power over the first `acquire` symbols, and draws nothing.
    """
    power = cells.real**2 + cells.imag**2
    if settings["start"] == "aim":
        error_s = 2 * settings["range_error_m"] / SPEED_OF_LIGHT * rng.standard_normal()
        start = (look.delay_s + error_s) / look.sample_s
    else:
        start = float(power[: settings["acquire"]].sum(axis=0).argmax())
    return follow(settings, power, start)[0]
