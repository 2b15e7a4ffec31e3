"""The gain of one antenna element by direction; array sums are in `response`."""

import math
from typing import NamedTuple

import numpy as np

from lowalt.common.network import Station
from lowalt.effects import antenna_loops


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


def local_gain(element: Element, ahead: np.ndarray, side: np.ndarray, up: np.ndarray) -> np.ndarray:
    """Return the power gain for components along the array's normal, its horizontal axis and up; any shape and length.

    The panel stays vertical; the downtilt turns the element's boresight.
    """
    tilt = np.radians(element.downtilt_deg)
    ahead, up = np.cos(tilt) * ahead - np.sin(tilt) * up, np.sin(tilt) * ahead + np.cos(tilt) * up
    azimuth, zenith = np.degrees(np.arctan2(side, ahead)), np.degrees(np.arctan2(np.hypot(ahead, side), up))
    return 10 ** (pattern_db(element, azimuth, zenith) / 10)


def gain(element: Element, station: Station, places: np.ndarray) -> np.ndarray:
    """Return the power gain (...) toward places (..., 3) m; it equals `local_gain` to rounding."""
    # The coordinates of a symbol's points stand together in memory (`rigid_loops.carry`).
    shape, places = np.shape(places)[:-1], np.asarray(places, np.float64)
    planes = places if places.ndim == 3 else places.reshape(1, -1, 3)
    planes = np.ascontiguousarray(planes.swapaxes(1, 2))
    out = np.empty((len(planes), planes.shape[2]))
    tilt, nepers = math.radians(element.downtilt_deg), math.log(10) / 10
    most = nepers * element.back_db
    axes = np.array([math.cos(station.normal_rad), math.sin(station.normal_rad), *station.horizontal[:2]])
    antenna_loops.power_gain(
        planes, np.asarray(station.position_m, float), axes, np.array([math.cos(tilt), math.sin(tilt)]),
        10 ** (element.gain_dbi / 10), nepers * 12.0 * math.degrees(1.0 / element.width_deg) ** 2, most,
        antenna_loops.halvings(most), np.empty((7, planes.shape[2])), out,
    )  # fmt: skip
    return out.reshape(shape)


def array_sum(count: int, x: np.ndarray) -> np.ndarray:
    """Return the sum (...) of `count` elements in a line, half a wavelength apart, counted from the first.

    x: direction cosine off the beam times the frequency over the carrier, any shape.
    """
    return np.exp(1j * np.pi * np.multiply.outer(x, np.arange(count))).sum(axis=-1)
