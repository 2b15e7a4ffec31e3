"""Wrong range cells: with a given probability, the detector takes a cell near the chosen one."""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.scene.checks import CheckedScene
from lowalt.scene.waveform import Look

SOURCE = (
    "this project's own error model, for the imperfect range-bin selection that the paper leaves "
    "out (Luo et al., footnote to Eq. 7's signal model); wrong cells that follow from noise come "
    "with the receiver's noise"
)
DEFAULTS = {"probability": 0.1, "spread_cells": 2}
IDLE = [{"probability": 0}, {"spread_cells": 0}]


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a spread that reaches around all range cells."""
    cells = scene.network.subcarriers
    spread = settings["spread_cells"]
    if 2 * spread >= cells:
        raise InputError(
            f"effects.cell_error.spread_cells: {spread}, expected less than half of {cells} range "
            "cells"
        )


def choose(
    settings: dict, chosen: np.ndarray, cells: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return the chosen cells (N,) int64, each wrong with `probability`.

    cells: (N, M), which wrap around as ranges do. A wrong cell is off by a whole number of cells,
    uniform on -spread_cells .. spread_cells without 0. 2 N numbers are drawn.
    """
    wrong, position = rng.random((2, len(chosen)))
    spread = settings["spread_cells"]
    # A whole number of 0 .. 2 spread - 1; then -spread .. -1 and, past the gap at 0, 1 .. spread.
    number = np.minimum((position * (2 * spread)).astype(np.int64), 2 * spread - 1)
    error = number - spread
    error += error >= 0
    moved = np.where(wrong < settings["probability"], error, 0)
    return np.asarray(chosen + moved, np.int64) % cells.shape[1]
