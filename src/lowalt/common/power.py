"""The power of a signal: one formula for all stages, so that equal signals have equal powers to the last bit."""

import math

import numpy as np


def rms(signal: np.ndarray) -> float:
    """Return the root of the mean of |signal|^2 of a complex array of any shape, 0 for zeros.

    Scaling by the peak first keeps the mean square of very small or large signals out of under- and overflow.
    """
    signal = np.asarray(signal, dtype=np.complex128)
    peak = np.abs(signal).max()
    if peak == 0:
        return 0.0
    return float(peak * math.sqrt(np.mean(np.abs(signal / peak) ** 2)))
