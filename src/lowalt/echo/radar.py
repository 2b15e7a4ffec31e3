"""The constants of one station for the kernels, as floats and double-doubles.

A double-double is the unevaluated sum of two doubles (about 32 digits). It is needed for turns of
phase per metre: at 100 km and 4.9 GHz the phase is 2e7 rad, so a single double would leave only
eight digits for the fraction of a turn.
"""

from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.numerics.exact.constants import DIGITS, PI, Pair, decimal_of, pair, sine_cosine

LIGHT = Fraction(int(SPEED_OF_LIGHT))


class Exact(NamedTuple):
    """One station's constants as double-doubles."""

    sine: Pair
    cosine: Pair
    """Of Theta_k."""
    turns: Pair
    cells: Pair
    """Turns of phase and range cells per metre of range."""
    half_kappa: Pair
    """kappa / 2: half turns of array phase per element and unit of direction cosine."""
    phase_h: Pair
    phase_v: Pair
    """Turns of phase of both arrays' middles.

    The turns are per unit of the horizontal and vertical direction cosine.
    """
    scale: Pair
    """a0 lambda / (4 pi)^(3/2)."""


def constants(rows: np.ndarray) -> Exact:
    """Return the double-doubles of rows (8, 2) under their names."""
    return Exact(
        sine=(rows[0, 0], rows[0, 1]),
        cosine=(rows[1, 0], rows[1, 1]),
        turns=(rows[2, 0], rows[2, 1]),
        cells=(rows[3, 0], rows[3, 1]),
        half_kappa=(rows[4, 0], rows[4, 1]),
        phase_h=(rows[5, 0], rows[5, 1]),
        phase_v=(rows[6, 0], rows[6, 1]),
        scale=(rows[7, 0], rows[7, 1]),
    )


class Radar(NamedTuple):
    """Constants of one station; `_lo` is the low half of a double-double."""

    station: np.ndarray
    """(3,) m, position of the arrays."""
    sine: float
    cosine: float
    """Of Theta_k: y'_k = (-sine, cosine, 0)."""
    turns: float
    turns_lo: float
    """Turns of phase per metre of range, at the effective carrier f_k + (M-1) df / 2."""
    cells: float
    cells_lo: float
    """Range cells per metre."""
    kappa: float
    """f_k / f0."""
    transmit_h: int
    transmit_v: int
    receive_h: int
    receive_v: int
    subcarriers: int
    scale: float
    """a0 lambda / (4 pi)^(3/2): with sqrt(rcs) / r^2 and G it gives a point's amplitude."""
    centre_hz: float
    """The effective carrier (Hz), for delays of extra paths."""
    exact: np.ndarray
    """(8, 2), the constants as double-doubles in the order of `Exact`.

    Compiled code takes one array faster than eight pairs; `constants` unpacks it.
    """


@lru_cache(maxsize=64)
def radar(network: Network, station: Station) -> Radar:
    """Return the constants of `station`, each rounded once from exact fractions.

    Source: paper, Eqs. 4, 7 and 24.
    """
    low = Fraction(station.frequency_hz)
    spacing = Fraction(network.subcarrier_spacing_hz)
    carrier = Fraction(network.carrier_hz)
    transmit_h, transmit_v = network.transmit
    receive_h, receive_v = network.receive
    kappa = low / carrier
    centre = low + (network.subcarriers - 1) * spacing / 2
    bandwidth = network.subcarriers * spacing
    elements = transmit_h * transmit_v * receive_h * receive_v
    with localcontext() as context:
        context.prec = DIGITS
        four_pi = 4 * PI
        amplitude = (decimal_of(network.power) / elements).sqrt()
        wavelength = decimal_of(LIGHT / carrier)
        scale = amplitude * wavelength / (four_pi * four_pi.sqrt())
    numbers: tuple[Fraction | Decimal, ...] = (
        *sine_cosine(station.normal_rad),
        2 * centre / LIGHT,
        2 * bandwidth / LIGHT,
        kappa / 2,
        kappa / 4 * (transmit_h + receive_h - 2),
        kappa / 4 * (transmit_v + receive_v - 2),
        scale,
    )
    exact = Exact(*map(pair, numbers))
    return Radar(
        station=np.array(station.position_m, dtype=np.float64),
        sine=exact.sine[0],
        cosine=exact.cosine[0],
        turns=exact.turns[0],
        turns_lo=exact.turns[1],
        cells=exact.cells[0],
        cells_lo=exact.cells[1],
        kappa=station.frequency_hz / network.carrier_hz,
        transmit_h=int(transmit_h),
        transmit_v=int(transmit_v),
        receive_h=int(receive_h),
        receive_v=int(receive_v),
        subcarriers=int(network.subcarriers),
        scale=exact.scale[0],
        centre_hz=float(centre),
        exact=np.array(exact),
    )
