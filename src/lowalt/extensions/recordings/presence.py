"""Which windows hold a target: those with a line above the recording's own noise floor.

The noise of a cheap receiver is not white: slow noise rises towards zero speed. Where targets move,
a line is therefore compared with the noise at its own speed, which is heard while that speed is
empty. A target that hovers never leaves its speeds, so its lines are compared with what lies
between them.
"""

import math

import numpy as np
from scipy.ndimage import maximum_filter, maximum_filter1d, median_filter

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.extensions.recordings.twin import Twin

QUIET_SHARE = 0.1
"""Share of the windows in which a speed is taken to be empty."""
FLOOR_MPS = 0.5
"""Speeds to either side over which the noise floor is smooth."""
CONTINUES_DB = 12.0
"""Level over the noise floor at which a line is found that continues a line of the window before or
after it. It matters only if it is below `detect_db`.
"""
CONTINUES_MPS2 = 3.0
"""Largest acceleration of a line from one window to the next: that of cars that speed up or brake."""
STAYS_DB = 6.0
"""Level over the speeds around it above which a constant line is attenuated."""
ENOUGH = 20
"""Least number of windows with which a constant line can be told from a target."""
BETWEEN_SHARE = 0.25
"""Share of the powers around a speed that is taken to lie between a target's lines."""
AROUND = 0.25
"""Speeds to either side of a line with which it is compared, over the whole band."""
PASSES = 10.0
"""A target passes where a window stands this many times `detect_db` above the recording's quiet
time, while half of the windows hold no line."""
BEYOND_DB = 10.0
"""How far a line beyond the speeds that windows show must stand above all that they show: rotors'
lines do by less.
"""
STAYS_CELLS = 8
"""Doppler cells by which interference beyond the speeds that windows show may drift to either side.
"""
FEWEST_STAYS = 5
"""Least number of windows with which such interference can be told from a fast target."""
SLOW_CELLS = 4
"""Doppler cells about zero speed that hold slow noise and are no line beyond a window's speeds."""


