"""Carrier offset: the receiver's oscillator is off its frequency.

Every line moves and subcarriers leak.
"""

import numpy as np

from lowalt.scene.checks import CheckedScene
from lowalt.scene.laws import offsets
from lowalt.scene.view import Displacement, View
from lowalt.scene.waveform import Look, oscillator_hz

SOURCE = (
    "P. H. Moose, A technique for orthogonal frequency division multiplexing frequency offset "
    "correction, IEEE Trans. Commun. 42(10), 1994, Eqs. 1 to 4; default: 3 sigma at the 0.05 ppm "
    "of 3GPP TS 38.104, 6.5.1"
)
DEFAULTS = {"fixed_ppm": 0.0, "sigma_ppm": 0.017}
STREAM = "oscillator"
IDLE = [{"fixed_ppm": 0, "sigma_ppm": 0}]
UNMODELLED = ("fmcw", "cw")


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError where transmitter and receiver share one oscillator.

    An oscillator has no offset from itself.
    """
    offsets.check_oscillator("carrier_offset", scene)


def receive(
    settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return the samples (N, M) times exp(j 2 pi F t).

    t: their absolute times n T_r + i / (M df).

    F is positive where the receiver's oscillator is too low: all lines rise by F, and fold at half
    the symbol rate.
    Source: Moose 1994. One draw per sample and station.
    """
    return offsets.risen(samples, 1e-6 * _ppm(settings, rng) * look.oscillator_hz, look)


def displaced(settings: dict, view: View, rng: np.random.Generator) -> Displacement:
    """Return by how much all lines rise."""
    return Displacement(
        rise_hz=1e-6 * _ppm(settings, rng) * oscillator_hz(view.network, view.station)
    )


def _ppm(settings: dict, rng: np.random.Generator) -> float:
    """The receiver's error (ppm), positive where its oscillator is too low."""
    return settings["fixed_ppm"] + settings["sigma_ppm"] * offsets.drawn(rng)
