"""Null space pursuit against the same rounds with whole matrices, and its weight of smoothness by what it does."""

import numpy as np
import pytest

from lowalt.common.streams import stream
from lowalt.recognition import null_space_pursuit
from test_recognition_features import INTERVAL_S

SYMBOLS = 90
TIMES = np.arange(SYMBOLS) * INTERVAL_S


def signal():
    """A body that accelerates and swells, a rotor's line, and noise."""
    body = np.exp(2j * np.pi * (37 * TIMES + 30 * TIMES**2)) * (1 + 0.4 * np.cos(2 * np.pi * 2.3 * TIMES))
    noise = stream(4, "noise").standard_normal((SYMBOLS, 2)) @ [1, 1j]
    return body + 0.3 * np.exp(2j * np.pi * 127 * TIMES) + 0.05 * noise


def slow_course(component):
    """The p that minimises sum |u[n+1] - p[n] u[n]|^2 over the mean power, its second differences weighed."""
    power = abs(component[:-1]) ** 2
    difference = np.diff(np.eye(len(power)), 2, axis=0)
    weight = (len(power) / (2 * np.pi * 6.4)) ** 4
    matrix = np.diag(power / power.mean() + 1e-9) + weight * difference.T @ difference
    return np.linalg.solve(matrix, component[1:] * component[:-1].conj() / power.mean())


def slow_pursuit(given, start_hz, rounds, least):
    """Rounds of operator, component, weight and leakage; the operator is written out as a matrix."""
    course, leakage = np.full(SYMBOLS - 1, np.exp(2j * np.pi * start_hz * INTERVAL_S)), 1.0
    weight, rest = (4 * np.pi / SYMBOLS) ** 2, np.zeros(SYMBOLS)
    for taken in range(1, rounds + 1):
        operator = np.eye(SYMBOLS)[1:] - course[:, None] * np.eye(SYMBOLS)[:-1]
        square = operator.conj().T @ operator
        once = np.linalg.solve(square + (1 + leakage) * weight * np.eye(SYMBOLS), given)
        weight = np.vdot(given, once).real / np.vdot(once, once).real / (1 + leakage)
        matrix = square + (1 + leakage) * weight * np.eye(SYMBOLS)
        before, rest = rest, np.linalg.solve(matrix, square @ given + weight * leakage * given)
        part = given - rest
        leakage = max(np.vdot(part, given).real / np.vdot(part, part).real - 1, 0)
        if taken == rounds or np.linalg.norm(rest - before) < least * np.linalg.norm(given):
            return (1 + leakage) * part, course, leakage, weight, taken
        course = slow_course(part)
    return None


@pytest.mark.parametrize("options", [{"rounds": 1}, {"rounds": 2}, {"least": 0.05}, {}])
def test_pursuit_is_that_of_whole_matrices(options):
    given = signal()
    found = null_space_pursuit.pursue(1e-7 * given, 38.0, INTERVAL_S, **options)
    component, course, leakage, weight, taken = slow_pursuit(given, 38.0, **{"rounds": 30, "least": 0.01, **options})
    np.testing.assert_allclose(1e7 * found.component, component, atol=1e-7)
    np.testing.assert_allclose(1e7 * found.rest, given - component, atol=1e-7)
    np.testing.assert_allclose(found.course, course, atol=1e-7)
    assert (found.leakage, found.weight) == (pytest.approx(leakage, rel=1e-6), pytest.approx(weight, rel=1e-6))
    assert found.rounds == taken == options.get("rounds", taken)


def test_pursuit_takes_thirty_rounds_at_most():
    assert null_space_pursuit.pursue(signal(), 38.0, INTERVAL_S, least=0.0).rounds == 30


def test_the_weight_of_smoothness_halves_a_wave_of_six_and_two_fifths_cycles():
    """Of 6000 values, second differences of the wave are its own values times (2 pi 6.4 / 6000)^2."""
    wave = np.cos(2 * np.pi * 6.4 * np.arange(6000) / 6000)
    against = null_space_pursuit.smoothing(6000) * np.diff(np.diff(wave, 2), 2)
    np.testing.assert_allclose(against, wave[2:-2], atol=1e-4)
