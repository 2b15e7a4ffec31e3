"""Beam squint.

The arrays' phases follow each subcarrier's frequency, the beams' weights are set for the lowest
one.

Element i of a row then has the phase pi i (kappa_m x - kappa_k x_0) instead of pi i kappa_k (x -
x_0). `scene.response` sums the arrays at a few frequencies of the band where a scene names this
effect.
"""

import numpy as np

from lowalt.scene.truth import array_turns
from lowalt.scene.view import Displacement, View

SOURCE = (
    "Mailloux, Phased Array Antenna Handbook, 3rd ed., 2018, section 1.3.4 (phase-steered arrays "
    "over a bandwidth)"
)
DEFAULTS: dict[str, float] = {}


def waves(settings: dict) -> dict[str, bool]:
    """Return how arrays are summed."""
    return {"squint": True}


def displaced(settings: dict, view: View, rng: np.random.Generator) -> Displacement:
    """Return how early the arrays' middles hear an echo.

    Without squint the arrays turn all subcarriers alike.
    """
    return Displacement(delay_s=-array_turns(view) / view.station.frequency_hz)
