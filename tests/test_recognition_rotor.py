"""The blade passing frequency of made signals is read back, folded where it folds; the body leaves nothing behind."""

import numpy as np
import pytest

from lowalt.recognition import rotor
from lowalt.recognition.features import body_line_hz
from lowalt.recognition.null_space_pursuit import pursue
from test_recognition_features import INTERVAL_S, SYMBOLS, TIMES, body, noisy
from test_recognition_features import rotor as blades_of


@pytest.mark.parametrize(("rate", "blades"), [(31.0, 2), (88.0, 2), (130.0, 2), (47.0, 3), (57.0, 5)])
def test_the_passing_frequency_is_blades_times_rate_folded(rate, blades):
    looks = [noisy(body(speed) * (1 + np.exp(1j) * blades_of(rate, blades, 5.0)), 18) for speed in (-3.0, 1.0, 4.5)]
    found = rotor.passing(np.array(looks), INTERVAL_S)
    assert found.hertz == pytest.approx(rotor.folded(blades * rate, INTERVAL_S), abs=0.3)
    still = rotor.passing(np.array([noisy(body(1.0), 18)] * 3), INTERVAL_S)
    assert found.level > 2 * still.level


def test_an_accelerating_body_is_annihilated_and_the_rotor_kept():
    course = np.exp(1j * (2 * np.pi * 37 * TIMES + 60 * TIMES**2))
    # The ends of the look bend a little; the rotor has 4 % of the body's power.
    assert np.mean(abs(rotor.without_body(course, INTERVAL_S)) ** 2) < 1e-3
    turning = 0.2 * np.exp(2j * np.pi * 90 * TIMES)
    rest = rotor.without_body(course * (1 + turning), INTERVAL_S)
    assert np.mean(abs(rest) ** 2) == pytest.approx(0.04, rel=0.1)


def test_frequencies_fold_at_multiples_of_the_symbol_rate():
    np.testing.assert_allclose(rotor.folded(np.array([150.0, 250.0, 400.0, 560.0]), INTERVAL_S), [150, 150, 0, 160])


def slow_smooth(signal):
    """The r that minimises |y - r|^2 + (N / 40)^4 |D2 r|^2, by the whole matrix."""
    difference = np.diff(np.eye(len(signal)), 2, axis=0)
    return np.linalg.solve(np.eye(len(signal)) + (len(signal) / 40) ** 4 * difference.T @ difference, signal)


def test_the_rest_is_that_of_three_rounds_of_a_smooth_part_and_a_parabola_of_phase():
    times = np.arange(130) * INTERVAL_S
    body_phase = 2 * np.pi * 31 * times + 700 * times**2 + 2 * np.sin(2 * np.pi * 2 * times)
    signal = noisy(np.exp(1j * body_phase) * (1 + 0.8 * np.exp(2j * np.pi * 90 * times)), 5)
    phase = 2 * np.pi * body_line_hz(signal[None], INTERVAL_S)[0] * times
    for _ in range(3):
        smooth = slow_smooth(signal * np.exp(-1j * phase))
        phase = phase + np.polyval(np.polyfit(times, np.unwrap(np.angle(smooth)), 2, w=abs(smooth)), times)
    turned = signal * np.exp(-1j * phase)
    found = rotor.without_body(1e-6 * signal, INTERVAL_S)
    np.testing.assert_allclose(1e6 * found, turned - slow_smooth(turned), atol=1e-9)
    assert not rotor.without_body(np.zeros(130, complex), INTERVAL_S).any()


def test_a_pursued_body_s_phase_is_taken_off_from_symbol_to_symbol():
    times = np.arange(120) * INTERVAL_S
    signal = np.exp(2j * np.pi * (37 * times + 9 * times**2)) + 0.2 * np.exp(2j * np.pi * 127 * times)
    found = pursue(signal, float(body_line_hz(signal[None], INTERVAL_S)[0]), INTERVAL_S)
    phase, wanted = 0.0, [found.rest[0]]
    for step, value in zip(found.course, found.rest[1:], strict=True):
        phase += np.angle(step)
        wanted.append(value * np.exp(-1j * phase))
    np.testing.assert_allclose(rotor.without_pursued_body(signal, INTERVAL_S), wanted, atol=1e-9)


def slow_passing(rests):
    """The searched rate (Hz) whose five lines, two-sided, have the largest weighted sum of log(1 + level)."""
    symbols = rests.shape[1]
    window = np.sin(np.pi * np.arange(1, symbols + 1) / (symbols + 1)) ** 2
    power = abs(np.fft.fft(rests * window, 16384)) ** 2
    medians = np.array([max(np.median(row), 1e-300) for row in power])
    levels = np.exp(np.mean([np.log(np.maximum(row / one, 1e-12)) for row, one in zip(power, medians, strict=True)], 0))
    weights = np.array([1 / np.sqrt(line) for line in range(1, 6)])
    best, step, look_s = (-1.0, 0.0), 0, symbols * INTERVAL_S
    while (rate := (8 + 0.05 * step) / look_s) < 0.5 / INTERVAL_S:
        places = [round(rate * line * INTERVAL_S * 16384) for line in range(1, 6)]
        lines = [(levels[place % 16384] + levels[-place % 16384]) / 2 for place in places]
        best, step = max(best, (weights @ np.log1p(lines) / weights.sum(), rate)), step + 1
    return best[1], np.expm1(best[0])


def test_the_passing_frequency_and_its_level_are_those_of_the_slow_search():
    """410 symbols: twenty points each are more than 8192, nineteen are fewer. Of three rests one is silent."""
    times = np.arange(410) * INTERVAL_S
    combs = sum(np.exp(2j * np.pi * 57.3 * line * times) * 0.8 ** abs(line) for line in (-4, -3, -2, -1, 1, 2, 3, 5))
    rests = np.array([noisy(combs * np.exp(1j), 3), noisy(combs, -3, 2), 1e-200 * noisy(combs, 0, 3)])
    for some in (rests[:2], rests[1:], 1e-9 * rests[:1]):
        found = rotor.passing_of_rests(some, INTERVAL_S)
        hertz, level = slow_passing(some)
        assert found.hertz == pytest.approx(hertz, abs=1e-9) and found.level == pytest.approx(level, rel=1e-9)


def test_the_level_of_a_comb_is_its_power_over_the_noise():
    noise = noisy(np.zeros(SYMBOLS) + 1e-9, -180)
    comb = sum(np.exp(2j * np.pi * 57.3 * line * TIMES) for line in range(-5, 6) if line)
    one, two = (rotor.passing_of_rests((noise + size * comb)[None], INTERVAL_S).level for size in (1.0, 2.0))
    assert two / one == pytest.approx(4, rel=0.1)
