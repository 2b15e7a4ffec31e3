"""Distances of an array's elements from its corner, where ranges are measured to; half-wavelength spacing."""

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT, Network


def distances_m(network: Network, shape: tuple[int, int]) -> np.ndarray:
    """Return the distance (elements,) of every element of an array `shape` from its corner (m)."""
    i, j = np.meshgrid(np.arange(shape[0]), np.arange(shape[1]))
    return SPEED_OF_LIGHT / (2 * network.carrier_hz) * np.hypot(i, j).ravel()


def mean_distance_m(network: Network, shape: tuple[int, int]) -> float:
    """Return the mean distance of an array's elements from its corner (m)."""
    return float(distances_m(network, shape).mean())


def farthest_m(network: Network) -> float:
    """Return the largest distance of any element of both arrays from its corner (m)."""
    return max(float(distances_m(network, shape).max()) for shape in (network.transmit, network.receive))
