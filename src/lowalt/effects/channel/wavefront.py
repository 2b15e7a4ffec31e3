"""Spherical wavefront: every element of an array has its own distance to a point, not the plane wave's."""

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.effects.elements import distances_m
from lowalt.effects.view import View

SOURCE = "Balanis, Antenna Theory, 4th ed., 2016, section 4.4.1 (phase error of the far-field approximation)"
DEFAULTS: dict[str, float] = {}


def idle(settings: dict) -> bool:
    """Return False: a scene that names this effect always gets it, where its bound exceeds the tolerance."""
    return False


def bound(settings: dict, view: View, others: frozenset[str] = frozenset()) -> np.ndarray:
    """Return a bound (N, P) of the wavefront's change of any range cell, relative to each part's peak amplitudes.

    An element at distance D from the array's corner has a path that differs from the plane wave's by at most
    D^2 / (2 (r - D)) and an amplitude by D / (r - D); averaged over elements, out and back multiply.
    """
    network = view.network
    wave = 2 * np.pi * (view.station.frequency_hz + network.subcarriers * network.subcarrier_spacing_hz)
    wave /= SPEED_OF_LIGHT
    r = view.nearest_m()
    grown = np.ones_like(r)
    for shape in (network.transmit, network.receive):
        distance = distances_m(network, shape)
        with np.errstate(divide="ignore", invalid="ignore"):
            room = np.where(r > distance.max(), r - distance.max(), np.nan)
        square, length = float((distance**2).mean()), float(distance.mean())
        grown *= 1.0 + np.nan_to_num(wave * square / (2.0 * room) + length / room, nan=np.inf)
    return grown - 1.0
