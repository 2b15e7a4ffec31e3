"""Timing offset: the receive window starts late or early, and every echo seems nearer or farther.

A window inside the cyclic prefix still holds one whole period, so the slip is exactly a linear phase over subcarriers.
Past the prefix it would take in the neighbouring symbol, whose data no scene states: such a scene is refused.
"""

import numpy as np

from lowalt.common.errors import InputError
from lowalt.effects import transforms
from lowalt.effects.checks import CheckedScene
from lowalt.effects.receiver import _offsets
from lowalt.effects.waveform import Frame, turned

SOURCE = (
    "M. Speth, S. A. Fechtel, G. Fock, H. Meyr, Optimum receiver design for wireless broad-band systems using OFDM I, "
    "IEEE Trans. Commun. 47(11), 1999 (window offset inside the guard interval is a linear phase)"
)
DEFAULTS = {"fixed_s": 0.0, "sigma_s": 2e-8, "prefix_slack_s": 2.9e-7}
NEEDS_NO_DATA = True


def idle(settings: dict) -> bool:
    """Return True where no station's window is off."""
    return _offsets.idle(settings["fixed_s"], settings["sigma_s"])


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for an unknown station, or a slip that can leave the cyclic prefix."""
    _offsets.check_stations("effects.timing_offset.fixed_s", settings["fixed_s"], scene.network)
    slip, slack = _offsets.largest(settings["fixed_s"], settings["sigma_s"]), settings["prefix_slack_s"]
    if slip > slack:
        raise InputError(
            f"effects.timing_offset: the window can be off by {slip:g} s, expected at most prefix_slack_s = {slack:g}: "
            "beyond the cyclic prefix it would take in another symbol's data"
        )


def late_s(settings: dict, frame: Frame, rng: np.random.Generator) -> float:
    """Return by how much this station's window starts late (s), early if negative."""
    return _offsets.fixed(settings["fixed_s"], frame.station.name) + settings["sigma_s"] * _offsets.drawn(rng)


def receive(settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) of a window that starts late by d: subcarrier m turns by exp(j 2 pi (m - M // 2) df d).

    A late window makes all echoes seem nearer by c d / 2. The oscillator's own phase runs on and is not touched.
    Source: Speth et al. 1999; one draw a sample and station.
    """
    return retimed(settings, transforms.forward(samples), frame, rng)


def retimed(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the samples (N, M) of `receive` from the tones of its samples, which are overwritten."""
    tones = retoned(settings, tones, frame, rng)
    return transforms.inverse(tones, out=tones)


def retoned(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the tones (N, M) of the samples of `receive` from those of its samples, which are overwritten."""
    tones *= turned(2 * np.pi * np.fft.ifftshift(frame.baseband_hz) * late_s(settings, frame, rng))
    return tones


def respond(settings: dict, response: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the response (N, M) that a late window sees, as `receive`."""
    return response * turned(2 * np.pi * frame.baseband_hz * late_s(settings, frame, rng))
