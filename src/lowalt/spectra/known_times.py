"""Spectra that use the reception times of symbols: a line fitted to each window by least squares.

At each frequency f, a line a exp(j 2 pi f t) is fitted to the K symbols received in a window, at
their instants t_k:

    a(f) = sum_k y_k exp(-j 2 pi f t_k) / K

Spectra contain L a(f), with L symbols in a window, and so have the unit of evenly sampled ones. A
single line has its true amplitude despite missing or late symbols; several lines disturb each other
through side lobes. A joint fit of all frequencies would have fewer symbols than unknowns. Sums over
windows are differences of cumulative sums, in double.
"""

import numpy as np

SOURCE = (
    "N. R. Lomb, Astrophys. Space Sci. 39, 1976; P. Stoica, J. Li, H. He, Spectral analysis of "
    "nonuniformly sampled data: a new approach versus the periodogram, IEEE Trans. Signal Process. "
    "57(3), 2009 (least squares of one line)"
)


def received(signal: np.ndarray) -> np.ndarray:
    """Return which symbols of a signal (N,) were received, (N,) bool.

    They are those that are not exactly zero.
    """
    return signal != 0


def line_sums(
    signal: np.ndarray, times: np.ndarray, turns: np.ndarray, window: int, starts: int
) -> np.ndarray:
    """Return sums (R, starts) complex128 over windows of y_k exp(-j 2 pi f t_k).

    The windows start at symbols 0 .. starts - 1. signal: (N,), zero where nothing was received;
    times: (N,) in symbol intervals; turns: frequencies (R,) in turns a symbol interval.
    """
    at = np.flatnonzero(received(signal))
    steps = np.zeros((len(turns), len(signal) + 1), np.complex128)
    phases = -2j * np.pi * np.outer(turns, times[at])
    steps[:, at + 1] = signal[at] * np.exp(phases)
    summed = np.cumsum(steps, axis=1)
    return summed[:, window : window + starts] - summed[:, :starts]


def shares(signal: np.ndarray, window: int, starts: int) -> np.ndarray:
    """Return 1 / K (starts,) of windows, 0 where nothing was received.

    They start at symbols 0 .. starts - 1.
    """
    count = np.concatenate([[0], np.cumsum(received(signal))])
    found = (count[window : window + starts] - count[:starts]).astype(np.float64)
    return np.divide(1.0, found, out=np.zeros(starts), where=found > 0)


def even(signal: np.ndarray, late: np.ndarray | None) -> bool:
    """Return whether all symbols of a signal (N,) were received, and at their nominal instants."""
    return bool(received(signal).all()) and (late is None or not np.any(late))
