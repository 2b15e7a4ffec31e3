"""Sampling-clock offset: the converter's clock runs fast or slow against the one that made the symbols.

Sample instants shrink within a symbol, and the window slips from symbol to symbol, so ranges drift.
"""

import math

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.jit import LEAN
from lowalt.common.memory import aligned
from lowalt.effects import transforms
from lowalt.effects.checks import CheckedScene
from lowalt.effects.receiver import _offsets
from lowalt.effects.tone_loops import apart
from lowalt.effects.transform_loops import transformed
from lowalt.effects.waveform import Carried, Frame, tones_of, turned

SOURCE = (
    "T. Pollet, P. Spruyt, M. Moeneclaey, The BER performance of OFDM systems using non-synchronized sampling, "
    "IEEE GLOBECOM 1994; default: 3 sigma at the 0.05 ppm of 3GPP TS 38.104, 6.5.1"
)
DEFAULTS = {"fixed_ppm": 0.0, "sigma_ppm": 0.017, "prefix_slack_s": 2.9e-7}
NEEDS_NO_DATA = True

MOST_SUBCARRIERS = 100_000
"""The largest number of subcarriers the configuration allows."""

ROUNDING = 1e-14
"""Largest share of a sample that the series of the stretch leaves out."""


NONE = np.empty((0, transforms.LENGTH), np.complex128)
"""No data."""


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
    return _resampled(settings, tones, None, frame, rng, False)


def retoned(settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return the tones (N, M) of the samples of `receive` from those of its samples, which are overwritten."""
    return _resampled(settings, tones, None, frame, rng, True)


def retoned_responses(settings: dict, carried: Carried, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return what `retoned` returns of the tones (N, M) of responses and data."""
    return _resampled(settings, *carried, frame, rng, True)


def _resampled(
    settings: dict, given: np.ndarray, data: np.ndarray | None, frame: Frame, rng: np.random.Generator, back: bool
) -> np.ndarray:  # fmt: skip
    """The samples of `retimed`, or with `back` the tones of `retoned`; tones `given` without data are work space.

    Tones are turned as far as each symbol's middle sample is early, and a series over the other samples adds the rest.
    """
    rate = fast(settings, frame, rng)
    early = -rate / (1 + rate)
    count, baseband = given.shape[1], np.fft.ifftshift(frame.baseband_hz)
    middle = count // 2
    rates = 2 * np.pi * early * baseband
    turns = _turns(len(given), frame.network.symbol_interval_s, middle * frame.sample_s, rates)
    weights, columns = _series(frame.sample_s * rates, np.arange(count) - middle)
    if count == transforms.LENGTH:
        columns /= count
        out = given if data is None else np.empty(given.shape, np.complex128)
        held = NONE if data is None else data
        _stretched(given, held, turns, (weights, columns), back, transforms.table(), aligned(8, count), out)
        return out
    tones = given if data is None else tones_of(given, data)
    _stepped(tones, *turns)
    samples = np.zeros_like(tones) if back else transforms.inverse(tones)
    for weight, column in zip(weights[1:], columns[1:], strict=True):
        samples += transforms.inverse(tones * weight) * column
    return tones + transforms.forward(samples) if back else samples


def _series(rates: np.ndarray, places: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Real (K, M) and complex (K, M) whose products, summed over K, are exp(j rates[m] places[i]) to rounding.

    The first products are ones; each of the others costs an inverse transform.
    """
    reach = float(abs(rates).max() * abs(places).max())
    order, term = 1, reach
    weights, columns = [np.ones(len(rates))], [np.ones(len(places), np.complex128)]
    while term * math.exp(reach) > ROUNDING:
        weights.append(weights[-1] * rates)
        columns.append(columns[-1] * (1j * places / order))
        order += 1
        term *= reach / order
    return np.array(weights), np.array(columns)


def _turns(symbols: int, interval_s: float, first_s: float, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit phasors (K, M) and (S, M) whose products, at quotient and rest of n over S, are those of symbol n.

    They turn by rates (M,), rad/s, from time 0 to first_s + n interval_s, for symbols n from 0 on.
    """
    step = math.isqrt(symbols) + 1
    coarse, fine = interval_s * np.arange(0, symbols, step), first_s + interval_s * np.arange(step)
    return turned(np.outer(coarse, rates)), turned(np.outer(fine, rates))


@LEAN
def _stretched(given, data, turns, series, back, table, work, out):
    """Fill out (N, 256) with samples of tones, or with `back` with the tones of those, as `_resampled` does.

    given, data: as in `tone_loops.apart`; turns: coarse and fine as in `_stepped`; series: weights and columns as in
    `_series`, the latter divided by 256; table: `transform_loops.turns`; work: (8, 256). out may be given itself.
    """
    count, (coarse, fine), (weights, all_columns) = np.uint64(256), turns, series
    re, im, new_re, new_im, own_re, own_im = work[0], work[1], work[2], work[3], work[4], work[5]
    sum_re, sum_im = work[6], work[7]
    for n in range(len(given)):
        row, one, other = out[n], coarse[n // len(fine)], fine[n % len(fine)]
        apart(given, data, n, re, im)
        for m in range(count):
            a, b, x, y = one[m].real, one[m].imag, other[m].real, other[m].imag
            c, s, x, y = a * x - b * y, a * y + b * x, re[m], im[m]
            own_re[m], own_im[m] = x * c - y * s, x * s + y * c
            sum_re[m], sum_im[m] = 0.0, 0.0
        for k in range(1 if back else 0, len(weights)):
            weight, column = weights[k], all_columns[k]
            for m in range(count):
                re[m], im[m] = own_re[m] * weight[m], own_im[m] * weight[m]
            # Real and imaginary parts change places: the inverse transform.
            transformed(im, re, new_im, new_re, table)
            for i in range(count):
                c, s = column[i].real, column[i].imag
                sum_re[i] += new_re[i] * c - new_im[i] * s
                sum_im[i] += new_re[i] * s + new_im[i] * c
        if not back:
            for i in range(count):
                row[i] = complex(sum_re[i], sum_im[i])
            continue
        transformed(sum_re, sum_im, new_re, new_im, table)
        for m in range(count):
            row[m] = complex(own_re[m] + new_re[m], own_im[m] + new_im[m])


@LEAN
def _stepped(tones, coarse, fine):
    """Multiply tones (N, M) by coarse (K, M) and fine (S, M) at the quotient and the rest of their symbol over S."""
    for n in range(len(tones)):
        row, one, other = tones[n], coarse[n // len(fine)], fine[n % len(fine)]
        for m in range(np.uint64(len(row))):
            row[m] *= one[m] * other[m]
