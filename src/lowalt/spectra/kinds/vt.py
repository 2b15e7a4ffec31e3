"""VT: the velocity-transfer spectrum, the difference of two filters matched to each speed."""

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.numerics.portable import sine_cosine
from lowalt.spectra.fourier import segments
from lowalt.spectra.known_times import line_sums, shares
from lowalt.spectra.settings import Transfer
from lowalt.spectra.sliding import transfer

TITLE = "velocity transfer (VT)"
SOURCE = "paper, Eq. 30 to 35"
SIGNED = True
ZERO_FIRST = False
Settings = Transfer
DEFAULTS = Settings(8, 1, -6.1, 6.1, 0.1)


def rows(settings: Transfer) -> int:
    """Return the number of matched speeds."""
    return len(settings.speeds_mps)


def speeds(settings: Transfer, network: Network, station: Station) -> tuple[float, float]:
    """Return the speeds (m/s, positive recedes) of the first and the last row of `definition`.

    The filters are matched at f_k, as in the paper's Eq. 32, but the Doppler frequency is that at
    the effective carrier f_e. The filter of speed v therefore responds to an echo of speed v f_k /
    f_e.
    """
    ratio = station.frequency_hz / network.effective_hz(station)
    return float(settings.speeds_mps[0] * ratio), float(settings.speeds_mps[-1] * ratio)


def definition(
    signals: np.ndarray,
    settings: Transfer,
    name: str,
    frequency_hz: float,
    symbol_interval_s: float,
) -> np.ndarray:
    """Return the spectrum in float64, (..., symbols) -> (..., speeds, windows).

    The unit is that of |signal|^2.

    Raises: InputError where the signal is no longer than the window or is not finite.
    """
    length = settings.window
    # The published number of windows is one less than the shorter segment allows, so each window
    # can be one longer.
    cut = segments(signals, length, settings.hop, name, extra=1)
    steps = np.outer(settings.speeds_mps, np.arange(length + 1))
    rad_per_m = 4 * np.pi * frequency_hz * symbol_interval_s / SPEED_OF_LIGHT
    matched = np.exp(1j * (rad_per_m * steps))
    short = np.einsum("vl,...gl->...vg", matched[:, :length], cut[..., :length])
    longer = np.einsum("vl,...gl->...vg", matched, cut)
    return (np.abs(longer) * length / (length + 1)) ** 2 - np.abs(short) ** 2


def tables(
    settings: Transfer, frequency_hz: float, symbol_interval_s: float
) -> tuple[np.ndarray, ...]:
    """Return cosines and sines (speeds, window + 1) of the matched filters.

    The longer window's share (1,) comes third.
    """
    length = settings.window
    steps = np.outer(settings.speeds_mps, np.arange(length + 1))
    phase = 4 * np.pi * frequency_hz * symbol_interval_s / SPEED_OF_LIGHT * steps
    sine, cosine = sine_cosine(phase)
    share = np.array([(length / (length + 1)) ** 2], np.float32)
    return cosine.astype(np.float32), sine.astype(np.float32), share


def fill(
    re: np.ndarray, im: np.ndarray, settings: Transfer, tables: tuple, out: np.ndarray
) -> None:
    """Fill out (speeds, starts) float32 with the spectrum of windows.

    They start at symbols 0 .. starts - 1.
    """
    transfer(re, im, settings.window, *tables, out)


def fill_known(
    signal: np.ndarray,
    times: np.ndarray,
    settings: Transfer,
    frequency_hz: float,
    symbol_interval_s: float,
    out: np.ndarray,
) -> None:
    """Fill out (speeds, starts) as `fill`, with lines that fit a signal received at known times.

    signal: (N,); times: (N,) in symbol intervals.
    """
    starts = out.shape[1]
    length = settings.window
    turns = -2 * frequency_hz * symbol_interval_s / SPEED_OF_LIGHT * settings.speeds_mps

    def filtered(count: int) -> np.ndarray:
        """Magnitudes (speeds, starts) of the filters matched to `count` symbols."""
        sums = line_sums(signal, times, turns, count, starts)
        return length * shares(signal, count, starts) * np.abs(sums)

    out[:] = filtered(length + 1) ** 2 - filtered(length) ** 2
