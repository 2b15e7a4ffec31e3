"""The gain of one antenna element by direction; array sums are in `response`."""

import math
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from lowalt.config.network import Station
from lowalt.machine.jit import VECTOR


class Element(NamedTuple):
    """An element: largest gain (dBi), 3 dB width (degrees), depth of back and side lobes (dB), downtilt (degrees)."""

    gain_dbi: float = 8.0
    width_deg: float = 65.0
    back_db: float = 30.0
    downtilt_deg: float = 0.0


def pattern_db(element: Element, azimuth_deg: np.ndarray, zenith_deg: np.ndarray) -> np.ndarray:
    """Return the gain (dBi) at azimuths and zenith angles from the element's own boresight (0, 90); any shape.

    Source: 3GPP TR 38.901, Table 7.3-1.
    """
    up = np.minimum(12.0 * ((zenith_deg - 90.0) / element.width_deg) ** 2, element.back_db)
    across = np.minimum(12.0 * (azimuth_deg / element.width_deg) ** 2, element.back_db)
    return element.gain_dbi - np.minimum(up + across, element.back_db)


def gain(element: Element, station: Station, places: np.ndarray) -> np.ndarray:
    """Return the power gain (...) toward places (..., 3) m.

    The panel stays vertical; the downtilt turns the element's boresight.
    """
    away = np.asarray(places, np.float64) - np.asarray(station.position_m)
    # Coordinates of a view's points stand together in memory, and are taken one by one.
    x, y, z = away[..., 0], away[..., 1], away[..., 2]
    across = station.horizontal
    front, side, tilt = across[1] * x - across[0] * y, across[0] * x + across[1] * y, np.radians(element.downtilt_deg)
    ahead, up = np.cos(tilt) * front - np.sin(tilt) * z, np.sin(tilt) * front + np.cos(tilt) * z
    azimuth = angle(side, ahead)
    zenith = angle(np.sqrt(ahead * ahead + side * side), up)
    return np.exp(np.log(10.0) / 10.0 * pattern_db(element, np.degrees(azimuth), np.degrees(zenith)))


# arctan(t) / t as a polynomial of t^2, t up to tan(pi / 8), to rounding.
_EIGHTH = math.tan(math.pi / 8)
_ARCTANGENT = chebyshev.Chebyshev(
    chebyshev.chebinterpolate(
        lambda x: np.arctan(np.sqrt(0.5 * (x + 1.0)) * _EIGHTH) / (np.sqrt(0.5 * (x + 1.0)) * _EIGHTH), 11
    ),
    (0.0, _EIGHTH**2),
).convert(kind=np.polynomial.Polynomial, domain=(-1, 1), window=(-1, 1)).coef  # fmt: skip
_A0, _A1, _A2, _A3, _A4, _A5, _A6, _A7, _A8, _A9, _A10, _A11 = np.pad(_ARCTANGENT, (0, 12 - len(_ARCTANGENT))).tolist()


def angle(y: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return arctan2(y, x) (rad) to rounding, any shape, in a sixth of NumPy's time; 0 where both are 0."""
    y, x = np.asarray(y, np.float64, order="C"), np.asarray(x, np.float64, order="C")
    result = np.empty(y.shape)
    _angles(y.reshape(-1), x.reshape(-1), result.reshape(-1))
    return result


@VECTOR
def _angles(y, x, result):
    """Fill result (K,) with the angles of x + j y, both (K,)."""
    for i in range(np.uint64(len(y))):
        a, b = abs(x[i]), abs(y[i])
        small, large = min(a, b), max(max(a, b), 1e-300)
        # From tan(pi / 8) on, pi / 4 minus the angle is computed.
        far = small > _EIGHTH * large
        t = (large - small) / (large + small) if far else small / large
        z = t * t
        turn = (((((_A11 * z + _A10) * z + _A9) * z + _A8) * z + _A7) * z + _A6) * z + _A5
        turn = t * (((((turn * z + _A4) * z + _A3) * z + _A2) * z + _A1) * z + _A0)
        turn = 0.25 * math.pi - turn if far else turn
        turn = 0.5 * math.pi - turn if b > a else turn
        turn = math.pi - turn if x[i] < 0.0 else turn
        result[i] = -turn if y[i] < 0.0 else turn


def array_sum(count: int, x: np.ndarray) -> np.ndarray:
    """Return the sum (...) of `count` elements in a line, half a wavelength apart, counted from the first.

    x: direction cosine off the beam times the frequency over the carrier, any shape.
    """
    return np.exp(1j * np.pi * np.multiply.outer(x, np.arange(count))).sum(axis=-1)
