"""HRRP: the range profile over slow time, range cells around the strongest one by symbols.

It is made of range profiles (`lowalt.echo.range_profile`), not of a station's signal, which holds one cell alone.
"""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.spectra.settings import RangeCells as Settings

TITLE = "range profile (HRRP)"
SOURCE = "AirGuard, arXiv 2603.13112; paper, Eq. 25"
SIGNED = False
ZERO_FIRST = False
AXIS = "range (cells from the strongest)"


DEFAULTS = Settings(1, 1, 33)


def rows(settings: Settings) -> int:
    """Return the number of range cells."""
    return settings.cells


def speeds(settings: Settings, frequency_hz: float, symbol_interval_s: float) -> tuple[float, float]:
    """Return the range of the first and the last row, in cells from the strongest one (`AXIS`), not in m/s."""
    return -float(settings.cells // 2), float(settings.cells // 2)


def definition(
    signals: np.ndarray, settings: Settings, name: str, frequency_hz: float, symbol_interval_s: float
) -> np.ndarray:
    """Return root mean square magnitudes of profiles, (..., cells, symbols) -> (..., cells, windows), range ascending.

    Raises: InputError where these are no profiles of `cells` cells, or no longer than the window.
    """
    signals = np.asarray(signals)
    if signals.ndim < 2 or signals.shape[-2] != settings.cells:
        raise InputError(f"spectrum {name}: {signals.shape}, expected profiles (..., {settings.cells}, symbols)")
    count = (signals.shape[-1] - settings.window) // settings.hop
    if count < 1:
        raise InputError(f"spectrum {name}: {signals.shape[-1]} symbols, expected more than {settings.window}")
    parts = np.lib.stride_tricks.sliding_window_view(np.abs(signals) ** 2, settings.window, axis=-1)
    return np.sqrt(parts.mean(axis=-1)[..., : count * settings.hop : settings.hop])


def tables(settings: Settings, frequency_hz: float, symbol_interval_s: float) -> tuple[np.ndarray, ...]:
    """Return no tables."""
    return ()


def fill(re: np.ndarray, im: np.ndarray, settings: Settings, tables: tuple, out: np.ndarray) -> None:
    """Refuse a signal. Raises: InputError, since a signal holds one range cell."""
    raise InputError("spectrum hrrp: a signal holds one range cell, expected range profiles")


def fill_profile(profile: np.ndarray, settings: Settings, out: np.ndarray) -> None:
    """Fill out (cells, starts) float32 from a profile's magnitudes (cells, symbols) float32, at most 1."""
    starts, power = out.shape[1], profile * profile
    total = power[:, :starts].copy()
    for step in range(1, settings.window):
        total += power[:, step : step + starts]
    np.sqrt(total / np.float32(settings.window), out=out)
