"""Physical features of slow-time signals: numbers of a target that a person can read off its
spectra.

Every function takes signals (B, N) complex, one per row, and the symbol interval (s). Doppler
frequencies are folded into -1 / 2 T_r .. 1 / 2 T_r, as the symbols sample them; distances between
them are the shorter way round.
Source: Chen, The Micro-Doppler Effect in Radar, 2nd ed. 2019, ch. 2 and 3 (lines of rotors and
wings); Molchanov et al., Int. J. Microw. Wirel. Technol. 6, 2014 (features of micro-Doppler
signatures for classification).
"""

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT

POINTS = 1024
"""Points of the zero-padded transform of a look."""
OCTAVES_HZ = (3.0, 6.0, 12.0, 25.0, 50.0, 100.0)
"""Distances from the body line that part the Doppler axis into bands."""
NAMES = (
    "body_speed_mps",
    "body_share",
    "body_drift_hz",
    "bandwidth_50_hz",
    "bandwidth_90_hz",
    "line_spacing_hz",
    "line_strength",
    "repetition_hz",
    "periodicity",
    "envelope_variation",
    "envelope_kurtosis",
    "flatness",
    *(f"share_to_{limit:g}_hz" for limit in OCTAVES_HZ),
    "asymmetry",
)
"""Features of one station's signal, in the order of `features`."""


