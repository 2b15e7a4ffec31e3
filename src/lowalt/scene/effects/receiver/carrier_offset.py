"""Carrier offset: the receiver's oscillator is off its frequency, so every line moves and subcarriers leak."""

import numpy as np

from lowalt.scene.checks import CheckedScene
from lowalt.scene.effects.receiver import offsets
from lowalt.scene.waveform import Look

SOURCE = (
    "P. H. Moose, A technique for orthogonal frequency division multiplexing frequency offset correction, "
    "IEEE Trans. Commun. 42(10), 1994, Eqs. 1 to 4; default: 3 sigma at the 0.05 ppm of 3GPP TS 38.104, 6.5.1"
)
DEFAULTS = {"fixed_hz": 0.0, "sigma_hz": 0.0, "fixed_ppm": 0.0, "sigma_ppm": 0.017}


def idle(settings: dict) -> bool:
    """Return True where no station's oscillator is off."""
    return all(offsets.idle(settings[f"fixed_{unit}"], settings[f"sigma_{unit}"]) for unit in ("hz", "ppm"))


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for an unknown station, or an offset of an oscillator against itself."""
    for key in ("fixed_hz", "fixed_ppm"):
        offsets.check_stations(f"effects.carrier_offset.{key}", settings[key], scene.network)
    offsets.check_oscillator("carrier_offset", scene)


def offset_hz(settings: dict, look: Look, rng: np.random.Generator) -> float:
    """Return by how much all frequencies rise (Hz): the sum of the parts in Hz and in ppm of the oscillator."""
    name = look.station.name
    # The first draw is the oscillator's error, which the sampling clock shares.
    ppm = offsets.fixed(settings["fixed_ppm"], name) + settings["sigma_ppm"] * offsets.drawn(rng)
    hz = offsets.fixed(settings["fixed_hz"], name) + settings["sigma_hz"] * offsets.drawn(rng)
    return hz + 1e-6 * ppm * look.oscillator_hz


def receive(settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) turned by exp(j 2 pi F t) at their absolute times t = n T_r + i / (M df).

    F > 0 if the receiver's oscillator is too low: lines rise by F and fold at half the symbol rate.
    Source: Moose 1994; two draws a sample and station.
    """
    return offsets.risen(samples, offset_hz(settings, look, rng), look)
