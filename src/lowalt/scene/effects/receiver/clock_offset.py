"""Sampling-clock offset: the converter's clock runs faster or slower than the one of the symbols.

Sample instants shrink within a symbol, and the window slips from symbol to symbol, so ranges drift:
by c n T_r e / 2 until symbol n, where e is the relative error of the clock.
"""

import math

import numpy as np
from scipy import fft

from lowalt.files.errors import InputError
from lowalt.scene.checks import CheckedScene
from lowalt.scene.laws import offsets
from lowalt.scene.view import Displacement, View
from lowalt.scene.waveform import Look

SOURCE = (
    "T. Pollet, P. Spruyt, M. Moeneclaey, The BER performance of OFDM systems using "
    "non-synchronized sampling, IEEE GLOBECOM 1994; default: 3 sigma at the 0.05 ppm of 3GPP TS "
    "38.104, 6.5.1"
)
DEFAULTS = {"fixed_ppm": 0.0, "sigma_ppm": 0.017, "prefix_slack_s": 2.9e-7}
STREAM = "oscillator"
IDLE = [{"fixed_ppm": 0, "sigma_ppm": 0}]
UNMODELLED = ("fmcw", "cw")

ROUNDING = 1e-14
"""Largest share of a sample that the series of the stretch leaves out."""


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for another oscillator than the carrier's, or too large a slip.

    The slip must stay within the cyclic prefix in the look.
    """
    offsets.check_oscillator("clock_offset", scene)
    carrier = scene.effects.get("carrier_offset")
    for key in ("fixed_ppm", "sigma_ppm"):
        if carrier and carrier[key] != settings[key]:
            raise InputError(
                f"effects.clock_offset: {key} is {settings[key]} and effects.carrier_offset has "
                f"{carrier[key]}, expected the same: carrier and sampling clock come from one "
                "oscillator"
            )
    network = scene.network
    timing = scene.effects.get("timing_offset")
    rate = 1e-6 * offsets.largest(settings["fixed_ppm"], settings["sigma_ppm"])
    slip_s = rate * network.symbols * network.symbol_interval_s
    if timing:
        # A window that is late as well slips from there.
        slip_s += offsets.largest(timing["fixed_s"], timing["sigma_s"])
    offsets.check_slip("clock_offset", slip_s, settings["prefix_slack_s"])


def receive(
    settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return samples (N, M) of the same band-limited signal, taken at t / (1 + e) instead of t.

    Each sample is the exact sum of the symbol's M subcarriers at its own instant, in the symbol's
    cyclic extension. A fast clock samples earlier from symbol to symbol, so ranges grow by c n T_r
    e / 2. Source: Pollet et al. 1994. One draw per sample and station.
    """
    rate = _rate(settings, rng)
    early = -rate / (1 + rate)
    middle = samples.shape[1] // 2
    shift_hz = early * fft.ifftshift(look.baseband_hz)
    # The shift of the middle sample moves the whole symbol; a Taylor series about that sample
    # stretches it.
    instants = look.times_s + look.within_s[middle]
    term = offsets.turned(fft.fft(samples, axis=-1), np.outer(instants, shift_hz))
    result = fft.ifft(term, axis=-1)
    step = 2 * np.pi * look.sample_s * shift_hz
    away = np.arange(samples.shape[1]) - middle
    largest_turn = float(abs(step).max() * abs(away).max())
    # `size` is the largest term of this order; times the exponential it bounds all later ones.
    size = largest_turn
    order = 1
    while size * math.exp(largest_turn) > ROUNDING:
        # exp(j step away) is the sum over k of (j step)^k away^k / k!.
        term = term * (1j * step / order)
        result += fft.ifft(term, axis=-1) * away.astype(float) ** order
        order += 1
        size *= largest_turn / order
    return result


def displaced(settings: dict, view: View, rng: np.random.Generator) -> Displacement:
    """Return how late all echoes appear at each symbol: ever later with a fast clock.

    Lines move by at most e df / 2, a thousandth of a speed while the window stays in its prefix,
    which is left out.
    """
    rate = _rate(settings, rng)
    return Displacement(delay_s=rate / (1 + rate) * view.times_s)


def _rate(settings: dict, rng: np.random.Generator) -> float:
    """Return the clock's relative error e, positive if it is fast."""
    return 1e-6 * (settings["fixed_ppm"] + settings["sigma_ppm"] * offsets.drawn(rng))
