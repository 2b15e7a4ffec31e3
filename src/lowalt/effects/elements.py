"""Distances of an array's elements from its corner, where ranges are measured to; half-wavelength spacing."""

from functools import lru_cache

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT, Network


def distances_m(network: Network, shape: tuple[int, int]) -> np.ndarray:
    """Return the distance (elements,) of every element of an array `shape` from its corner (m)."""
    i, j = np.meshgrid(np.arange(shape[0]), np.arange(shape[1]))
    return SPEED_OF_LIGHT / (2 * network.carrier_hz) * np.hypot(i, j).ravel()


def mean_distance_m(network: Network, shape: tuple[int, int]) -> float:
    """Return the mean distance of an array's elements from its corner (m)."""
    return _extents(network, tuple(shape))[0]


def farthest_m(network: Network) -> float:
    """Return the largest distance of any element of both arrays from its corner (m)."""
    return max(_extents(network, tuple(shape))[1] for shape in (network.transmit, network.receive))


@lru_cache(maxsize=64)
def _extents(network: Network, shape: tuple[int, int]) -> tuple[float, float]:
    """Mean and largest distance of an array's elements from its corner (m), which many bounds ask for."""
    distances = distances_m(network, shape)
    return float(distances.mean()), float(distances.max())
