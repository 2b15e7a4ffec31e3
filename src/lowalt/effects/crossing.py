"""The way from one station's mast to another's, by both arrays' side lobes while their beams point at the target."""

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT, Station
from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import radar
from lowalt.effects.antenna import gain
from lowalt.effects.view import View


def crossing(view: View, sends: Station, hears: Station) -> tuple[np.ndarray, float]:
    """Return the free-space response (M,) from mast to mast on the subcarriers of `hears`, and its delay (s).

    Each station's beam points as in `view`; sends: with the frequency of `hears`. The response is in the units of the
    echo: the amplitude is sqrt(P / elements) lambda / (4 pi d) times both array sums. Source: Friis 1946.
    """
    network = view.network
    distance = float(np.linalg.norm(np.asarray(hears.position_m) - np.asarray(sends.position_m)))
    elements = np.prod(network.transmit) * np.prod(network.receive)
    level = np.sqrt(network.power / elements) * SPEED_OF_LIGHT / network.carrier_hz / (4 * np.pi * distance)
    level *= _array(view, sends, network.transmit, hears) * _array(view, hears, network.receive, sends)
    if view.element is not None:
        ends = ((sends, hears), (hears, sends))
        gains = [gain(view.element, one, np.asarray(other.position_m, float)) for one, other in ends]
        level *= np.sqrt(np.prod(gains))
    frequency = hears.frequency_hz + np.arange(network.subcarriers) * network.subcarrier_spacing_hz
    delay_s = distance / SPEED_OF_LIGHT
    return np.exp(-2j * np.pi * frequency * delay_s) * level, delay_s


def _array(view: View, station: Station, counts: tuple[int, int], other: Station) -> complex:
    """Sum over a station's array, steered to the target, toward another station."""
    radio = radar(view.network, station)
    axes = radio.station, radio.sine, radio.cosine
    toward = aim_cosines(np.asarray(other.position_m, np.float64), *axes)
    steered = aim_cosines(np.asarray(view.aim_of(station), np.float64), *axes)
    total = 1.0 + 0.0j
    for count, seen, aimed in zip(counts, toward, steered, strict=True):
        total *= np.exp(1j * np.pi * radio.kappa * np.arange(count) * (seen - aimed)).sum()
    return total
