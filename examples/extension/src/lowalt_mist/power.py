"""The spectrum `power`: squares of the short-time Fourier magnitudes, which strengthen what is
strong.
"""

import numpy as np

from lowalt.spectra import fourier
from lowalt.spectra.fourier import SIGNED, ZERO_FIRST, rows, speeds  # noqa: F401
from lowalt.spectra.settings import Fourier as Settings

TITLE = "power"
SOURCE = "square of the paper's Eq. 26"
DEFAULTS = Settings(64, 1, 256)
tables = fourier.tables


def definition(
    signals: np.ndarray,
    settings: Settings,
    name: str,
    frequency_hz: float,
    symbol_interval_s: float,
) -> np.ndarray:
    """Return the squares (..., rows, windows), float64."""
    return fourier.magnitudes(signals, settings, name) ** 2


def fill(
    re: np.ndarray, im: np.ndarray, settings: Settings, tables: tuple, out: np.ndarray
) -> None:
    """Fill out (rows, starts) float32 with the squares of the windows that start at 0 .. starts -
    1.
    """
    fourier.fill(re, im, settings, tables, out)
    np.square(out, out=out)
