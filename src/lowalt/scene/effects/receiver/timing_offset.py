"""Timing offset: the receive window starts late or early, and every echo seems nearer or farther.

A window inside the cyclic prefix still holds one whole period, so the slip is exactly a linear phase over subcarriers.
Past the prefix it would take in the neighbouring symbol, whose data no scene states: such a scene is refused.
"""

import numpy as np

from lowalt.scene.checks import CheckedScene
from lowalt.scene.effects.receiver import offsets
from lowalt.scene.view import Displacement, View
from lowalt.scene.waveform import Look

SOURCE = (
    "M. Speth, S. A. Fechtel, G. Fock, H. Meyr, Optimum receiver design for wireless broad-band systems using OFDM I, "
    "IEEE Trans. Commun. 47(11), 1999 (window offset inside the guard interval is a linear phase)"
)
DEFAULTS = {"fixed_s": 0.0, "sigma_s": 2e-8, "prefix_slack_s": 2.9e-7}
IDLE = [{"fixed_s": 0, "sigma_s": 0}]


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a slip that can leave the cyclic prefix."""
    slip_s = offsets.largest(settings["fixed_s"], settings["sigma_s"])
    offsets.check_slip("timing_offset", slip_s, settings["prefix_slack_s"])


def receive(settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) of a window that starts late by d: subcarrier m turns by exp(j 2 pi (m - M // 2) df d).

    A late window makes all echoes seem nearer by c d / 2. The oscillator's own phase runs on and is not touched.
    Source: Speth et al. 1999; one draw a sample and station.
    """
    return offsets.delayed(samples, -_late_s(settings, rng), look)


def displaced(settings: dict, view: View, rng: np.random.Generator) -> Displacement:
    """Return how early all echoes appear."""
    return Displacement(delay_s=-_late_s(settings, rng))


def _late_s(settings: dict, rng: np.random.Generator) -> float:
    """How late the window starts (s)."""
    return settings["fixed_s"] + settings["sigma_s"] * offsets.drawn(rng)
