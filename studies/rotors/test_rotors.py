"""Rotors of made signals are read back: passing frequency, length over blades and parity; the body leaves nothing."""

import null_space_pursuit
import numpy as np
import pytest
import rotor
import rotor_blades
from made import INTERVAL_S, SYMBOLS, made
from scipy.special import jv

from lowalt.numerics.streams import stream

TIMES = np.arange(SYMBOLS) * INTERVAL_S


@pytest.mark.parametrize(("blades", "lines", "rate"), [(2, 6.4, 88.3), (3, 5.5, 57.7), (5, 4.6, 61.9)])
def test_passing_frequency_length_and_parity_of_one_rotor_are_read_back(blades, lines, rate):
    looks = made(stream(3, "rotors", blades), blades, lines * blades, rate, rotors=1)
    found = rotor.passing(looks, INTERVAL_S)
    assert found.hertz == pytest.approx(rotor.folded(blades * rate, INTERVAL_S), abs=0.3)
    rests = np.array([rotor.without_body(look, INTERVAL_S) for look in looks])
    told = rotor_blades.blades(rests, found, INTERVAL_S, np.full(3, 4 * np.pi), np.ones(3))
    assert told.length_over_count_m == pytest.approx(lines, rel=0.12)
    assert told.bounds_m[0] < lines < told.bounds_m[1]
    assert told.odd == (blades % 2 == 1)


def test_a_body_is_taken_away_and_the_rotor_kept():
    course = np.exp(1j * (2 * np.pi * 37 * TIMES + 60 * TIMES**2))
    # The ends of the look bend a little; the rotor has 4 % of the body's power.
    assert np.mean(abs(rotor.without_body(course, INTERVAL_S)) ** 2) < 1e-3
    rest = rotor.without_body(course * (1 + 0.2 * np.exp(2j * np.pi * 90 * TIMES)), INTERVAL_S)
    assert np.mean(abs(rest) ** 2) == pytest.approx(0.04, rel=0.1)
    turning = 0.2 * np.exp(2j * np.pi * 127 * TIMES)
    parted = null_space_pursuit.pursue(course + turning, 38.0, INTERVAL_S)
    assert np.linalg.norm(parted.component - course) < 0.1 * np.linalg.norm(course)


def test_the_comb_of_a_single_point_has_bessel_s_amplitudes():
    rest = np.exp(1j * 6.0 * np.cos(2 * np.pi * 47.3 * TIMES))
    lines = rotor_blades.comb(rest, 47.3, INTERVAL_S, 9)
    np.testing.assert_allclose(np.abs(lines), np.abs(jv(np.arange(-9, 10), 6.0)), atol=2e-3)
