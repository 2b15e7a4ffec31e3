"""Reflection of plane waves at a lossy half space."""

import numpy as np

VACUUM_F_M = 8.8541878128e-12
"""Permittivity of the vacuum (F/m), CODATA 2018."""


def fresnel(
    sine: np.ndarray,
    permittivity: float,
    conductivity_s_m: float,
    frequency_hz: float,
    polarisation: str,
) -> np.ndarray:
    """Return the complex reflection coefficient at grazing angles of `sine` (any shape, 0 to 1).

    Fields go as exp(+j 2 pi f t), so a wave's phase is exp(-j 2 pi f r / c) and the complex
    permittivity eps - j sigma / (2 pi f eps0). Vertical polarisation counts the field's vertical
    component, and is -1 at grazing.
    """
    epsilon = permittivity - 1j * conductivity_s_m / (2 * np.pi * frequency_hz * VACUUM_F_M)
    inside = np.sqrt(epsilon - 1.0 + sine * sine)
    outside = sine
    if polarisation == "vertical":
        outside = sine * epsilon
    return (outside - inside) / (outside + inside)
