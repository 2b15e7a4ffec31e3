"""Slow time as real frames have it: symbols in downlink slots only, some missing or late.

A station sends sensing symbols in the downlink part of each TDD period. Some of them are missing,
and each may be sent up to `jitter_s` later than its nominal instant. `regrid` says how the received
symbols become the evenly spaced signal that the spectra expect. Jitter spreads lines beyond half
the symbol rate, which would otherwise fold. The land and phase noise keep the nominal instants.
"""

import numpy as np

from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.scene.checks import CheckedScene
from lowalt.scene.effects import with_offer
from lowalt.scene.view import Sampling

SOURCE = (
    "3GPP TS 38.331, TDD-UL-DL-Pattern (periods of 0.5 to 10 ms); non-uniform transform: F. "
    "Marvasti (ed.), Nonuniform Sampling, 2001, ch. 1; spectra of missing samples: P. Stoica, R. "
    "Moses, Spectral Analysis of Signals, 2005, 2.4"
)
DEFAULTS = {
    "tdd_period_s": 0.01,
    "downlink": 0.75,
    "missing": 0.0,
    "jitter_s": 0.0,
    "regrid": "zero",
}
IDLE = [{"downlink": 1, "missing": 0, "jitter_s": 0}]

FEWEST = 2
"""Least number of symbols in a look."""


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a jitter beyond the next symbol, too few symbols, or noise in gaps.

    Noise at set SNRs would fill the gaps of a look.
    """
    step = scene.network.symbol_interval_s
    if settings["jitter_s"] >= step:
        raise InputError(
            f"effects.slow_time.jitter_s: {settings['jitter_s']}, expected below the symbol "
            f"interval {step}"
        )
    if _in_downlink(settings, scene.network).sum() < FEWEST:
        raise InputError(
            f"effects.slow_time: downlink {settings['downlink']} of a period of "
            f"{settings['tdd_period_s']} s holds fewer than {FEWEST} of {scene.network.symbols} "
            "symbols, expected more"
        )
    if scene.known_times and even(settings):
        raise InputError(
            f"effects.slow_time.regrid: {settings['regrid']!r} makes an even signal, and "
            "spectra.times is 'known', expected 'zero'"
        )
    if scene.all_cells and even(settings):
        raise InputError(
            f"effects.slow_time.regrid: {settings['regrid']!r} and range cells of all symbols, "
            "expected 'zero': cells of symbols that were not received are zeros"
        )
    if scene.noisy and gaps(settings):
        raise InputError(
            f"effects.slow_time: gaps hold no signal, and noise.snr_db {list(scene.snr_db)} would "
            f"fill them with noise; expected [.inf] with {with_offer('noise_w')}"
        )


def gaps(settings: dict) -> bool:
    """Return whether symbols of a look may not be received."""
    return settings["downlink"] < 1 or settings["missing"] > 0


def even(settings: dict) -> bool:
    """Return whether the signal has evenly spaced values other than those of received symbols."""
    return settings["regrid"] != "zero"


def _in_downlink(settings: dict, network: Network) -> np.ndarray:
    """Whether each symbol's nominal instant (N,) lies in the downlink part.

    That part begins every period.
    """
    phase = network.times_s / settings["tdd_period_s"]
    # Instants that are multiples of the period must not fall before it by rounding.
    return phase - np.floor(phase + 1e-9) < settings["downlink"] - 1e-9


def sampling(settings: dict, network: Network, rng: np.random.Generator) -> Sampling:
    """Return the instants of a look and which symbols are received; 2 N draws.

    Two symbols at least are received: where fewer are left, the first of the downlink ones are
    kept.
    """
    late, lost = rng.random((2, network.symbols))
    sent = _in_downlink(settings, network)
    present = sent & (lost >= settings["missing"])
    if present.sum() < FEWEST:
        present[np.flatnonzero(sent)[:FEWEST]] = True
    return Sampling(network.times_s + settings["jitter_s"] * late, present)


def regridded(settings: dict, signal: np.ndarray, timing: Sampling, network: Network) -> np.ndarray:
    """Return the evenly spaced signal (N,) made of received symbols `signal` (K,).

    K of all symbols are present.

    zero: each symbol at its nominal instant, zeros in the gaps. nudft: the evenly spaced signal
    whose N Fourier coefficients are the sums over symbols at their true instants.
    """
    if settings["regrid"] == "nudft":
        frequency = np.fft.fftfreq(network.symbols, network.symbol_interval_s)
        turns = np.outer(frequency, timing.times_s[timing.present])
        sine, cosine = portable.sine_cosine_turns(turns)
        real = portable.dot(cosine, signal.real) + portable.dot(sine, signal.imag)
        imag = portable.dot(cosine, signal.imag) - portable.dot(sine, signal.real)
        return np.fft.ifft(real + 1j * imag)
    result = np.zeros(network.symbols, np.complex128)
    result[timing.present] = signal
    return result
