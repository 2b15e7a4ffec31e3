"""Which windows hold a target: the floor is that of the recording's own noise, and a line must stand above it."""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.recordings.presence import ENOUGH, noise_floor, present
from lowalt.recordings.twin import Twin

LOOKING = Twin(24.0e9, "real", 6000.0, 1 / 3000.0, 400, "one_sided", 0.4, 15.0)


def test_the_floor_is_the_mean_of_the_noise_whatever_its_colour_and_number():
    rng = np.random.default_rng(0)
    colour = np.linspace(1.0, 100.0, 4000)
    for count in (1, 3, 40):
        floor = noise_floor(colour * rng.exponential(size=(count, 4000)), 0.005)
        # A running median of single exponential powers is ln 2 of their mean; of many windows the largest of three
        # neighbours counts, which lies higher.
        wanted = {1: np.log(2), 3: np.log(2), 40: 1.46}[count]
        assert np.mean(floor[300:-300] / colour[300:-300]) == pytest.approx(wanted, rel=0.05)


def test_the_floor_follows_a_hill_and_not_a_line():
    power = np.ones((1, 1000))
    # The median reaches 0.5 m/s to either side: a hill of 0.6 m/s is floor, a line of 0.4 m/s is none.
    power[:, 200:260] = 5.0
    power[:, 600:640] = 7.0
    np.testing.assert_array_equal(noise_floor(power, 0.01), np.where(power[0] == 5.0, 5.0, 1.0))


def test_coloured_noise_and_a_line_that_stays_are_no_target():
    rng, time = np.random.default_rng(0), np.arange(400)
    intervals = rng.standard_normal((40, 400)) + 1j * rng.standard_normal((40, 400))
    coloured = np.fft.ifft(np.fft.fft(intervals) * np.where(np.arange(400) < 60, 20.0, 1.0))
    assert not present(coloured, LOOKING).any()
    stays = coloured + 3 * np.exp(2j * np.pi * 0.5 * time)
    assert not present(stays, LOOKING).any()
    assert present(stays[: ENOUGH - 1], LOOKING).all()
    stays[5:9] += 3 * np.exp(2j * np.pi * 0.7 * time)
    assert present(stays, LOOKING).nonzero()[0].tolist() == [5, 6, 7, 8]
    # Where the noise is known, a recording of one window is enough.
    assert not present(coloured[:1], LOOKING, coloured[1:2]).any()
    assert present(stays[5:6], LOOKING, coloured[1:2]).all()


def test_a_drift_slower_than_any_target_is_none_and_a_radar_without_a_threshold_takes_every_window():
    rng = np.random.default_rng(0)
    intervals = rng.standard_normal((40, 400)) + 1j * rng.standard_normal((40, 400))
    intervals[10:20] += 10 * np.exp(0.02j * np.pi * np.arange(400))
    assert present(intervals, LOOKING).nonzero()[0].tolist() == []
    assert present(intervals, replace(LOOKING, slowest_mps=0.1)).nonzero()[0].tolist() == list(range(10, 20))
    assert present(intervals, replace(LOOKING, detect_db=0.0)).all()
