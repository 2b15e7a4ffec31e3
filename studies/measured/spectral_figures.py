"""Figures of spectra that a radar engineer reads off: edges, lines, widths, cycles, kurtosis and entropy.

All take signals or magnitudes of spectra with their axes and give numbers in m/s, Hz or s; measured and simulated
signals go through the same functions.
"""

import numpy as np
from scipy.ndimage import median_filter
from scipy.signal import find_peaks, welch

from lowalt.extensions.recordings.presence import speeds_shown
from lowalt.spectra import magnitudes
from lowalt.spectra.settings import Fourier

INTERVAL = ("edge_mps", "line_mps", "width_mps", "kurtosis", "entropy")
"""Figures of one coherent interval, for every class."""
EDGE_SHARE = 0.95


def spectrum(interval: np.ndarray, edge_mps: float, sides: str) -> tuple[np.ndarray, np.ndarray]:
    """Return radial speeds (m/s, positive approaches) and power (n,) of an interval (symbols,), Hann window.

    edge_mps: the unambiguous speed; sides: as `speeds_shown` has them.
    """
    count = len(interval)
    power = np.abs(np.fft.fftshift(np.fft.fft(interval * np.hanning(count)))) ** 2
    speeds = np.fft.fftshift(np.fft.fftfreq(count)) * 2 * edge_mps
    shown, meant = speeds_shown(speeds, edge_mps, sides)
    return meant, power[shown]


FLOOR_MEDIANS = 8.0
"""Noise floor over the median power. White noise exceeds it in one bin of 256 (2^-8)."""


def above_floor(power: np.ndarray) -> np.ndarray:
    """Return power (n,) less the noise floor; nothing below zero."""
    return np.maximum(power - FLOOR_MEDIANS * np.median(power), 0.0)


def quantile(values: np.ndarray, weights: np.ndarray, shares: list[float]) -> np.ndarray:
    """Return the values (shares,) at cumulative shares of weights (n,); values (n,) ascending, linear inside a bin."""
    total = np.cumsum(weights)
    if total[-1] <= 0:
        return np.zeros(len(shares))
    return np.interp(shares, (total - weights / 2) / total[-1], values)


def interval_figures(interval: np.ndarray, edge_mps: float, sides: str) -> dict[str, float]:
    """Return the figures `INTERVAL` of a coherent interval (symbols,).

    edge: |speed| below which 95 % of the energy above the floor lies; line: |speed| of the strongest bin; width:
    distance of the speeds below which 25 % and 75 % of that energy lie (all m/s). kurtosis: of the magnitudes, 3 for a
    Gaussian; entropy: of the power as a distribution, over its largest value (0 for one line, 1 for white noise).
    """
    speeds, power = spectrum(interval, edge_mps, sides)
    shown = above_floor(power)
    order = np.argsort(np.abs(speeds), kind="stable")
    magnitude = np.sqrt(power)
    centred = magnitude - magnitude.mean()
    share = power / max(power.sum(), 1e-300)
    low, high = quantile(speeds, shown, [0.25, 0.75])
    return {
        "edge_mps": float(quantile(np.abs(speeds)[order], shown[order], [EDGE_SHARE])[0]),
        "line_mps": float(abs(speeds[power.argmax()])),
        "width_mps": float(high - low),
        "kurtosis": float((centred**4).mean() / max((centred**2).mean() ** 2, 1e-300)),
        "entropy": float(-(share * np.log(share + 1e-300)).sum() / np.log(len(share))),
    }


