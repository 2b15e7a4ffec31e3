"""The gain of one antenna element by direction; array sums are in `response`."""

import math
from typing import NamedTuple

import numpy as np

from lowalt.config.network import Station
from lowalt.machine.jit import LEAN, kernel
from lowalt.numerics.portable import TANGENT, from_decibels, sine_cosine


class Element(NamedTuple):
    """An antenna element.

    gain_dbi: largest gain; width_deg: 3 dB width; back_db: depth of back and side lobes;
    downtilt_deg: of its boresight.
    """

    gain_dbi: float = 8.0
    width_deg: float = 65.0
    back_db: float = 30.0
    downtilt_deg: float = 0.0


# arctan(t) / t as a polynomial of t^2, t up to tan(pi / 8), to rounding.
_EIGHTH = math.tan(math.pi / 8)
_ARCTANGENT = (1.0, *(-coefficient for coefficient in TANGENT))
_A0, _A1, _A2, _A3, _A4, _A5, _A6, _A7, _A8, _A9, _A10, _A11 = _ARCTANGENT


_SCALAR = kernel(forceinline=True, error_model="numpy", _nrt=False)
"""As LEAN, and copied into the loop that calls it."""


@_SCALAR
def _angle(y, x):
    """The angle (rad) of x + j y to rounding, 0 where both are 0."""
    a = abs(x)
    b = abs(y)
    small = min(a, b)
    large = max(max(a, b), 1e-300)
    # From tan(pi / 8) on, pi / 4 minus the angle is computed.
    far = small > _EIGHTH * large
    t = (large - small) / (large + small) if far else small / large
    z = t * t
    turn = (((((_A11 * z + _A10) * z + _A9) * z + _A8) * z + _A7) * z + _A6) * z + _A5
    turn = t * (((((turn * z + _A4) * z + _A3) * z + _A2) * z + _A1) * z + _A0)
    if far:
        turn = 0.25 * math.pi - turn
    if b > a:
        turn = 0.5 * math.pi - turn
    if x < 0.0:
        turn = math.pi - turn
    if y < 0.0:
        turn = -turn
    return turn


@_SCALAR
def pattern_db(element, azimuth_deg, zenith_deg):
    """Return the gain (dBi) at an azimuth and a zenith angle.

    They count from the element's own boresight at (0, 90) degrees.

    Source: 3GPP TR 38.901, Table 7.3-1.
    """
    up = min(12.0 * ((zenith_deg - 90.0) / element.width_deg) ** 2, element.back_db)
    across = min(12.0 * (azimuth_deg / element.width_deg) ** 2, element.back_db)
    return element.gain_dbi - min(up + across, element.back_db)


@LEAN
def _gains_db(element, station, across, tilt, places, result):
    """Fill result (N, L) with the gains (dBi) toward places (N, 3, L) m.

    across: the array's axis; tilt: (cos, sin).
    """
    degrees = 180.0 / math.pi
    for n in range(len(places)):
        xs = places[n, 0]
        ys = places[n, 1]
        zs = places[n, 2]
        row = result[n]
        for i in range(np.uint64(len(row))):
            x = xs[i] - station[0]
            y = ys[i] - station[1]
            z = zs[i] - station[2]
            front = across[1] * x - across[0] * y
            side = across[0] * x + across[1] * y
            ahead = tilt[0] * front - tilt[1] * z
            up = tilt[1] * front + tilt[0] * z
            zenith = _angle(np.sqrt(ahead * ahead + side * side), up)
            row[i] = pattern_db(element, degrees * _angle(side, ahead), degrees * zenith)


def gain(element: Element, station: Station, places: np.ndarray) -> np.ndarray:
    """Return the power gain (...) toward places (..., 3) m.

    The panel stays vertical; the downtilt turns the element's boresight.
    """
    places = np.asarray(places, np.float64)
    points = places
    if places.ndim != 3:
        points = places.reshape(1, -1, 3)
    sine, cosine = sine_cosine(np.radians(element.downtilt_deg))
    result = np.empty(points.shape[:2])
    _gains_db(
        Element(*map(float, element)),
        np.array(station.position_m, np.float64),
        station.horizontal,
        (float(cosine), float(sine)),
        np.ascontiguousarray(points.swapaxes(1, 2)),
        result,
    )
    return from_decibels(result).reshape(places.shape[:-1])


def array_sum(count: int, x: np.ndarray) -> np.ndarray:
    """Return the sum (...) of `count` elements in a line.

    They stand half a wavelength apart and are counted from the first.

    x: direction cosine off the beam times the frequency over the carrier, any shape.
    """
    return np.exp(1j * np.pi * np.multiply.outer(x, np.arange(count))).sum(axis=-1)
