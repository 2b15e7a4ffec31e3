"""Physical features read the truth of made signals back: body speed, bandwidth, line spacing, repetition, drift."""

from itertools import pairwise

import numpy as np
import pytest

from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.common.streams import stream
from lowalt.recognition import features

FREQUENCY_HZ, INTERVAL_S, SYMBOLS = 4.9e9, 2.5e-3, 400
TIMES = np.arange(SYMBOLS) * INTERVAL_S


def body(speed_mps):
    return np.exp(-4j * np.pi * FREQUENCY_HZ / SPEED_OF_LIGHT * speed_mps * TIMES)


def rotor(rate_hz, blades=2, reach=12.0, strength=0.4):
    """Blade tips on a circle of `reach` radians of phase."""
    angles = 2 * np.pi * (rate_hz * TIMES[:, None] + np.arange(blades) / blades)
    return strength * np.exp(1j * reach * np.sin(angles)).sum(-1) / blades


def noisy(signal, snr_db, seed=1):
    rng = stream(seed, "noise")
    noise = rng.standard_normal((*signal.shape, 2)) @ [1, 1j] / np.sqrt(2)
    return signal + noise * np.sqrt(np.mean(abs(signal) ** 2) * 10 ** (-snr_db / 10))


@pytest.mark.parametrize("speed", [-5.3, -0.4, 0.0, 2.25, 6.0])
def test_the_body_s_speed_is_read_back(speed):
    found = features.body_speed_mps(noisy(body(speed), 13)[None], FREQUENCY_HZ, INTERVAL_S)
    assert found[0] == pytest.approx(speed, abs=0.01)


def test_a_speed_beyond_the_unambiguous_range_folds():
    most = SPEED_OF_LIGHT / (2 * FREQUENCY_HZ * INTERVAL_S)
    found = features.body_speed_mps(body(7.0)[None], FREQUENCY_HZ, INTERVAL_S)
    assert found[0] == pytest.approx(7.0 - most, abs=0.01)


@pytest.mark.parametrize(("rate", "blades", "reach"), [(11.0, 2, 6.0), (17.0, 2, 6.0), (80 / 9, 3, 4.0)])
def test_line_spacing_and_repetition_are_blades_times_rotation_rate(rate, blades, reach):
    # A phase between body and rotor: in phase, three blades would look the same after a sixth of a turn.
    signal = noisy(body(1.2) * (1 + np.exp(1j) * rotor(rate, blades, reach, 1.0)), 18)[None]
    spacing, strength = features.line_spacing_hz(signal, INTERVAL_S)
    repeated, periodicity = features.repetition_hz(signal, INTERVAL_S)
    assert spacing[0] == pytest.approx(blades * rate, abs=0.5)
    # A lag is a whole number of symbols.
    assert 1 / repeated[0] == pytest.approx(1 / (blades * rate), abs=INTERVAL_S)
    assert strength[0] > 0.3 and periodicity[0] > 0.6
    still = noisy(body(1.2), 18)[None]
    assert features.repetition_hz(still, INTERVAL_S)[1][0] < 0.3


def test_a_spacing_beyond_half_the_symbol_rate_folds():
    signal = (body(0.5) * (1 + rotor(115.0, 2, 3.0)))[None]
    assert features.line_spacing_hz(signal, INTERVAL_S)[0][0] == pytest.approx(400 - 230, abs=0.5)


def test_lines_half_the_symbol_rate_apart_are_told_so():
    """The longest lag of the circular autocorrelation is half of its points; it also counts as a peak."""
    signal = (body(0.5) * (1 + 0.8 * np.exp(2j * np.pi * 200 * TIMES)))[None]
    spacing, strength = features.line_spacing_hz(signal, INTERVAL_S)
    assert spacing[0] == 200 and strength[0] > 0.9


def test_bandwidth_is_that_of_the_lines_that_hold_the_power():
    frequencies = {40.0: 0.2, -40.0: 0.2, 0.0: 1.0}
    signal = body(1.0) * sum(np.sqrt(p) * np.exp(2j * np.pi * f * TIMES) for f, p in frequencies.items())
    # The body holds 1 / 1.4 = 71 % of the power, all three lines 100 %.
    assert features.bandwidth_hz(signal[None], 0.5, INTERVAL_S)[0] < 5
    assert features.bandwidth_hz(signal[None], 0.9, INTERVAL_S)[0] == pytest.approx(80, abs=4)
    shares, asymmetry = features.band_shares(signal[None], INTERVAL_S)
    assert shares[0, 0] == pytest.approx(1 / 1.4, abs=0.02) and shares[0, 4] == pytest.approx(0.4 / 1.4, abs=0.02)
    assert asymmetry[0] < 0.01
    lopsided = body(1.0) * (1 + 0.5 * np.exp(2j * np.pi * 40 * TIMES))
    assert features.band_shares(lopsided[None], INTERVAL_S)[1][0] > 0.95