def power_spectrum(signals: np.ndarray, interval_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies (POINTS,) Hz in FFT order and the power spectrum (B, POINTS), each of sum
    one.

    The window is Hann's, so a strong body line does not cover weak lines of moving parts by its
    side lobes.
    """
    window = np.hanning(signals.shape[-1] + 2)[1:-1]
    power = np.abs(np.fft.fft(signals * window, POINTS, axis=-1)) ** 2
    total = power.sum(-1, keepdims=True)
    return np.fft.fftfreq(POINTS, interval_s), power / np.where(total > 0, total, 1)


def spectral_moments(signals: np.ndarray, frequency_hz: float, interval_s: float) -> np.ndarray:
    """Return mean size, deviation, skewness and kurtosis (B, 4) of the Doppler frequency, weighted
    by power.

    frequency_hz: of the station, not used; interval_s: T_r. The mean is the size of the folded
    frequency; the other three are about the mean. The skewness has no sign, since a target turned
    by 180 degrees has the opposite one.
    """
    frequency, power = power_spectrum(signals, interval_s)
    mean = power @ frequency
    away = frequency - mean[:, None]
    deviation = np.sqrt(np.maximum((power * away**2).sum(-1), 1e-12))
    third, fourth = ((power * away**order).sum(-1) / deviation**order for order in (3, 4))
    return np.stack([np.abs(mean), deviation, np.abs(third), fourth], axis=-1)


def body_line_hz(signals: np.ndarray, interval_s: float) -> np.ndarray:
    """Return the Doppler frequency (B,) Hz of the strongest line, by a parabola through its three
    largest values.
    """
    _, power = power_spectrum(signals, interval_s)
    place = power.argmax(-1)
    rows = np.arange(len(power))
    left, middle, right = (
        np.log(power[rows, (place + step) % POINTS] + 1e-300) for step in (-1, 0, 1)
    )
    bend = left - 2 * middle + right
    shift = np.where(bend < 0, 0.5 * (left - right) / np.where(bend < 0, bend, 1), 0)
    found = (place + np.clip(shift, -0.5, 0.5)) / (POINTS * interval_s)
    return (found + 0.5 / interval_s) % (1 / interval_s) - 0.5 / interval_s


def body_speed_mps(signals: np.ndarray, frequency_hz: float, interval_s: float) -> np.ndarray:
    """Return the radial speed (B,) m/s of the strongest line, positive receding, folded.

    frequency_hz: f_k of the station.
    """
    return -body_line_hz(signals, interval_s) * SPEED_OF_LIGHT / (2 * frequency_hz)


def _distance_hz(first: np.ndarray, second: np.ndarray, interval_s: float) -> np.ndarray:
    """Distance of folded frequencies (Hz), the shorter way round, and its sign."""
    return (first - second + 0.5 / interval_s) % (1 / interval_s) - 0.5 / interval_s


def bandwidth_hz(signals: np.ndarray, share: float, interval_s: float) -> np.ndarray:
    """Return the width (B,) Hz of the band around the body line that holds `share` (0..1) of the
    power.
    """
    frequency, power = power_spectrum(signals, interval_s)
    away = np.abs(_distance_hz(frequency, body_line_hz(signals, interval_s)[:, None], interval_s))
    order = np.argsort(away, axis=-1, kind="stable")
    reached = np.cumsum(np.take_along_axis(power, order, -1), axis=-1)
    first = (reached >= share * reached[:, -1:]).argmax(-1)
    return 2 * np.take_along_axis(away, np.take_along_axis(order, first[:, None], -1), -1)[:, 0]


def line_spacing_hz(
    signals: np.ndarray, interval_s: float, least_hz: float = 4.0
) -> tuple[np.ndarray, np.ndarray]:
    """Return the spacing (B,) Hz at which the spectrum repeats itself, and how well (B,), 1 for a
    comb of equal lines.

    A peak of the circular autocorrelation of the amplitude spectrum's deviations from its mean,
    beyond least_hz: the one at the shortest lag among those of at least half the highest, since a
    comb also resembles itself at multiples of its spacing. Equal blades or wings give lines N times
    their rate apart. A spacing of more than half the symbol rate folds.
    """
    _, power = power_spectrum(signals, interval_s)
    amplitude = np.sqrt(power)
    change = np.fft.fft(amplitude - amplitude.mean(-1, keepdims=True), axis=-1)
    likeness = np.fft.ifft(np.abs(change) ** 2, axis=-1).real
    likeness = likeness / np.where(likeness[:, :1] > 0, likeness[:, :1], 1)
    step_hz = 1 / (POINTS * interval_s)
    lag, height = _first_peak(likeness[:, : POINTS // 2 + 2], int(np.ceil(least_hz / step_hz)), 0.5)
    return lag * step_hz, height


def _first_peak(likeness: np.ndarray, first: int, share: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the shortest lag (B,) from `first` on with a peak of at least `share` of the highest,
    and its height.
    """
    inner = likeness[:, first:-1]
    peak = (inner >= likeness[:, first - 1 : -2]) & (inner >= likeness[:, first + 1 :])
    highest = np.where(peak, inner, -1).max(-1, keepdims=True)
    lag = first + (peak & (inner >= highest - (1 - share) * np.abs(highest))).argmax(-1)
    return lag, likeness[np.arange(len(lag)), lag]


def repetition_hz(
    signals: np.ndarray, interval_s: float, most_s: float = 0.5
) -> tuple[np.ndarray, np.ndarray]:
    """Return the rate (B,) Hz at which the envelope repeats itself, and its periodicity (B,), the
    autocorrelation.

    N equal blades that turn at F repeat at N F, wings that beat at F at F; above half the symbol
    rate the rate folds. The shortest lag counts whose autocorrelation is a peak of at least 0.7 of
    the highest, up to most_s.
    """
    power = np.abs(signals) ** 2
    change = power - power.mean(-1, keepdims=True)
    symbols = signals.shape[-1]
    spectrum = np.abs(np.fft.fft(change, 2 * symbols, axis=-1)) ** 2
    likeness = np.fft.ifft(spectrum, axis=-1).real[
        :, : min(int(most_s / interval_s), symbols // 2) + 2
    ]
    # The sums of later lags have fewer terms.
    likeness = likeness / (symbols - np.arange(likeness.shape[-1]))
    likeness = likeness / np.where(likeness[:, :1] > 0, likeness[:, :1], 1)
    lag, height = _first_peak(likeness, 2, 0.7)
    return 1 / (lag * interval_s), height


def body_drift_hz(signals: np.ndarray, interval_s: float) -> np.ndarray:
    """Return how far the body line moves (B,) Hz from the first half of the look to the second;
    never negative.
    """
    half = signals.shape[-1] // 2
    early, late = (
        body_line_hz(part, interval_s) for part in (signals[:, :half], signals[:, half:])
    )
    return np.abs(_distance_hz(late, early, interval_s))


def band_shares(signals: np.ndarray, interval_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the shares (B, 6) of the power at each distance from the body line, and the asymmetry
    (B,).

    The bands end at OCTAVES_HZ; the rest of the power lies beyond. Asymmetry: power above the body
    line less power below it, beyond the first band, as a share of both; never negative, since a
    target turned by 180 degrees swaps them.
    """
    frequency, power = power_spectrum(signals, interval_s)
    away = _distance_hz(frequency, body_line_hz(signals, interval_s)[:, None], interval_s)
    within = np.stack([(power * (np.abs(away) < limit)).sum(-1) for limit in OCTAVES_HZ], axis=-1)
    outside = np.abs(away) >= OCTAVES_HZ[0]
    above = (power * outside * (away > 0)).sum(-1)
    below = (power * outside * (away < 0)).sum(-1)
    return np.diff(within, prepend=0, axis=-1), np.abs(above - below) / np.maximum(
        above + below, 1e-12
    )


def features(signals: np.ndarray, frequency_hz: float, interval_s: float) -> np.ndarray:
    """Return the features NAMES of signals (B, N) complex of one station, (B, len(NAMES)) float32.

    frequency_hz: f_k of the station; interval_s: T_r. The size of the signal changes nothing.
    Speeds are absolute, since a target turned by 180 degrees has the opposite ones.
    """
    signals = np.asarray(signals, dtype=np.complex128)
    rms = np.sqrt(np.mean(np.abs(signals) ** 2, axis=-1, keepdims=True))
    signals = signals / np.where(rms > 0, rms, 1)
    _, power = power_spectrum(signals, interval_s)
    envelope = np.abs(signals)
    deviation = envelope - envelope.mean(-1, keepdims=True)
    variance = np.maximum((deviation**2).mean(-1), 1e-12)
    shares, asymmetry = band_shares(signals, interval_s)
    columns = [
        np.abs(body_speed_mps(signals, frequency_hz, interval_s)),
        power.max(-1) * POINTS / signals.shape[-1],
        body_drift_hz(signals, interval_s),
        bandwidth_hz(signals, 0.5, interval_s),
        bandwidth_hz(signals, 0.9, interval_s),
        *line_spacing_hz(signals, interval_s),
        *repetition_hz(signals, interval_s),
        np.sqrt(variance) / np.maximum(envelope.mean(-1), 1e-12),
        (deviation**4).mean(-1) / variance**2,
        np.exp(np.log(power + 1e-12).mean(-1)) * POINTS,
        *shares.T,
        asymmetry,
    ]
    return np.stack(columns, axis=-1).astype(np.float32)
