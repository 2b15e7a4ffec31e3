"""Transmit leakage: the station's own signal reaches its receiver directly.

It fills the converter's range.

The leakage stands still in range cell 0. It comes after the oscillator's effects: a station that
sends and receives by one oscillator hears its own signal after nanoseconds, so phase noise cancels
in it. A canceller removes it; the converter's quantisation noise, which follows the larger signal,
stays.
"""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.scene.checks import CheckedScene
from lowalt.scene.view import View
from lowalt.scene.waveform import Look, transmit

SOURCE = (
    "A. Sabharwal et al., In-band full-duplex wireless: challenges and opportunities, IEEE J. Sel. "
    "Areas Commun. 32(9), 2014; 80 dB by separate panels and analogue cancellation: estimate"
)
DEFAULTS = {"isolation_db": 80.0, "delay_s": 0.0}
IDLE = [{"isolation_db": None}]
UNMODELLED = ("links",)
STILL = True


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError where the receiver has an oscillator of its own."""
    offsets = ("carrier_offset", "clock_offset")
    apart = [name for name in offsets if name in scene.effects]
    if not scene.effects.get("phase_noise", {"shared": True})["shared"]:
        apart.append("phase_noise with shared: false")
    if apart:
        raise InputError(
            f"effects.transmit_leakage: {apart} give the receiver an oscillator of its own, "
            "expected the transmitter's for leakage, in which offsets and phase noise cancel"
        )


def levels(settings: dict, view: View) -> list[tuple[str, float, str]]:
    """Return the power (W) of the leakage."""
    leaked_w = view.network.power * 10 ** (-settings["isolation_db"] / 10)
    return [(f"transmit leakage, {view.network.bin_name}", leaked_w, "W")]


def receive(
    settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return samples (N, M) plus the sent waveform, `isolation_db` below its power.

    Its phase is drawn and constant.

    The leakage of a subcarrier is `isolation_db` below its transmit power. One draw per sample and
    station.
    """
    level = np.sqrt(look.network.power) * 10 ** (-settings["isolation_db"] / 20)
    leaked = level * np.exp(
        2j * np.pi * (float(rng.random()) - look.baseband_hz * settings["delay_s"])
    )
    return samples + transmit(leaked, look.aired)
