"""Detection of the target's cell: a threshold at a constant false-alarm rate (CFAR), within a gate that follows it.

The paper takes the strongest of all cells. Behind noise in all cells, that is often a wrong one: at an SNR of 3 dB the
right one of 256 wins 11 % of the symbols, at 8 dB 58 %. A radar keeps a track instead and searches the cells about the
predicted one. Of those above their threshold it takes the strongest; where there are none, it takes the predicted one.
"""

import math

import numpy as np

from lowalt.common.errors import InputError
from lowalt.effects.checks import CheckedScene
from lowalt.effects.detection import _threshold

SOURCE = (
    "cell averaging: Finn & Johnson, Adaptive detection mode with threshold control, RCA Review 29, 1968; ordered "
    "statistic: Rohling, Radar CFAR thresholding in clutter and multiple target situations, IEEE Trans. AES 19, 1983; "
    "alpha-beta filter: Benedict & Bordner, Synthesis of an optimal set of radar track-while-scan smoothing equations, "
    "IRE Trans. Automatic Control 7, 1962"
)
DEFAULTS = {
    "cfar": "ca", "false_alarm": 1e-3, "guard": 2, "training": 16, "rank": 0.75, "gate_cells": 3, "acquire": 32,
    "gain": 0.1,
}  # fmt: skip
DRAWS_NOTHING = True
CHOOSES_AFRESH = True
"""What was chosen before does not matter (`detecting.ChoosesAfresh`)."""


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
    for name, one in reach.items():
        if 2 * one >= cells:
            raise InputError(f"effects.detector.{name}: {one}, expected less than half of {cells} range cells")


def amplifies(settings: dict) -> float:
    """Return infinity: a threshold is a step, and a gate follows earlier steps."""
    return math.inf


def rank(settings: dict) -> int:
    """Return the rank among the training cells that settings name, 0 for their mean."""
    if settings["cfar"] != "os":
        return 0
    count = 2 * settings["training"]
    return min(max(round(settings["rank"] * count), 1), count)


def detect(settings: dict, power: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return chosen cells (N,) int64 and whether each was detected (N,) bool, from the power (N, M) of the cells.

    The track starts at the cell with the most power over the first `acquire` symbols. Cells wrap around as ranges do.
    """
    scale = 0.0
    if settings["cfar"] != "none":
        count = 2 * settings["training"]
        scale = _threshold.factor(settings["cfar"], count, rank(settings), settings["false_alarm"])
    gate = -1 if settings["gate_cells"] is None else settings["gate_cells"]
    chosen, found = np.empty(len(power), np.int64), np.empty(len(power), np.bool_)
    start = int(power[: settings["acquire"]].sum(axis=0).argmax())
    _threshold.follow(
        power, start, gate, float(settings["gain"]), scale, settings["guard"], settings["training"], rank(settings),
        chosen, found,
    )  # fmt: skip
    return chosen, found


def choose(settings: dict, chosen: np.ndarray, cells: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return the detected cells (N,) int64 of range cells (N, M); nothing is drawn."""
    power = np.empty(cells.shape)
    _threshold.powers(np.ascontiguousarray(cells, np.complex128), power)
    return detect(settings, power)[0]