def spectrogram(signal: np.ndarray, rate_hz: float, window: int, hop: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times (s), frequencies (Hz) and magnitudes (frequencies, times) of a signal; the project's transform.

    window: symbols, a power of two; times are the middles of the windows.
    """
    shown = magnitudes(signal, Fourier(window, hop, 2 * window), "picture")
    frequencies = np.fft.fftshift(np.fft.fftfreq(2 * window, 1 / rate_hz))
    times = (np.arange(shown.shape[1]) * hop + window / 2) / rate_hz
    return times, frequencies, shown


def line_spacing_hz(signal: np.ndarray, rate_hz: float, low_hz: float, high_hz: float) -> float:
    """Return the spacing (Hz) of the lines of a comb in a signal's spectrum, searched between two bounds.

    The spacing is a peak of the autocorrelation over frequency of the log spectrum less its running median. Multiples
    of the spacing give peaks too, so the smallest spacing whose peak reaches 70 % of the highest is taken.
    """
    length = min(len(signal), 1 << int(np.log2(rate_hz)))
    frequency, power = welch(signal, rate_hz, nperseg=length, return_onesided=False, detrend="constant")
    order = np.argsort(frequency)
    level = 10 * np.log10(power[order] + 1e-300)
    step = rate_hz / length
    level -= median_filter(level, 2 * round(high_hz / step) + 1)
    level = np.clip(level, 0.0, 20.0)
    level -= level.mean()
    spread = np.fft.ifft(np.abs(np.fft.fft(level, 2 * len(level))) ** 2).real
    first, last = round(low_hz / step), round(high_hz / step)
    peaks, _ = find_peaks(spread[first - 1 : last + 2])
    if not len(peaks):
        return float("nan")
    places = peaks + first - 1
    best = spread[places].max()
    at = int(places[spread[places] >= best - 0.3 * abs(best)].min())
    # A parabola through three points places the peak between bins.
    before, top, after = spread[at - 1 : at + 2]
    return float((at + 0.5 * (before - after) / (before - 2 * top + after)) * step)


def cycle_s(shown: np.ndarray, hop_s: float, low_s: float, high_s: float) -> float:
    """Return the time (s) after which a spectrogram (frequencies, times) repeats itself, between two bounds.

    The mean autocorrelation over time of the rows' magnitudes, each row weighted by its own variance.
    """
    rows = shown - shown.mean(axis=1, keepdims=True)
    count = rows.shape[1]
    alike = np.fft.ifft(np.abs(np.fft.fft(rows, 2 * count, axis=1)) ** 2, axis=1).real.sum(axis=0)[:count]
    alike /= np.arange(count, 0, -1)
    first, last = max(1, round(low_s / hop_s)), min(count - 2, round(high_s / hop_s))
    peaks, _ = find_peaks(alike[first : last + 1])
    if not len(peaks):
        return float("nan")
    places = peaks + first
    best = alike[places].max()
    return float(places[alike[places] >= best - 0.2 * abs(best)].min() * hop_s)


def tracks(shown: np.ndarray, speeds: np.ndarray, slowest_mps: float) -> dict[str, np.ndarray]:
    """Return the speed of the strongest line (m/s), the edge (m/s) and whether the line counts, each (times,).

    shown: magnitudes (speeds, times); speeds: (m/s), ascending. Speeds below `slowest_mps` are left out: they hold the
    static part. edge: 95 % of the energy above the floor lies below it; counts: the line is 15 dB above the frame's
    median.
    """
    keep = np.abs(speeds) >= slowest_mps
    power, kept = shown[keep] ** 2, np.abs(speeds[keep])
    top = power.argmax(axis=0)
    floor = np.median(power, axis=0)
    order = np.argsort(kept, kind="stable")
    above = np.maximum(power - 4 * floor, 0.0)[order]
    edge = np.array([quantile(kept[order], column, [EDGE_SHARE])[0] for column in above.T])
    strength = power[top, np.arange(power.shape[1])]
    return {"line": kept[top], "edge": edge, "counts": strength > 10**1.5 * floor}


UNITS = {"mps": "m/s", "hz": "Hz", "s": "s", "db": "dB"}


def unit(figure: str) -> str:
    """Return the unit that the name of a figure ends in; "" for a figure without unit."""
    return UNITS.get(figure.rpartition("_")[2], "")
