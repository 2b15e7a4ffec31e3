"""Which windows hold a moving target: those with a line above the recording's own noise floor.

The noise of a cheap receiver is not white: slow noise rises towards zero speed, coupling capacitors cut it off below.
A line must therefore be compared with the noise at its own speed, and that floor is found in the recording.
"""

import math

import numpy as np
from scipy.ndimage import maximum_filter, median_filter

from lowalt.recordings.channel import EDGE, ONE_SIDED_EDGE
from lowalt.recordings.twin import Twin

QUIET_SHARE = 0.1
"""Share of the windows in which a speed is taken to be empty."""
FLOOR_MPS = 0.5
"""Speeds to either side over which the noise floor is smooth."""
ENOUGH = 20
"""Least number of windows with which a constant line can be told from a target."""


def speeds_shown(speeds: np.ndarray, edge_mps: float, sides: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of the speeds that are shown, in order of display, and the speeds (m/s) that they mean.

    speeds: (n,) m/s, ascending; sides: "both"; "positive", only those above zero; "wrapped", a speed v < 0 means v + 2
    edge_mps.
    """
    if sides == "positive":
        shown = np.flatnonzero(speeds > 0)
        return shown, speeds[shown]
    if sides == "wrapped":
        meant = np.mod(speeds, 2 * edge_mps)
        shown = np.argsort(meant, kind="stable")
        return shown, meant[shown]
    return np.arange(len(speeds)), speeds


def noise_floor(power: np.ndarray, step_mps: float) -> np.ndarray:
    """Return the mean power of the noise (speeds,) in windows (n, speeds), `step_mps` (m/s) apart.

    At each speed the windows with the least power hold noise alone, if a target keeps to one speed for less than nine
    tenths of the time. Of n exponential powers the k-th smallest has the mean 1 / n + ... + 1 / (n - k + 1). A running
    median over speed makes the floor smooth. With `ENOUGH` windows or more, a line that stays in nearly all of them is
    added to the floor, since a line that never moves is interference.
    Source: minimum statistics, Martin 2001, IEEE Trans. Speech Audio Processing 9(5).
    """
    count = len(power)
    least = math.ceil(QUIET_SHARE * count)
    quiet = np.partition(power, least - 1, axis=0)[least - 1] / sum(1 / (count - k) for k in range(least))
    smooth = median_filter(quiet, 2 * round(FLOOR_MPS / step_mps) + 1, mode="nearest")
    return smooth if count < ENOUGH else np.maximum(smooth, maximum_filter(quiet, 3, mode="nearest"))


def heard_powers(intervals: np.ndarray, twin: Twin) -> tuple[np.ndarray, np.ndarray]:
    """Return the powers (n, speeds) of intervals (n, symbols) at the speeds that the twin hears, and which of these
    (speeds,) a target may have; Hann window."""
    count = intervals.shape[1]
    power = np.abs(np.fft.fft(intervals * np.hanning(count), axis=1)) ** 2
    speeds = np.fft.fftshift(np.fft.fftfreq(count)) * 2 * twin.edge_mps
    order, meant = speeds_shown(speeds, twin.edge_mps, twin.sides)
    # The sampling filter ends at `EDGE` of the band; beyond it there is no noise to compare with.
    last = {"anti_aliased": EDGE, "one_sided": 2 * ONE_SIDED_EDGE, "bare": 1.0}[twin.sampling] * twin.edge_mps
    return np.fft.fftshift(power, axes=1)[:, order], (np.abs(meant) >= twin.slowest_mps) & (np.abs(meant) <= last)


def present(intervals: np.ndarray, twin: Twin, noise: np.ndarray | None = None) -> np.ndarray:
    """Return which intervals (n, symbols) of one recording hold a moving target, (n,) bool.

    The strongest line at |speed| >= slowest_mps stands `detect_db` above the recording's own noise floor at its speed,
    Hann window: a constant false alarm rate in noise of any colour. With detect_db = 0 all intervals hold one: the
    target never left.
    noise: intervals (m, symbols) of the receiver's noise alone, where they are known, as in a simulation.
    """
    if not twin.detect_db:
        return np.ones(len(intervals), bool)
    power, heard = heard_powers(intervals, twin)
    quiet = heard_powers(noise, twin)[0] if noise is not None else power
    floor = noise_floor(quiet, 2 * twin.edge_mps / intervals.shape[1])
    over = power[:, heard] / np.maximum(floor[heard], 1e-300)
    return over.max(axis=1) >= 10 ** (twin.detect_db / 10)
