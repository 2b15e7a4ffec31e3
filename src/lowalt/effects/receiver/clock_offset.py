"""Sampling-clock offset: the converter's clock runs fast or slow against the one that made the symbols.

Sample instants shrink within a symbol, and the window slips from symbol to symbol, so ranges drift.
"""

import math

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.jit import LEAN
from lowalt.effects import transforms
from lowalt.effects.checks import CheckedScene
from lowalt.effects.receiver import _offsets
from lowalt.effects.waveform import Frame, turned

SOURCE = (
    "T. Pollet, P. Spruyt, M. Moeneclaey, The BER performance of OFDM systems using non-synchronized sampling, "
    "IEEE GLOBECOM 1994; default: 3 sigma at the 0.05 ppm of 3GPP TS 38.104, 6.5.1"
)
DEFAULTS = {"fixed_ppm": 0.0, "sigma_ppm": 0.017, "prefix_slack_s": 2.9e-7}

MOST_SUBCARRIERS = 100_000
"""The largest number of subcarriers the configuration allows."""

ROUNDING = 1e-14
"""Largest share of a sample that the series of the stretch leaves out."""


def idle(settings: dict) -> bool:
    """Return True where no station's clock is off."""
    return _offsets.idle(settings["fixed_ppm"], settings["sigma_ppm"])


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for an unknown station, or a slip that leaves the cyclic prefix before the look ends."""
    _offsets.check_stations("effects.clock_offset.fixed_ppm", settings["fixed_ppm"], scene.network)
    _offsets.check_oscillator("clock_offset", scene)
    carrier = scene.effects.get("carrier_offset")
    for key in ("fixed_ppm", "sigma_ppm"):
        if carrier and carrier[key] != settings[key]:
            raise InputError(
                f"effects.clock_offset: {key} is {settings[key]} and effects.carrier_offset has {carrier[key]}, "
                "expected the same: carrier and sampling clock come from one oscillator"
            )
    network, timing = scene.network, scene.effects.get("timing_offset")
    rate = 1e-6 * _offsets.largest(settings["fixed_ppm"], settings["sigma_ppm"])
    slip = rate * network.symbols * network.symbol_interval_s
    slip += _offsets.largest(timing["fixed_s"], timing["sigma_s"]) if timing else 0.0
    if slip > settings["prefix_slack_s"]:
        raise InputError(
            f"effects.clock_offset: the window slips by up to {slip:g} s in a look (timing_offset included), expected "
            f"at most prefix_slack_s = {settings['prefix_slack_s']:g}: beyond the cyclic prefix it would take in "
            "another symbol's data"
        )


def amplifies(settings: dict) -> float:
    """Return a bound of the resampling's 2-norm: by Bernstein's inequality sum_k (pi M e)^k / k! = exp(pi M e)."""
    rate = 1e-6 * _offsets.largest(settings["fixed_ppm"], settings["sigma_ppm"])
    return math.exp(math.pi * MOST_SUBCARRIERS * rate)


def fast(settings: dict, frame: Frame, rng: np.random.Generator) -> float:
    """Return by which share this station's sampling clock is fast (1e-6 for one ppm)."""
    fixed = _offsets.fixed(settings["fixed_ppm"], frame.station.name)
    return 1e-6 * (fixed + settings["sigma_ppm"] * _offsets.drawn(rng))


def receive(settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) of the same band-limited signal, taken at t / (1 + e) instead of t.

    Every sample is the exact sum of the symbol's M subcarriers at its own instant, in the symbol's cyclic extension. A
    fast clock is early ever more, so ranges grow by c n T_r e / 2. Source: Pollet et al. 1994; one draw a sample and
    station.
    """
    return retimed(settings, transforms.forward(samples), frame, rng)


def retimed(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the samples of `receive` from the tones (N, M) of its samples, in the transform's order, as work space."""
    rates, places = _slipped(settings, tones, frame, rng)
    samples = transforms.inverse(tones)
    _stretch(tones, rates, places, samples)
    return samples


def retoned(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the tones (N, M) of the samples of `receive` from those of its samples, which are overwritten."""
    rates, places = _slipped(settings, tones, frame, rng)
    change = np.zeros(tones.shape, np.complex128)
    _stretch(tones, rates, places, change)
    tones += transforms.forward(change, out=change)
    return tones


def _slipped(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> tuple:
    """Turn tones (N, M) as far as each symbol's middle sample is early; return the rest for `_stretch`."""
    rate = fast(settings, frame, rng)
    early = -rate / (1 + rate)
    count, baseband = tones.shape[1], np.fft.ifftshift(frame.baseband_hz)
    middle = count // 2
    at_middle = turned(2 * np.pi * early * middle * frame.sample_s * baseband)
    _turn(tones, early * frame.network.symbol_interval_s * baseband, at_middle)
    return 2 * np.pi * early * frame.sample_s * baseband, np.arange(count) - middle


def _stretch(tones: np.ndarray, rates: np.ndarray, places: np.ndarray, samples: np.ndarray) -> None:
    """Add to samples (N, M) the inverse transform of tones times exp(j rates[m] places[i]) - 1 at sample i, by series.

    The terms left out are below rounding; each term is an inverse transform of its own.
    """
    reach = float(abs(rates).max() * abs(places).max())
    order, term = 1, reach
    column = np.ones(len(places), np.complex128)
    powers, work = tones, np.empty_like(tones)
    while term * math.exp(reach) > ROUNDING:
        powers = np.multiply(powers, rates, out=None if powers is tones else powers)
        column = column * (1j * places / order)
        transforms.inverse(powers, out=work)
        _grow(work, column, samples)
        order += 1
        term *= reach / order


def _turn(tones: np.ndarray, turns: np.ndarray, first: np.ndarray) -> None:
    """Multiply tones (N, M) by first[m] exp(j 2 pi n turns[m]), as products of a coarse and a fine step in n."""
    count = len(tones)
    step = math.isqrt(count) + 1
    fine = turned(2 * np.pi * np.outer(np.arange(step), turns)) * first
    coarse = turned(2 * np.pi * np.outer(np.arange(0, count, step), turns))
    _stepped(tones, coarse, fine)


@LEAN
def _stepped(tones, coarse, fine):
    """Multiply tones (N, M) by coarse (K, M) and fine (S, M) at the quotient and the rest of their symbol over S."""
    for n in range(len(tones)):
        row, one, other = tones[n], coarse[n // len(fine)], fine[n % len(fine)]
        for m in range(np.uint64(len(row))):
            row[m] *= one[m] * other[m]


@LEAN
def _grow(work, column, samples):
    """Add work (N, M) times column (M,) to samples (N, M)."""
    for n in range(len(work)):
        one, row = work[n], samples[n]
        for i in range(np.uint64(len(row))):
            row[i] += one[i] * column[i]
