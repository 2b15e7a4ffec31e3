"""Timing offset: the receive window starts late or early, and every echo seems nearer or farther.

A window that starts within the cyclic prefix holds one whole period, so its offset d is exactly
the phase 2 pi (m - M // 2) df d on subcarrier m. A scene in which the window can leave the prefix
is refused.
"""

import numpy as np

from lowalt.scene.checks import CheckedScene
from lowalt.scene.laws import offsets
from lowalt.scene.view import Displacement, View
from lowalt.scene.waveform import Look

SOURCE = (
    "M. Speth, S. A. Fechtel, G. Fock, H. Meyr, Optimum receiver design for wireless broad-band "
    "systems using OFDM I, IEEE Trans. Commun. 47(11), 1999 (window offset inside the guard "
    "interval is a linear phase)"
)
DEFAULTS = {"fixed_s": 0.0, "sigma_s": 2e-8, "prefix_slack_s": 2.9e-7}
IDLE = [{"fixed_s": 0, "sigma_s": 0}]
UNMODELLED = ("fmcw", "cw")


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a slip that can leave the cyclic prefix."""
    slip_s = offsets.largest(settings["fixed_s"], settings["sigma_s"])
    offsets.check_slip("timing_offset", slip_s, settings["prefix_slack_s"])


def receive(
    settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return samples (N, M) of a window that starts late by d.

    Subcarrier m then turns by exp(j 2 pi (m - M // 2) df d).

    A late window makes all echoes appear nearer by c d / 2. The phase of the oscillator does not
    change.
    Source: Speth et al. 1999. One draw per sample and station.
    """
    return offsets.delayed(samples, -_late_s(settings, rng), look)


def displaced(settings: dict, view: View, rng: np.random.Generator) -> Displacement:
    """Return how early all echoes appear."""
    return Displacement(delay_s=-_late_s(settings, rng))


def _late_s(settings: dict, rng: np.random.Generator) -> float:
    """How late the window starts (s)."""
    return settings["fixed_s"] + settings["sigma_s"] * offsets.drawn(rng)
