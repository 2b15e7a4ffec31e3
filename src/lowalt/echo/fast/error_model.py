"""Selects precision and polynomials for a sample: the cheapest with a small enough proved error."""

import math
from typing import NamedTuple

import numpy as np

from lowalt.echo.fast.polynomials import CosineSum, array_rule, smooth
from lowalt.echo.radar import Radar

SPREAD_LIMIT = 0.22
"""Largest ratio of target radius to range for the fast kernel.

Closer targets use the pointwise kernel.
"""
FINEST = 1e-15
"""Required accuracy of every polynomial in exact mode."""


class EchoPlan(NamedTuple):
    """How to compute a sample.

    `fit`: error of gains and cell kernels; `share`, `peak`: bound of the other errors, relative to
    the sum of amplitudes and to the sum of peak amplitudes; `phase`: rounding of the phase relative
    to the sum of amplitudes times distances from the reference, per metre; `single`: float32 after
    the phase; `cosine`, `sine`: coefficients of `polynomials.smooth` in the type of the sums.
    """

    fit: float
    share: float
    peak: float
    phase: float
    single: bool
    cosine: np.ndarray
    sine: np.ndarray


class ArrayGains(NamedTuple):
    """The horizontal and the vertical array gain."""

    horizontal: CosineSum
    vertical: CosineSum


COSINE_DEGREES = (5, 7, 10)
"""Degrees in t^2 of cosine and sine that `vector_loops` has loops for."""
SINGLE_BLOCK = 128
"""Largest number of float32 values summed before continuing in double.

Longer sums exceed a tolerance of 1e-4.
"""
SINGLE_ERROR = 400 * 2.0**-24
"""Error bound of float32 after the phase reduction.

The type float32 is not used if a smaller error is required.
"""


def array_gains(radar: Radar) -> ArrayGains:
    """Return the array gains of a station as sums of cosines."""
    return ArrayGains(
        array_rule(radar.transmit_h, radar.receive_h, radar.kappa),
        array_rule(radar.transmit_v, radar.receive_v, radar.kappa),
    )


def round_up(value: float, steps: int) -> float:
    """Return `value` rounded up to one of `steps` values an octave.

    Few polynomials then serve all samples.
    """
    return 2.0 ** (math.ceil(steps * math.log2(max(value, 1e-9))) / steps)


def echo_plan(radar: Radar, points: int, error: float) -> EchoPlan:
    """Return the cheapest plan whose bound is about `error` relative to the sum of amplitudes.

    `error` is rounded down to a power of two, so that few cell kernels serve all samples; below
    FINEST it means the exact mode.
    """
    error = 2.0 ** math.floor(math.log2(max(error, FINEST)))
    elements = radar.transmit_h + radar.receive_h + radar.transmit_v + radar.receive_v
    array_phase = np.pi * radar.kappa / 2 * (elements - 4)
    unit = 2.0**-53
    coarse = unit
    kind: type = np.float64
    single = error > SINGLE_ERROR
    if single:
        coarse = 2.0**-24
        kind = np.float32
    for degree in COSINE_DEGREES:
        cosine, cosine_error = smooth("cosine", degree)
        sine, sine_error = smooth("sine", degree)
        if cosine_error + 0.5 * sine_error <= error / 3:
            break
    # Order k of cosine and sine has 2 k + 2 roundings: at half a turn at most 85 in both together.
    # The turn itself and the products of the amplitude have another 16.
    rounding = (8 * array_phase + 30) * unit + (85 + 16) * coarse + -(-points // 512) * unit
    share = cosine_error + 0.5 * sine_error + rounding
    return EchoPlan(
        fit=max(error / 6, FINEST),
        share=share,
        peak=8 * array_phase * unit,
        phase=64 * np.pi * radar.turns * unit,
        single=single,
        cosine=cosine.astype(kind),
        sine=sine.astype(kind),
    )


def pointwise_bound(radar: Radar, size_m: float, points: int) -> tuple[float, float]:
    """Return the error bound of the pointwise kernel.

    It is relative to that kernel's sums of amplitudes and of risks (`terms.terms`).

    Phase: a range difference has a few roundings of the offset, independent of the range; the other
    errors come from sums. Risk: effect of the rounding of a direction cosine on the gains and the
    array phase.
    """
    elements = radar.transmit_h + radar.receive_h + radar.transmit_v + radar.receive_v
    unit = 2.0**-53
    wave = 2 * np.pi * radar.turns * 2 * size_m
    of_amplitudes = (20 * wave + 200 + points) * unit
    of_risks = 40 * (1 + np.pi * radar.kappa / 2 * (elements - 4)) * unit
    return float(of_amplitudes), float(of_risks)
