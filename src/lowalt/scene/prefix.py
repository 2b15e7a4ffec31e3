"""The cyclic prefix of the symbols: its length, and the phase of a symbol that ends before the window."""

import numpy as np

from lowalt.config.network import Network

NORMAL = 144 / 2048
"""Length of NR's normal cyclic prefix, in useful symbol lengths (3GPP TS 38.211, 5.3.1)."""


def length_s(settings: dict, network: Network) -> float:
    """Return the prefix's length (s): the given one, or NR's normal prefix."""
    return NORMAL / network.subcarrier_spacing_hz if settings["prefix_s"] is None else settings["prefix_s"]


def turn(settings: dict, network: Network) -> np.ndarray:
    """Return the factor (M,) exp(j 2 pi f T_cp) of the previous symbol, which ends a prefix before the window."""
    count = network.subcarriers
    baseband_hz = (np.arange(count) - count // 2) * network.subcarrier_spacing_hz
    return np.exp(2j * np.pi * baseband_hz * length_s(settings, network))
