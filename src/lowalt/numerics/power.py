"""The power of a signal: one formula for all stages, so that equal signals have equal powers to the last bit."""

import math

import numpy as np

from lowalt.numerics.portable import total


def rms(signal: np.ndarray) -> float:
    """Return the root of the mean of |signal|^2 of a complex array of any shape, 0 for zeros.

    Scaling by a power of two first keeps the mean square of very small or large signals out of under- and overflow.
    """
    signal = np.asarray(signal, dtype=np.complex128).ravel()
    parts = np.stack([signal.real, signal.imag])
    peak = float(np.abs(parts).max())
    if peak == 0:
        return 0.0
    twos = math.frexp(peak)[1]
    parts = np.ldexp(parts, -twos)
    # The parts' squares apart, since a library's |z| depends on the processor; added one by one, for the same reason.
    return math.ldexp(math.sqrt(float(total(parts[0] * parts[0] + parts[1] * parts[1])) / signal.size), twos)