def test_drift_is_the_acceleration_times_half_the_look():
    # Speed rises by 2 m/s over the look, the mean of its halves by 1 m/s.
    course = np.cumsum(2.0 * TIMES / TIMES[-1]) * INTERVAL_S
    signal = np.exp(-4j * np.pi * FREQUENCY_HZ / SPEED_OF_LIGHT * course)
    wanted = 2 * FREQUENCY_HZ / SPEED_OF_LIGHT
    assert features.body_drift_hz(signal[None], INTERVAL_S)[0] == pytest.approx(wanted, rel=0.35)
    assert features.body_drift_hz(body(2.0)[None], INTERVAL_S)[0] < 0.1


def test_features_ignore_size_phase_and_a_turn_by_180_degrees_and_tell_signals_apart():
    signal = noisy(body(1.2) * (1 + rotor(30.0, strength=1.5)), 18)[None]
    found = features.features(signal, FREQUENCY_HZ, INTERVAL_S)
    assert found.shape == (1, len(features.NAMES)) and np.isfinite(found).all()
    for same in (signal * 7e-6 * np.exp(2j), signal.conj()):
        np.testing.assert_allclose(features.features(same, FREQUENCY_HZ, INTERVAL_S), found, rtol=1e-3, atol=1e-4)
    other = features.features(noisy(body(4.0), 18)[None], FREQUENCY_HZ, INTERVAL_S)
    assert other[0, features.NAMES.index("body_share")] > 1.5 * found[0, features.NAMES.index("body_share")]
    assert np.isfinite(features.features(np.zeros((1, 400)), FREQUENCY_HZ, INTERVAL_S)).all()


def slow_spectrum(signal):
    """Power in 1024 bins by the sum itself, the window being sin^2 over the look; of sum one."""
    steps = np.arange(len(signal))
    waves = np.exp(-2j * np.pi * np.outer(np.arange(1024), steps) / 1024)
    power = abs(waves @ (signal * np.sin(np.pi * (steps + 1) / (len(signal) + 1)) ** 2)) ** 2
    return power / power.sum()


def fold(hertz):
    while hertz >= 200:
        hertz -= 400
    while hertz < -200:
        hertz += 400
    return hertz


def slow_line(signal):
    """The top of the parabola through the logarithms of the largest bin and its neighbours."""
    power = slow_spectrum(signal)
    top = int(power.argmax())
    curve = np.polyfit([-1, 0, 1], np.log([power[top - 1], power[top], power[(top + 1) % 1024]]), 2)
    return fold((top - curve[1] / (2 * curve[0])) * 400 / 1024)


def slow_peak(likeness, first, last, share):
    """The first of all peaks that come within 1 - share of the highest one's height, and its height."""
    peaks = [lag for lag in range(first, last) if likeness[lag] >= max(likeness[lag - 1], likeness[lag + 1])]
    highest = max(likeness[lag] for lag in peaks)
    lag = next(lag for lag in peaks if likeness[lag] >= highest - (1 - share) * abs(highest))
    return lag, likeness[lag]


