"""Carrier offset: the receiver's oscillator is off its frequency, so every line moves and subcarriers leak."""

import numpy as np

from lowalt.effects.checks import CheckedScene
from lowalt.effects.receiver import _offsets, _turns
from lowalt.effects.waveform import Carried, Frame, turned

SOURCE = (
    "P. H. Moose, A technique for orthogonal frequency division multiplexing frequency offset correction, "
    "IEEE Trans. Commun. 42(10), 1994, Eqs. 1 to 4; default: 3 sigma at the 0.05 ppm of 3GPP TS 38.104, 6.5.1"
)
DEFAULTS = {"fixed_hz": 0.0, "sigma_hz": 0.0, "fixed_ppm": 0.0, "sigma_ppm": 0.017}
NEEDS_NO_DATA = True


def idle(settings: dict) -> bool:
    """Return True where no station's oscillator is off."""
    return all(_offsets.idle(settings[f"fixed_{unit}"], settings[f"sigma_{unit}"]) for unit in ("hz", "ppm"))


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for an unknown station, or an offset of an oscillator against itself."""
    for key in ("fixed_hz", "fixed_ppm"):
        _offsets.check_stations(f"effects.carrier_offset.{key}", settings[key], scene.network)
    _offsets.check_oscillator("carrier_offset", scene)


def offset_hz(settings: dict, frame: Frame, rng: np.random.Generator) -> float:
    """Return by how much all frequencies rise (Hz): the sum of the parts in Hz and in ppm of the oscillator."""
    name = frame.station.name
    # The first draw is the oscillator's error, which the sampling clock shares.
    ppm = _offsets.fixed(settings["fixed_ppm"], name) + settings["sigma_ppm"] * _offsets.drawn(rng)
    hz = _offsets.fixed(settings["fixed_hz"], name) + settings["sigma_hz"] * _offsets.drawn(rng)
    return hz + 1e-6 * ppm * frame.oscillator_hz


def receive(settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) turned by exp(j 2 pi F t) at their absolute times t = n T_r + i / (M df).

    F > 0 if the receiver's oscillator is too low: lines rise by F and fold at half the symbol rate.
    Source: Moose 1994; two draws a sample and station.
    """
    return _turns.samples(samples, *_phasors(settings, frame, rng))


def retoned(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the tones (N, M) of the samples of `receive` from those of its samples, which are overwritten."""
    return _turns.tones(tones, *_phasors(settings, frame, rng))


def retoned_responses(settings: dict, carried: Carried, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return what `retoned` returns of the tones (N, M) of responses and data."""
    return _turns.tones(carried.response, *_phasors(settings, frame, rng), carried.data)


def _phasors(settings: dict, frame: Frame, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The turns (N,) at the symbols' starts and (1, M) within a symbol."""
    shift = offset_hz(settings, frame, rng)
    between = turned(2 * np.pi * np.mod(shift * frame.symbol_times_s, 1.0))
    return between, turned(2 * np.pi * shift * frame.sample_times_s)[None, :]
