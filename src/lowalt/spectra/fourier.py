"""Short-time Fourier spectra: the functions that VRP and TRP share.

They differ only in their settings.
"""

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.files.errors import InputError
from lowalt.spectra.known_times import line_sums, shares
from lowalt.spectra.settings import Fourier, windows
from lowalt.spectra.sliding import fourier_magnitudes, turns

SIGNED = False
ZERO_FIRST = True


def segments(signals: np.ndarray, window: int, hop: int, name: str, extra: int = 0) -> np.ndarray:
    """Return segments of `window + extra` symbols, one per window, complex128.

    Their shape is (..., windows, window + extra).

    Raises: InputError naming the spectrum where the signal is no longer than the window or is not
    finite.
    """
    signals = np.asarray(signals)
    if signals.ndim < 1:
        raise InputError(
            f"spectrum {name}: signals has shape {signals.shape}, expected (..., symbols)"
        )
    if not np.isfinite(signals).all():
        raise InputError(f"spectrum {name}: signals has a NaN or infinite value")
    count = windows(signals.shape[-1], window, hop, name)
    signals = signals.astype(np.complex128)
    view = np.lib.stride_tricks.sliding_window_view(signals, window + extra, axis=-1)
    return view[..., : (count - 1) * hop + 1 : hop, :]


def rows(settings: Fourier) -> int:
    """Return the number of frequencies."""
    return settings.points


def speeds(settings: Fourier, network: Network, station: Station) -> tuple[float, float]:
    """Return the folded speeds (m/s, positive recedes) of the first and last row of `definition`.

    A positive Doppler frequency approaches, so the speed falls along the rows.
    """
    bins = network.bin_speeds_mps(settings.points, station)
    return float(bins[-1]), float(bins[0])


def magnitudes(signals: np.ndarray, fourier: Fourier, name: str = "stft") -> np.ndarray:
    """Return |FFT| of every window, zero frequency in the middle; rectangular window.

    signals: (..., symbols) complex. Result: (..., points, windows), float64, rows from -1/2T_r
    upwards.
    Raises: InputError where the signal is no longer than the window or is not finite.
    Source: paper, Eq. 26, 27.
    """
    cut = segments(signals, fourier.window, fourier.hop, name)
    spectra = np.fft.fft(cut, fourier.points, axis=-1)
    return np.swapaxes(np.abs(np.fft.fftshift(spectra, axes=-1)), -1, -2)


def definition(
    signals: np.ndarray, settings: Fourier, name: str, frequency_hz: float, symbol_interval_s: float
) -> np.ndarray:
    """Return `magnitudes`; neither the carrier nor the symbol interval changes them."""
    return magnitudes(signals, settings, name)


def tables(
    settings: Fourier, frequency_hz: float, symbol_interval_s: float
) -> tuple[np.ndarray, ...]:
    """Return cosines and sines (points,) float32 of the transform.

    They are the same for every station.
    """
    return turns(settings.points, np.float32)


def fill(re: np.ndarray, im: np.ndarray, settings: Fourier, tables: tuple, out: np.ndarray) -> None:
    """Fill out (points, starts) float32 with the spectrum of windows.

    They start at symbols 0 .. starts - 1.
    """
    fourier_magnitudes(re, im, settings.window, settings.points, *tables, out)


def fill_known(
    signal: np.ndarray,
    times: np.ndarray,
    settings: Fourier,
    frequency_hz: float,
    symbol_interval_s: float,
    out: np.ndarray,
) -> None:
    """Fill out (points, starts) as `fill`, with lines that fit a signal received at known times.

    signal: (N,); times: (N,) in symbol intervals.
    """
    starts = out.shape[1]
    sums = line_sums(signal, times, np.fft.fftfreq(settings.points), settings.window, starts)
    out[:] = np.abs(sums) * (settings.window * shares(signal, settings.window, starts))