def slow_features(signal):
    """Every feature of one signal by its definition in words, one number after the other."""
    count, signal = len(signal), signal / np.sqrt(np.mean(abs(signal) ** 2))
    power, line = slow_spectrum(signal), slow_line(signal)
    away = np.array([fold(fold(400 * place / 1024) - line) for place in range(1024)])
    widths = []
    for share in (0.5, 0.9):
        held, order = 0.0, sorted(range(1024), key=lambda place: abs(away[place]))
        while held < share:
            place = order.pop(0)
            held += power[place]
        widths.append(2 * abs(away[place]))
    change = np.sqrt(power) - np.sqrt(power).mean()
    alike = np.array([change @ np.roll(change, lag) for lag in range(514)])
    spacing, strength = slow_peak(alike / alike[0], 11, 513, 0.5)
    change = abs(signal) ** 2 - 1
    alike = np.array([np.mean(change[lag:] * change[: count - lag]) for lag in range(min(200, count // 2) + 2)])
    repeated, periodicity = slow_peak(alike / alike[0], 2, len(alike) - 1, 0.7)
    drift = fold(slow_line(signal[count // 2 :]) - slow_line(signal[: count // 2]))
    limits = (0.0, 3.0, 6.0, 12.0, 25.0, 50.0, 100.0)
    bands = [power[(abs(away) >= low) & (abs(away) < high)].sum() for low, high in pairwise(limits)]
    above, below = power[away >= 3].sum(), power[away <= -3].sum()
    envelope = abs(signal)
    deviation = envelope - envelope.mean()
    variance = np.mean(deviation**2)
    return [
        abs(line) * 299792458 / (2 * FREQUENCY_HZ), power.max() * 1024 / count, abs(drift), *widths,
        spacing * 400 / 1024, strength, 400 / repeated, periodicity, np.sqrt(variance) / envelope.mean(),
        np.mean(deviation**4) / variance**2, np.exp(np.mean(np.log(power + 1e-12))) * 1024, *bands,
        abs(above - below) / (above + below),
    ]  # fmt: skip


@pytest.mark.parametrize("symbols", [300, 1000])
def test_every_feature_is_that_of_its_definition(symbols):
    """Half a look of 300 symbols is shorter than the longest lag of half a second; that of 1000 is longer.

    Lines 3.6 Hz apart are taken for lines 7.2 Hz apart, since the least spacing is 4 Hz; lines 4.5 Hz apart are not.
    """
    times = np.arange(symbols) * INTERVAL_S
    looks = []
    for seed, (speed, rate, reach) in enumerate(((-5.5, 11, 6), (1.2, 17, 3), (3.0, 1.8, 9), (6.1, 2.25, 9))):
        turning = np.exp(1j * reach * np.sin(2 * np.pi * (rate * times[:, None] + np.arange(2) / 2))).sum(-1)
        course = np.exp(-4j * np.pi * FREQUENCY_HZ / SPEED_OF_LIGHT * (speed * times + 0.3 * times**2))
        looks.append(noisy(course * (1 + np.exp(1j) * turning), 15, seed))
    found = features.features(1e-5 * np.array(looks), FREQUENCY_HZ, INTERVAL_S)
    assert found.dtype == np.float32 and features.NAMES[5:9] == (
        "line_spacing_hz", "line_strength", "repetition_hz", "periodicity")  # fmt: skip
    np.testing.assert_allclose(found, [slow_features(look) for look in looks], rtol=2e-5, atol=1e-6)


def test_the_first_peak_is_high_enough_also_where_all_peaks_are_negative_and_the_first_lag_where_there_is_none():
    """From lag 2 on; peaks of at least half the highest, or at most half as much below zero again."""
    rows = np.array([
        [1, 0.9, -0.5, -0.7, -0.3, -0.4, -0.2, -0.6, -0.9],  # Peaks of -0.3 and -0.2.
        [1, 0.1, 0.2, 0.1, 0.39, 0.3, 0.4, 0.3, 0.9],  # Peaks of 0.2, 0.39 and 0.4; the last lag has no neighbour.
        [1, 0.1, 0.19, 0.1, 0.39, 0.3, 0.4, 0.3, 0.9],
        [1, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2],
    ])  # fmt: skip
    lags, heights = features._first_peak(rows, 2, 0.5)
    assert lags.tolist() == [4, 2, 4, 2] and heights.tolist() == [-0.3, 0.2, 0.39, 0.8]


def test_a_look_without_envelope_has_small_finite_features():
    """Of a line alone the envelope is constant: its variation is the square root of the floor of 1e-12."""
    found = dict(zip(features.NAMES, features.features(body(1.0)[None], FREQUENCY_HZ, INTERVAL_S)[0], strict=True))
    assert found["envelope_variation"] == pytest.approx(1e-6, rel=1e-3) and found["envelope_kurtosis"] < 1e-6
    silent = dict(zip(features.NAMES, features.features(np.zeros((1, 400)), FREQUENCY_HZ, INTERVAL_S)[0], strict=True))
    assert silent["asymmetry"] == silent["body_share"] == silent["periodicity"] == 0
    assert silent["flatness"] == pytest.approx(1024e-12, rel=1e-3) and silent["envelope_variation"] == 1e6
