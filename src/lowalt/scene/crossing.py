"""The way from one station's mast to another's, by the side lobes of both arrays.

Their beams point at the target.
"""

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Station
from lowalt.numerics.portable import norm
from lowalt.scene.antenna import array_sum, gain
from lowalt.scene.response import cosines
from lowalt.scene.view import View


def crossing(view: View, sends: Station, hears: Station) -> tuple[np.ndarray, float]:
    """Return the free-space response (M,) from mast to mast, and its delay (s).

    The response is that on the subcarriers of `hears`.

    Each station's beam points as in `view`; sends: with the frequency of `hears`. The response is
    in the units of the echo: the amplitude is sqrt(P / elements) lambda / (4 pi d) times both array
    sums. Source: Friis 1946.
    """
    network = view.network
    distance = float(norm(np.asarray(hears.position_m) - np.asarray(sends.position_m)))
    elements = np.prod(network.transmit) * np.prod(network.receive)
    level = np.sqrt(network.power / elements) * SPEED_OF_LIGHT / network.carrier_hz
    level = level / (4 * np.pi * distance)
    for station, other, counts in (
        (sends, hears, network.transmit),
        (hears, sends, network.receive),
    ):
        level = level * toward(view, station, counts, np.asarray(other.position_m))
        if view.element is not None:
            level *= np.sqrt(gain(view.element, station, np.asarray(other.position_m)))
    frequency = hears.frequency_hz + np.arange(network.subcarriers) * network.subcarrier_spacing_hz
    delay_s = distance / SPEED_OF_LIGHT
    return np.exp(-2j * np.pi * frequency * delay_s) * level, delay_s


def toward(view: View, station: Station, counts: tuple[int, int], places: np.ndarray) -> np.ndarray:
    """Return the sum (...) over a station's elements toward places (..., 3) m.

    The array is steered as in `view`. counts: of the elements, across and up.
    """
    off = (cosines(station, places) - cosines(station, view.aim_of(station))) * station.frequency_hz
    off = off / view.network.carrier_hz
    return array_sum(counts[0], off[..., 0]) * array_sum(counts[1], off[..., 1])
