"""The blade passing frequency of made signals is read back, folded where it folds; the body leaves nothing behind."""

import numpy as np
import pytest

from lowalt.recognition import rotor
from test_recognition_features import INTERVAL_S, TIMES, body, noisy
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