def speeds_shown(speeds: np.ndarray, edge_mps: float, sides: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of the speeds that are shown, in order of display, and the speeds (m/s)
    that they mean.

    speeds: (n,) m/s, ascending; sides: "both"; "positive", only those above zero; "wrapped", a
    speed v < 0 means v + 2 edge_mps.
    """
    if sides == "positive":
        shown = np.flatnonzero(speeds > 0)
        return shown, speeds[shown]
    if sides == "wrapped":
        meant = np.mod(speeds, 2 * edge_mps)
        shown = np.argsort(meant, kind="stable")
        return shown, meant[shown]
    return np.arange(len(speeds)), speeds


def _quiet(power: np.ndarray) -> np.ndarray:
    """Mean (speeds,) of exponential powers, from the weakest tenth of the powers (n, speeds)."""
    count = len(power)
    least = math.ceil(QUIET_SHARE * count)
    of_noise = sum(1 / (count - k) for k in range(least))
    return np.partition(power, least - 1, axis=0)[least - 1] / of_noise


def noise_floor(power: np.ndarray, step_mps: float) -> np.ndarray:
    """Return the mean power of the noise (speeds,) in windows (n, speeds), `step_mps` (m/s) apart.

    At each speed the windows with the least power hold noise alone, if a target keeps to one speed
    for less than nine tenths of the time. Of n exponential powers the k-th smallest has the mean 1
    / n + ... + 1 / (n - k + 1). A running median over speed makes the floor smooth. With `ENOUGH`
    windows or more, a line that stays in nearly all of them is added to the floor, since a line
    that never moves is interference.
    Source: minimum statistics, Martin 2001, IEEE Trans. Speech Audio Processing 9(5).
    """
    quiet = _quiet(power)
    smooth = median_filter(quiet, 2 * round(FLOOR_MPS / step_mps) + 1, mode="nearest")
    if len(power) < ENOUGH:
        return smooth
    return np.maximum(smooth, maximum_filter(quiet, 3, mode="nearest"))


def without_hum(intervals: np.ndarray, twin: Twin) -> np.ndarray:
    """Return intervals (n, symbols) of one recording with constant lines attenuated.

    A line that is present in at least nine tenths of the intervals is attenuated to the level of
    the speeds around it, because a network takes the hum of a receiver for a weak target's limbs.
    Its level is estimated as that of noise, which is ten times too much for a line that does not
    vary; such a line then lies 10 dB below the speeds around it.
    The intervals are returned unchanged if targets of this radar may hover, since their lines are
    constant as well, or if there are fewer than `ENOUGH`.
    """
    count = intervals.shape[1]
    if not twin.slowest_mps or len(intervals) < ENOUGH:
        return intervals
    cells, speeds = _shown(count, twin)
    heard = cells[_may_have(speeds, twin)]
    spectra = np.fft.fft(intervals, axis=1)
    quiet = _quiet(np.abs(spectra[:, heard]) ** 2)
    step_mps = 2 * twin.edge_mps / count
    around = median_filter(quiet, 2 * round(FLOOR_MPS / step_mps) + 1, mode="nearest")
    over = maximum_filter(quiet, 3, mode="nearest") / np.maximum(around, 1e-300)
    stays = over > 10 ** (STAYS_DB / 10)
    spectra[:, heard[stays]] /= np.sqrt(over[stays])
    return np.fft.ifft(spectra, axis=1)


def floor_between(power: np.ndarray) -> np.ndarray:
    """Return the mean power of the noise (speeds,) between the lines of windows (n, speeds) over a
    whole Doppler band.

    The least quarter of all powers of all windows within a quarter of the band to either side is
    noise alone, if lines take up less than three quarters of it. Of exponential powers a share q
    lies below -ln(1 - q) times their mean.
    Source: order statistics, Rohling 1983, IEEE Trans. Aerospace Electronic Systems 19(4).
    """
    count = power.shape[1]
    reach = max(round(AROUND * count), 1)
    wrapped = np.concatenate([power[:, -reach:], power, power[:, :reach]], axis=1)
    least = [
        np.quantile(wrapped[:, first : first + 2 * reach + 1], BETWEEN_SHARE)
        for first in range(count)
    ]
    return np.array(least) / -math.log(1 - BETWEEN_SHARE)


def _shown(count: int, twin: Twin) -> tuple[np.ndarray, np.ndarray]:
    """Cells (n,) of a Fourier transform of `count` symbols that the twin shows, and the speeds that
    they mean (m/s), in order of display."""
    speeds = np.fft.fftshift(np.fft.fftfreq(count)) * 2 * twin.edge_mps
    order, meant = speeds_shown(speeds, twin.edge_mps, twin.sides)
    return np.fft.fftshift(np.arange(count))[order], np.abs(meant)


def _may_have(speeds: np.ndarray, twin: Twin) -> np.ndarray:
    """Which speeds (n,) m/s a target of the twin may have."""
    return (speeds >= twin.slowest_mps) & (speeds <= twin.fastest_mps)


def heard_powers(intervals: np.ndarray, twin: Twin) -> tuple[np.ndarray, np.ndarray]:
    """Return the powers (n, speeds) of intervals (n, symbols) at the speeds that the twin hears,
    and which of these (speeds,) a target may have; Hann window."""
    count = intervals.shape[1]
    cells, speeds = _shown(count, twin)
    power = np.abs(np.fft.fft(intervals * np.hanning(count), axis=1)) ** 2
    return power[:, cells], _may_have(speeds, twin)


def strongest_mps(intervals: np.ndarray, twin: Twin) -> np.ndarray:
    """Return the speed (n,) m/s of the strongest line of intervals (n, symbols) that a target may
    have.
    """
    power, heard = heard_powers(intervals, twin)
    speeds = _shown(intervals.shape[1], twin)[1]
    return speeds[heard][power[:, heard].argmax(axis=1)]


def present(intervals: np.ndarray, twin: Twin, noise: np.ndarray | None = None) -> np.ndarray:
    """Return which intervals (n, symbols) of one recording hold a target, (n,) bool: a line, Hann
    window, that stands `detect_db` above the recording's own noise floor.

    Where targets move (slowest_mps above 0) it is the floor at the line's own speed, in the other
    windows, and the line is at or above slowest_mps; a line of `CONTINUES_DB` is enough that
    continues one of a window next to it. Where they may hover it is the floor between lines. A
    recording of `ENOUGH` windows through which a target passes is also judged by its quiet
    time, so that hum next to it is no target.
    noise: intervals (m, symbols) of the receiver's noise alone, hum included, where they are known:
    a line must stand above their mean at its own speed, too.
    """
    power, heard = heard_powers(intervals, twin)
    quiet = heard_powers(noise, twin)[0] if noise is not None else power
    level = 10 ** (twin.detect_db / 10)
    step_mps = 2 * twin.edge_mps / intervals.shape[1]

    def over(floor: np.ndarray) -> np.ndarray:
        """How far the strongest line of each window stands above a floor (speeds,), as a ratio."""
        return (power[:, heard] / np.maximum(floor[heard], 1e-300)).max(axis=1)

    if twin.slowest_mps:
        floor = np.maximum(noise_floor(quiet, step_mps)[heard], 1e-300)
        window_s = twin.symbols * twin.symbol_interval_s
        weaker = min(level, 10 ** (CONTINUES_DB / 10))
        reach = round(CONTINUES_MPS2 * window_s / step_mps)
        return _continued(power[:, heard] / floor, level, weaker, reach)
    if noise is not None:
        of_noise = maximum_filter(quiet.mean(axis=0), 3, mode="wrap")
        return over(np.maximum(floor_between(quiet), of_noise)) >= level
    found = over(floor_between(quiet)) >= level
    if len(power) >= ENOUGH:
        passing = over(noise_floor(quiet, step_mps))
        if passing.max() >= PASSES * level and np.median(passing) < level:
            found &= passing >= level
    return found


def _continued(over: np.ndarray, level: float, weaker: float, reach: int) -> np.ndarray:
    """Which windows (n,) bool of the ratios `over` (n, speeds) hold a line of at least `level`, or
    one of at least `weaker` that continues, within `reach` cells, a line of a window next to it
    that is found.

    Source: the two thresholds of Canny 1986, IEEE Trans. Pattern Anal. Mach. Intell. 8(6).
    """
    found = over.max(axis=1) >= level
    lines = over >= weaker
    near = maximum_filter1d(lines.astype(np.uint8), 2 * reach + 1, axis=1, mode="constant") > 0
    continues = np.any(lines[1:] & near[:-1], axis=1)
    for later in range(1, len(found)):
        found[later] |= found[later - 1] and continues[later - 1]
    for earlier in range(len(found) - 2, -1, -1):
        found[earlier] |= found[earlier + 1] and continues[earlier]
    return found


def beyond_mps(values: np.ndarray, rate_hz: float, twin: Twin, count: int) -> np.ndarray:
    """Return the speed (count,) m/s of a line of each window that lies beyond the speeds that the
    twin's windows show, NaN where there is none.

    values: samples (samples,) of a recording at `rate_hz`. The line stands `BEYOND_DB` above all
    that windows show. One that stays in its place in nine tenths of `FEWEST_STAYS` windows or more
    is interference, such as a spur of the receiver, and counts only where it stands as much above
    that, too.
    """
    window_samples = twin.symbols * twin.symbol_interval_s * rate_hz
    length = min(math.floor(window_samples), len(values))
    starts = np.minimum(
        np.rint(np.arange(count) * window_samples).astype(int), len(values) - length
    )
    cut = values[starts[:, None] + np.arange(length)]
    centred = cut - cut.mean(axis=1, keepdims=True)
    power = np.abs(np.fft.fft(centred * np.hanning(length), axis=1)) ** 2
    cells = np.abs(np.fft.fftfreq(length, 1 / length))
    speeds = cells * rate_hz / length * SPEED_OF_LIGHT / twin.carrier_hz / 2
    level = 10 ** (BEYOND_DB / 10)
    outside = np.where(speeds > twin.fastest_mps, power, 0.0)
    if count >= FEWEST_STAYS:
        around = maximum_filter1d(outside, 2 * STAYS_CELLS + 1, axis=1, mode="constant")
        outside[outside <= level * np.quantile(around, QUIET_SHARE, axis=0)] = 0.0
    shown = power[:, (speeds <= twin.fastest_mps) & (cells >= SLOW_CELLS)].max(axis=1)
    far = outside.max(axis=1) > level * shown
    return np.where(far, speeds[outside.argmax(axis=1)], np.nan)
