"""Phase noise of the oscillator: one random phase that changes from symbol to symbol and within each symbol.

The slow part turns whole symbols (common phase error, seen in Doppler); the fast part leaks between subcarriers.
"""

from functools import lru_cache
from itertools import pairwise

import numpy as np

from lowalt.common.errors import InputError
from lowalt.effects.checks import CheckedScene
from lowalt.effects.receiver import _oscillator, _oscillator_grid, _toeplitz, _turns
from lowalt.effects.waveform import Carried, Frame, turned

SOURCE = (
    "IEEE Std 1139-2008 (L(f)); D. Petrovic, W. Rave, G. Fettweis, Effects of phase noise on OFDM systems with and "
    "without PLL, IEEE Trans. Commun. 55(8), 2007; M. C. Budge, M. P. Burt, Range correlation effects on phase and "
    "amplitude noise, IEEE Southeastcon 1993; default: 3GPP TR 38.803, Table 6.1.10-1, scaled from 29.55 to 4.9 GHz by "
    "20 log10; loop: F. M. Gardner, Phaselock Techniques, 3rd ed. 2005, ch. 6; reference: an oven-controlled crystal "
    "of -100, -130, -150 dBc/Hz at 1, 10, 100 Hz from 10 MHz, raised by 20 log10(490): estimate"
)
DEFAULTS = {
    "points": [
        [1.0, 13.4], [2.0, 6.0], [4.0, -3.5], [10.0, -16.6], [100.0, -49.6], [1e3, -82.3], [3e3, -95.3], [1e4, -103.0],
        [1e5, -112.5], [3e5, -116.2], [5.5e5, -116.6], [1.6e6, -114.2], [3e6, -116.3], [1e7, -124.6], [3e7, -133.7],
    ],
    "level_db": 0.0,
    "shared": True,
    "loop_hz": 100.0,
    "reference": [[1.0, -46.0], [10.0, -76.0], [100.0, -96.0]],
}  # fmt: skip
NEEDS_NO_DATA = True


def idle(settings: dict) -> bool:
    """Return True for a spectrum without points."""
    return not settings["points"]


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for offsets that do not rise, or symbols too close together to tell slow from fast."""
    for key in ("points", "reference"):
        offsets = [offset for offset, _ in settings[key]]
        if not offsets or offsets[0] <= 0 or any(later <= earlier for earlier, later in pairwise(offsets)):
            raise InputError(f"effects.phase_noise.{key}: offsets {offsets}, expected positive and rising (Hz)")
    network = scene.network
    band = network.subcarriers * network.subcarrier_spacing_hz
    if network.symbol_interval_s * band < _oscillator_grid.SPACING:
        raise InputError(
            f"effects.phase_noise: network.symbol_interval_s is {network.symbol_interval_s:g}, expected at least "
            f"{_oscillator_grid.SPACING} samples of 1 / (M df), {_oscillator_grid.SPACING / band:g}"
        )


def disciplined(settings: dict) -> tuple[tuple[float, float], ...]:
    """Return the spectrum as (offset Hz, dBc/Hz) pairs of the oscillator locked to its reference.

    A second-order loop passes the reference's noise by 1 / (1 + (f / loop)^4) and the oscillator's own by
    1 minus that, so that slow wander is the reference's. Free-running (loop_hz 0), the given points alone. Source:
    Gardner 2005.
    """
    own = tuple((float(offset), float(level) + settings["level_db"]) for offset, level in settings["points"])
    reference = tuple((float(offset), float(level)) for offset, level in settings["reference"])
    return _locked(own, reference, float(settings["loop_hz"]))


@lru_cache(maxsize=8)
def _locked(own: tuple, reference: tuple, loop_hz: float) -> tuple[tuple[float, float], ...]:
    """The spectrum of the oscillator `own` locked to `reference` by a loop, the same for all samples of a scene."""
    if loop_hz == 0:
        return own
    ends = [offset for offset, _ in own + reference]
    between = np.geomspace(min(ends), 100.0 * loop_hz, 240)
    offsets = np.unique([*(offset for offset, _ in own), *between[between < max(*ends, between[0])]])
    follows = 1.0 / (1.0 + (offsets / loop_hz) ** 4)
    total = follows * _oscillator.density(reference, offsets) + (1.0 - follows) * _oscillator.density(own, offsets)
    return tuple(zip(offsets.tolist(), (10 * np.log10(total)).tolist(), strict=True))


def phase(settings: dict, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the drawn phase (N, M) in rad at every sample's instant; on a link that of two oscillators."""
    return _toeplitz.joined(*_parts(settings, frame, rng))


def _parts(settings: dict, frame: Frame, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The `_toeplitz.parts` of what `phase` returns, kept for a look that is computed again."""
    return frame.once("phase_noise", lambda: _drawn(settings, frame, rng))


def _drawn(settings: dict, frame: Frame, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """The parts of `_parts`, drawn."""
    points = disciplined(settings)
    look = (*frame.sent.shape, frame.network.symbol_interval_s, frame.sample_s)
    if frame.station.transmitter is None:
        return _oscillator.parts(points, look, frame.delay_s if settings["shared"] else None, rng)
    one, other = (_oscillator.parts(points, look, None, rng) for _ in range(2))
    return one[0] - other[0], one[1] - other[1]


def receive(settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) turned by exp(j phi(t)), phi of the spectrum `points` raised by `level_db`.

    shared: transmitter and receiver have one oscillator, so that phi(t) - phi(t - tau) is left, with the delay tau of
    the target's reference point; all echoes are taken to have it. Noise beyond half the sample rate is filtered out.
    Source: Petrovic et al. 2007 (within a symbol); Budge and Burt 1993 (range correlation).
    """
    return _turns.samples(samples, np.ones(len(samples), np.complex128), turned(phase(settings, frame, rng)))


def retoned(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the tones (N, M) of the samples of `receive` from those of its samples, which are overwritten."""
    return _retoned(settings, tones, None, frame, rng)


def retoned_responses(settings: dict, carried: Carried, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return what `retoned` returns of the tones (N, M) of responses and data."""
    return _retoned(settings, *carried, frame, rng)


def _retoned(
    settings: dict, given: np.ndarray, data: np.ndarray | None, frame: Frame, rng: np.random.Generator
) -> np.ndarray:  # fmt: skip
    """The tones of `retoned`, or with `data` those of `retoned_responses`."""
    return _turns.phased_tones(given, *_parts(settings, frame, rng), data)
