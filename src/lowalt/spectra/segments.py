"""The windows of a signal, one segment each, as the float64 definitions of the spectra read them."""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.spectra.settings import windows


def segments(signals: np.ndarray, window: int, hop: int, name: str, extra: int = 0) -> np.ndarray:
    """Return segments of `window + extra` symbols, one a window, complex128: shape (..., windows, window + extra).

    Raises: InputError naming the spectrum where the signal is no longer than the window or is not finite.
    """
    signals = np.asarray(signals)
    if signals.ndim < 1:
        raise InputError(f"spectrum {name}: signals has shape {signals.shape}, expected (..., symbols)")
    if not np.isfinite(signals).all():
        raise InputError(f"spectrum {name}: signals has a NaN or infinite value")
    count = windows(signals.shape[-1], window, hop, name)
    view = np.lib.stride_tricks.sliding_window_view(signals.astype(np.complex128), window + extra, axis=-1)
    return view[..., : (count - 1) * hop + 1 : hop, :]
