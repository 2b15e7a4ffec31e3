"""The cyclic prefix of the symbols: its length, and the phase of a symbol that ends before the window."""

import numpy as np

from lowalt.common.network import Network

NORMAL = 144 / 2048
"""Length of the normal cyclic prefix, in useful symbol lengths."""


def length_s(settings: dict, network: Network) -> float:
    """Return the prefix's length (s): the given one, or NR's normal prefix."""
    return NORMAL / network.subcarrier_spacing_hz if settings["prefix_s"] is None else settings["prefix_s"]


def turn(settings: dict, network: Network, baseband_hz: np.ndarray) -> np.ndarray:
    """Return the factor (M,) exp(j 2 pi f T_cp) of the previous symbol, which ends a prefix before the window."""
    return np.exp(2j * np.pi * baseband_hz * length_s(settings, network))
