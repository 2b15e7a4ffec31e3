"""Which precision and which polynomials a sample gets: the cheapest whose proved error bound is allowed."""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lowalt.echo.fast.polynomials import array_rule, smooth
from lowalt.echo.radar import Radar

SPREAD_LIMIT = 0.22
"""Largest target radius over range that the fast kernel takes; nearer targets go to the pointwise kernel."""
FINEST = 1e-15
"""Accuracy asked of every polynomial in the exact mode."""


class Functions(NamedTuple):
    """Coefficients of the polynomials that replace functions: relative range difference over eps and r_ref / r in
    float64; cosine and sine in the type of the sums (see `polynomials.smooth`)."""

    excess: np.ndarray
    inverse: np.ndarray
    cosine: np.ndarray
    sine: np.ndarray


class EchoPlan(NamedTuple):
    """How a sample is computed. `fit`: error of gains and cell kernels; `share`, `peak`: the other errors' bound
    relative to the sum of amplitudes and to the sum of peak amplitudes; `phase`: rounding of the phase relative to the
    sum of amplitudes times distances from the reference, per metre; `single`: float32 after the phase; `near`:
    ranges by polynomials rather than roots."""

    fit: float
    share: float
    peak: float
    phase: float
    single: bool
    near: bool
    functions: Functions


class ArrayGains(NamedTuple):
    """The horizontal and vertical array gains as sums of cosines: weights of sum 1, and rates, largest first, in rad
    per unit of direction cosine."""

    weights_h: np.ndarray
    rates_h: np.ndarray
    weights_v: np.ndarray
    rates_v: np.ndarray


COSINE_DEGREES = (5, 7, 10)
"""Degrees in t^2 of cosine and sine that `vector_loops` has loops for."""
SINGLE_BLOCK = 128
"""Most float32 numbers added before a double takes over: longer sums round by more than a tolerance of 1e-4
allows."""
SINGLE_ERROR = 400 * 2.0**-24
"""Bound of the error of float32 after the phase; float32 is not tried where a smaller error is asked for."""


def array_gains(radar: Radar) -> ArrayGains:
    """Return the array gains of a station as sums of cosines."""
    return ArrayGains(
        *array_rule(radar.transmit_h, radar.receive_h, radar.kappa),
        *array_rule(radar.transmit_v, radar.receive_v, radar.kappa),
    )


def round_up(value: float, steps: int = 2) -> float:
    """Return `value` rounded up to one of `steps` values an octave, so that few polynomials serve all samples."""
    return 2.0 ** (math.ceil(steps * math.log2(max(value, 1e-9))) / steps)


def echo_plan(radar: Radar, spread: float, size_m: float, points: int, error: float) -> EchoPlan:
    """Return the cheapest plan whose bound is about `error` relative to the sum of amplitudes.

    spread: largest target radius over range; size_m: largest radius (m). `error` below FINEST means the exact mode.
    """
    return _echo_plan(
        radar.turns, radar.kappa, radar.transmit_h + radar.receive_h - 2, radar.transmit_v + radar.receive_v - 2,
        min(0.5, round_up(2.01 * spread + spread * spread)), round_up(size_m), -(-points // 512),
        2.0 ** math.floor(math.log2(max(error, FINEST))),
    )  # fmt: skip


@lru_cache(maxsize=4096)
def _echo_plan(turns, kappa, rate_h, rate_v, reach, size_m, strips, error) -> EchoPlan:
    """Compute the plan for rounded sizes, so that many samples share it."""
    wave = 2 * np.pi * turns * 2 * size_m
    array_phase = np.pi * kappa / 2 * (rate_h + rate_v)
    unit = 2.0**-53
    single = error > SINGLE_ERROR
    coarse = 2.0**-24 if single else unit
    part = error / 6
    excess, excess_error = smooth("excess", reach, 4)
    inverse, inverse_error = smooth("inverse", reach, 3)
    near = wave * excess_error + (2 + array_phase) * inverse_error <= 2 * part
    if not near:
        excess_error = inverse_error = 0.0
    for degree in COSINE_DEGREES:
        cosine, cosine_error = smooth("cosine", 0.25, degree)
        sine, sine_error = smooth("sine", 0.25, degree)
        if cosine_error + 0.5 * sine_error <= 2 * part:
            break
    # Order k of cosine and sine rounds 2 k + 2 times: at half a turn at most 85 roundings in both; the turn itself
    # and the products that make the amplitude another 16.
    rounding = (8 * array_phase + 30) * unit + (85 + 16) * coarse + strips * unit
    share = wave * excess_error + (2 + array_phase) * inverse_error + cosine_error + 0.5 * sine_error + rounding
    kind = np.float32 if single else np.float64
    functions = Functions(excess, inverse, cosine.astype(kind), sine.astype(kind))
    peak = array_phase * inverse_error + 8 * array_phase * unit
    return EchoPlan(max(part, FINEST), share, peak, 64 * np.pi * turns * unit, single, bool(near), functions)


def pointwise_bound(radar: Radar, size_m: float, points: int) -> tuple[float, float]:
    """Return the pointwise kernel's error bound relative to its sums of amplitudes and of risks (`terms.terms`).

    Phase: a range difference carries a few roundings of the offset, whatever the range; the rest is sums. Risk: the
    roundings of a direction cosine, as the gains and the array's phase see them.
    """
    elements = radar.transmit_h + radar.receive_h + radar.transmit_v + radar.receive_v
    wave = 2 * np.pi * radar.turns * 2 * size_m
    share = (20 * wave + 200 + points) * 2.0**-53
    return float(share), float(40 * (1 + np.pi * radar.kappa / 2 * (elements - 4)) * 2.0**-53)
