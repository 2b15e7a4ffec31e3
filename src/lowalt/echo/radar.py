"""The constants of one station that the kernels need, as floats and double-doubles computed once.

A double-double is the unevaluated sum of two doubles (about 32 digits). Turns per metre are stored so, because at
100 km and 4.9 GHz the phase is 2e7 rad, and one double would leave only eight digits of the turn.
"""

from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT, Network, Station

LIGHT = Fraction(int(SPEED_OF_LIGHT))


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
    bandwidth_hz: float
    """M df (Hz): range cells per second of delay."""


def _double_double(value: Fraction) -> tuple[float, float]:
    high = float(value)
    return high, float(value - Fraction(high))


@lru_cache(maxsize=64)
def radar(network: Network, station: Station) -> Radar:
    """Return the constants of `station` (spec: alpha, a0, kappa and the effective carrier f_k + (M-1) df / 2)."""
    low, spacing = Fraction(station.frequency_hz), Fraction(network.subcarrier_spacing_hz)
    centre = low + (network.subcarriers - 1) * spacing / 2
    elements = float(np.prod(network.transmit) * np.prod(network.receive))
    wavelength = SPEED_OF_LIGHT / network.carrier_hz
    return Radar(
        np.array(station.position_m, dtype=np.float64),
        float(np.sin(station.normal_rad)),
        float(np.cos(station.normal_rad)),
        *_double_double(2 * centre / LIGHT),
        *_double_double(2 * network.subcarriers * spacing / LIGHT),
        station.frequency_hz / network.carrier_hz,
        int(network.transmit[0]),
        int(network.transmit[1]),
        int(network.receive[0]),
        int(network.receive[1]),
        int(network.subcarriers),
        float(np.sqrt(network.power / elements) * wavelength / (4 * np.pi) ** 1.5),
        float(centre),
        float(network.subcarriers * spacing),
    )
