"""Cosine and sine as polynomials of the squared angle in turns, of as many orders as an error or an angle asks for."""

from functools import lru_cache

import numpy as np

from lowalt.echo.fast.polynomials import smooth

DEGREE = 11
WAVE = np.stack([smooth(name, 0.25, DEGREE)[0] for name in ("cosine", "sine")])
"""Rows COSINE and SINE: cos(2 pi t) and sin(2 pi t) / t as polynomials of t^2, t on [-1/2, 1/2] turns, to rounding."""
COSINE, SINE = 0, 1


@lru_cache(maxsize=16)
def waves(error: float) -> np.ndarray:
    """Return polynomials as in WAVE, of the smallest degree at which cosine and sine err by at most `error`."""
    for degree in range(1, DEGREE):
        (cosine, off), (sine, slope) = smooth("cosine", 0.25, degree), smooth("sine", 0.25, degree)
        if off + 0.5 * slope <= error:
            return np.stack([cosine, sine])
    return WAVE


@lru_cache(maxsize=16)
def waves_within(turns: float) -> np.ndarray:
    """Return polynomials as in WAVE, without the orders that change nothing up to so many turns."""
    sizes = (abs(WAVE) * min(turns, 0.5) ** (2 * np.arange(DEGREE + 1))).max(axis=0)
    return np.ascontiguousarray(WAVE[:, : max(2, int((sizes > 2.0**-60).sum()))])
