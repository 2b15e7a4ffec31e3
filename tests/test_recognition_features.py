"""Physical features read the truth of made signals back: body speed, bandwidth, line spacing, repetition, drift."""

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
