"""VRP, TRP and VT by their definitions in float64, batched over signals: the path for analysis and for checks.

Frequencies and speeds ascend along the row axis, time along the last axis. Images turn the rows round and
use the single-pass kernels of `lowalt.spectra.sliding`, which compute the same values.
"""

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.spectra.settings import Fourier, Spectra, windows


def _segments(signals: np.ndarray, window: int, hop: int, name: str, extra: int = 0) -> np.ndarray:
    """Segments of `window + extra` symbols, one a window, in complex128: shape (..., windows, window + extra)."""
    signals = np.asarray(signals)
    if signals.ndim < 1:
        raise InputError(f"spectrum {name}: signals has shape {signals.shape}, expected (..., symbols)")
    if not np.isfinite(signals).all():
        raise InputError(f"spectrum {name}: signals has a NaN or infinite value")
    count = windows(signals.shape[-1], window, hop, name)
    view = np.lib.stride_tricks.sliding_window_view(signals.astype(np.complex128), window + extra, axis=-1)
    return view[..., : (count - 1) * hop + 1 : hop, :]


def magnitudes(signals: np.ndarray, fourier: Fourier, name: str = "stft") -> np.ndarray:
    """Return |FFT| of every window, zero frequency in the middle; rectangular window.

    signals: (..., symbols) complex. Result: (..., points, windows), float64, rows from -1/2T_r upwards.
    Raises: InputError where the signal is no longer than the window or is not finite.
    Source: paper, Eq. 26, 27.
    """
    spectra = np.fft.fft(_segments(signals, fourier.window, fourier.hop, name), fourier.points, axis=-1)
    return np.swapaxes(np.abs(np.fft.fftshift(spectra, axes=-1)), -1, -2)


def vrp(signals: np.ndarray, settings: Spectra | None = None) -> np.ndarray:
    """Return the velocity-resolution-preferred spectrum, (..., symbols) -> (..., 256, 144) by default.

    Raises: InputError where the signal is no longer than the window or is not finite.
    Source: paper, Eq. 28.
    """
    return magnitudes(signals, (settings or Spectra()).vrp, "vrp")


def trp(signals: np.ndarray, settings: Spectra | None = None) -> np.ndarray:
    """Return the time-resolution-preferred spectrum, (..., symbols) -> (..., 1024, 392) by default.

    Raises: InputError where the signal is no longer than the window or is not finite.
    Source: paper, Eq. 29.
    """
    return magnitudes(signals, (settings or Spectra()).trp, "trp")


def vt(
    signals: np.ndarray, frequency_hz: float, symbol_interval_s: float, settings: Spectra | None = None
) -> np.ndarray:
    """Return the velocity-transfer spectrum, (..., symbols) -> (..., 123, 392) by default.

    frequency_hz: f_k of the station that heard the signals; symbol_interval_s: T_r. Rows are the matched
    speeds (ascending, positive recedes); the unit is that of |signal|^2.
    Raises: InputError where the signal is no longer than the window or is not finite.
    Source: paper, Eq. 30 to 35.
    """
    transfer = (settings or Spectra()).vt
    length = transfer.window
    # The published count of windows is that of the shorter segment less one, so each has one more symbol behind it.
    segments = _segments(signals, length, transfer.hop, "vt", extra=1)
    steps = np.arange(length + 1)
    phase = 4 * np.pi * frequency_hz * symbol_interval_s / SPEED_OF_LIGHT * np.outer(transfer.speeds_mps, steps)
    matched = np.exp(1j * phase)
    short = np.einsum("vl,...gl->...vg", matched[:, :length], segments[..., :length])
    longer = np.einsum("vl,...gl->...vg", matched, segments)
    return (np.abs(longer) * length / (length + 1)) ** 2 - np.abs(short) ** 2
