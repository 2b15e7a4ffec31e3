"""Blade length and number of made rotors, read back from folded signals; null space pursuit parts what it should."""

import numpy as np
import pytest

from lowalt.common.streams import stream
from lowalt.measure import rotor_made
from lowalt.recognition import null_space_pursuit, rotor_blades
from lowalt.recognition.rotor import Passing, folded, passing, without_body, without_pursued_body
from test_recognition_features import INTERVAL_S, SYMBOLS, TIMES, body, noisy
from test_recognition_features import rotor as blades_of


def test_the_comb_of_a_single_point_has_bessel_s_amplitudes():
    from scipy.special import jv

    rest = np.exp(1j * 6.0 * np.cos(2 * np.pi * 47.3 * TIMES))
    lines = rotor_blades.comb(rest, 47.3, INTERVAL_S, 9)
    np.testing.assert_allclose(np.abs(lines), np.abs(jv(np.arange(-9, 10), 6.0)), atol=2e-3)


def test_folded_lines_that_meet_are_counted_as_not_resolved():
    # Lines 4 and -4 of a comb of 50 Hz fold onto each other at 400 symbols a second; 2 and -2 do not.
    assert rotor_blades.resolved_lines(50.0, SYMBOLS, INTERVAL_S) == 3
    assert rotor_blades.resolved_lines(200.0, SYMBOLS, INTERVAL_S) == 0


@pytest.mark.parametrize(("blades", "lines", "rate"), [(2, 6.4, 88.3), (3, 5.5, 57.7), (5, 4.6, 61.9)])
def test_length_over_blades_and_parity_of_one_rotor_are_read_back(blades, lines, rate, monkeypatch):
    rng = stream(3, "rotors", blades)
    looks = rotor_made.made(rng, blades, lines * blades, rate, rotors=1)
    rests = np.array([without_body(look, INTERVAL_S) for look in looks])
    found = Passing(float(folded(blades * rate, INTERVAL_S)), 50.0)
    told = rotor_blades.blades(rests, found, INTERVAL_S, np.full(3, 4 * np.pi), np.ones(3))
    assert told.length_over_count_m == pytest.approx(lines, rel=0.12)
    assert told.bounds_m[0] < lines < told.bounds_m[1]
    assert told.odd == (blades % 2 == 1) and abs(told.contrast) > 0.8
    # Seen under half the sine, the same comb is that of a blade twice as long.
    half = rotor_blades.blades(rests, found, INTERVAL_S, np.full(3, 4 * np.pi), np.full(3, 0.5))
    assert half.length_over_count_m == pytest.approx(2 * told.length_over_count_m)
    # A comb that hardly stands out, or that holds too little of the rest, tells nothing.
    weak = rotor_blades.blades(rests, found._replace(level=4.9), INTERVAL_S, np.full(3, 4 * np.pi), np.ones(3))
    monkeypatch.setattr(rotor_blades, "HELD", 1.1)
    little = rotor_blades.blades(rests, found, INTERVAL_S, np.full(3, 4 * np.pi), np.ones(3))
    assert weak.length_over_count_m is None and little.length_over_count_m is None


def test_the_share_that_a_comb_holds_is_that_of_its_lines_up_to_the_edge():
    rest = np.exp(1j * 6.0 * np.cos(2 * np.pi * 47.3 * TIMES)) + np.exp(2j * np.pi * 70.9 * TIMES)
    found = rotor_blades.comb(rest, 47.3, INTERVAL_S, 9)
    assert rotor_blades.held_share(rest[None], [found], [9]) == pytest.approx(0.5, abs=0.03)
    assert rotor_blades.held_share(rest[None], [found], [3]) < 0.3


def test_nothing_is_told_of_noise_or_of_lines_that_meet():
    rests = np.array([noisy(np.zeros(SYMBOLS) + 1e-9, -60, seed) for seed in range(3)])
    for hertz, level in ((97.3, 50.0), (97.3, 2.0), (100.0, 50.0)):
        told = rotor_blades.blades(rests, Passing(hertz, level), INTERVAL_S, np.full(3, 0.06), np.ones(3))
        assert told.length_over_count_m is None and told.odd is None


def test_second_differences_and_the_operator_s_bands_are_those_of_their_matrices():
    difference = np.diff(np.eye(9), 2, axis=0)
    bands = null_space_pursuit.second_difference_bands(9)
    for step in range(3):
        np.testing.assert_array_equal(bands[step, : 9 - step], np.diagonal(difference.T @ difference, -step))
    course = np.exp(1j * np.linspace(0, 2, 8)) * 0.9
    operator = np.eye(9, dtype=complex)[1:] - course[:, None] * np.eye(9)[:-1]
    values = np.exp(1j * np.arange(9.0) ** 2)
    expected = operator.conj().T @ operator @ values + 0.3 * values
    np.testing.assert_allclose(null_space_pursuit._applied(course, values) + 0.3 * values, expected, atol=1e-12)
    np.testing.assert_allclose(null_space_pursuit._solver(course, 0.3)(expected), values, atol=1e-12)


def test_pursuit_parts_a_body_that_changes_amplitude_and_speed_from_a_rotor():
    course = np.exp(2j * np.pi * (37 * TIMES + 9 * TIMES**2)) * (1 + 0.3 * np.cos(2 * np.pi * 1.3 * TIMES))
    turning = 0.2 * np.exp(2j * np.pi * 127 * TIMES)
    found = null_space_pursuit.pursue(course + turning, 38.0, INTERVAL_S)
    assert np.linalg.norm(found.component - course) < 0.1 * np.linalg.norm(course)
    assert np.linalg.norm(found.rest - turning) < 0.5 * np.linalg.norm(turning)
    assert found.rounds < 30 and found.leakage > 0
    looks = [noisy(body(speed) * (1 + np.exp(1j) * blades_of(88.0, 2, 5.0)), 18) for speed in (-3.0, 1.0, 4.5)]
    assert passing(np.array(looks), INTERVAL_S, without_pursued_body).hertz == pytest.approx(176, abs=0.3)


def test_the_table_of_made_rotors_has_the_truth_in_its_rows(tmp_path, monkeypatch):
    monkeypatch.setattr(rotor_made, "KINDS", ((1, 3, 6),))
    rotor_made.main(["--draws", "2", "--out", str(tmp_path / "made.csv")])
    header, row = ((tmp_path / "made.csv").read_text().splitlines())[:2]
    assert header.split(",") == list(rotor_made.COLUMNS)
    assert row.split(",")[:4] == ["1", "3", "6", "2"]
