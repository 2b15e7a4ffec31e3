"""Which windows hold a target.

The floor is that of the recording's own noise, and a line must stand above it.
"""

from dataclasses import replace

import numpy as np
import pytest

from lowalt.extensions.recordings.presence import (
    ENOUGH,
    beyond_mps,
    floor_between,
    noise_floor,
    present,
    without_hum,
)
from lowalt.extensions.recordings.twin import Twin, radars

LOOKING = Twin(24.0e9, "real", 6000.0, 1 / 3000.0, 400, "one_sided", 0.4, 15.0)
HOVERING = ("uav_3ghz", "bird_drone_10ghz")


def test_the_floor_is_the_mean_of_the_noise_whatever_its_colour_and_number():
    rng = np.random.default_rng(0)
    colour = np.linspace(1.0, 100.0, 4000)
    for count in (1, 3, 40):
        floor = noise_floor(colour * rng.exponential(size=(count, 4000)), 0.005)
        # A running median of single exponential powers is ln 2 of their mean; of many windows the
        # largest of three neighbours counts, which lies higher.
        wanted = {1: np.log(2), 3: np.log(2), 40: 1.46}[count]
        assert np.mean(floor[300:-300] / colour[300:-300]) == pytest.approx(wanted, rel=0.05)


def test_the_floor_follows_a_hill_and_not_a_line():
    power = np.ones((1, 1000))
    # The median reaches 0.5 m/s to either side: a hill of 0.6 m/s is floor, a line of 0.4 m/s is
    # none.
    power[:, 200:260] = 5.0
    power[:, 600:640] = 7.0
    np.testing.assert_array_equal(noise_floor(power, 0.01), np.where(power[0] == 5.0, 5.0, 1.0))


def test_coloured_noise_and_a_line_that_stays_are_no_target():
    rng = np.random.default_rng(0)
    time = np.arange(400)
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


def test_a_line_that_stays_is_taken_out_of_windows_and_a_target_is_not():
    rng = np.random.default_rng(6)
    time = np.arange(400)
    noise = rng.standard_normal((40, 400)) + 1j * rng.standard_normal((40, 400))

    def line(cycles: float) -> np.ndarray:
        """A line of a window by its cycles per symbol, 26 dB above the noise of a cell."""
        return 1.4 * np.exp(2j * np.pi * cycles * time)

    hum = noise + line(0.25)
    passes = hum.copy()
    # 0.025 cycles per symbol are 0.47 m/s, next to what is taken out of windows as too slow.
    for cycles in (0.025, 0.5):
        passes[7:9] += line(cycles)
    cleaned = without_hum(passes, LOOKING)

    def power(intervals: np.ndarray, cycles: float) -> np.ndarray:
        """Power of each window at a speed, over that of the noise."""
        return np.abs(np.fft.fft(intervals, axis=1)[:, round(400 * cycles)]) ** 2 / 800

    assert np.median(power(passes, 0.25)) > 300
    # Below the level around it, by ten decibels where its own level does not vary, and no lower.
    assert 0.05 < np.median(power(cleaned, 0.25)) < 3
    for cycles in (0.025, 0.5):
        np.testing.assert_allclose(
            power(cleaned, cycles)[7:9], power(passes, cycles)[7:9], rtol=0.1
        )
    few = passes[: ENOUGH - 1]
    assert without_hum(few, LOOKING) is few
    assert without_hum(passes, replace(LOOKING, slowest_mps=0.0)) is passes


def test_a_drift_slower_than_any_target_is_none():
    rng = np.random.default_rng(0)
    intervals = rng.standard_normal((40, 400)) + 1j * rng.standard_normal((40, 400))
    intervals[10:20] += 10 * np.exp(0.02j * np.pi * np.arange(400))
    assert present(intervals, LOOKING).nonzero()[0].tolist() == []
    assert present(intervals, replace(LOOKING, slowest_mps=0.1)).nonzero()[0].tolist() == list(
        range(10, 20)
    )


def test_a_weaker_line_counts_where_it_continues_one_that_counts():
    rng = np.random.default_rng(4)
    time = np.arange(400)
    twin = replace(LOOKING, detect_db=20.0)
    noise = rng.standard_normal((40, 400)) + 1j * rng.standard_normal((40, 400))

    def line(amplitude: float, cycles: float) -> np.ndarray:
        """A line of a window by its amplitude and its cycles per symbol."""
        return amplitude * np.exp(2j * np.pi * cycles * time)

    strong = 1.6
    weak = 0.6
    alone = noise.copy()
    alone[20:24] += line(weak, 0.4)
    assert not present(alone, twin).any()
    # 3 m/s^2 change a speed by 0.4 m/s from a window to the next: 0.02 cycles per symbol.
    track = noise.copy()
    for number, (amplitude, cycles) in enumerate(
        [(weak, 0.36), (weak, 0.38), (strong, 0.4), (weak, 0.41), (weak, 0.43)]
    ):
        track[20 + number] += line(amplitude, cycles)
    assert present(track, twin).nonzero()[0].tolist() == [20, 21, 22, 23, 24]
    elsewhere = noise.copy()
    elsewhere[22] += line(strong, 0.4)
    elsewhere[23] += line(weak, 0.6)
    assert present(elsewhere, twin).nonzero()[0].tolist() == [22]


def test_the_floor_between_lines_is_the_mean_of_the_noise_for_a_window_as_for_many():
    rng = np.random.default_rng(1)
    for count in (1, 6):
        power = rng.exponential(2.0, (count, 4000))
        # Lines in two fifths of the band, as a rotor's, leave the noise between them.
        lined = np.where(np.arange(4000) % 10 < 4, 1000.0, power)
        assert floor_between(power).mean() == pytest.approx(2.0, rel=0.05)
        assert floor_between(lined).mean() == pytest.approx(
            2.0 * np.log(1 - 0.25 / 0.6) / np.log(0.75), rel=0.05
        )


@pytest.mark.parametrize("name", HOVERING)
def test_white_noise_is_nothing_and_a_target_that_never_leaves_is_there_in_every_window(name):
    twin = radars()[name]
    rng = np.random.default_rng(2)
    noise = rng.standard_normal((200, 400)) + 1j * rng.standard_normal((200, 400))
    for windows in (noise[:1], noise[1:13], noise):
        assert not present(windows, twin).any()
    # A line of 0.2 of the noise's power: behind 400 symbols it stands 17 dB above the floor.
    line = 0.63 * np.exp(2j * np.pi * 0.31 * np.arange(400))
    for windows in (noise[:1], noise[1:13], noise):
        assert present(windows + line, twin).mean() > 0.95


def test_hum_is_no_target_in_the_windows_of_a_recording_through_which_one_passes():
    twin = radars()["bird_drone_10ghz"]
    rng = np.random.default_rng(3)
    time = np.arange(400)
    noise = rng.standard_normal((40, 400)) + 1j * rng.standard_normal((40, 400))
    hum = noise + np.exp(2j * np.pi * 0.05 * time)
    passes = hum.copy()
    passes[7:9] += 3 * np.exp(2j * np.pi * 0.3 * time)
    assert present(passes, twin).nonzero()[0].tolist() == [7, 8]
    # Nothing tells a line that stays in all windows from a target that hovers.
    assert present(hum, twin).all() and present(passes[: ENOUGH - 1], twin).all()


def test_what_is_heard_while_nothing_is_there_is_no_target_later():
    twin = radars()["bird_drone_10ghz"]
    rng = np.random.default_rng(5)
    time = np.arange(400)
    noise = rng.standard_normal((40, 400)) + 1j * rng.standard_normal((40, 400))
    hum = noise + np.exp(2j * np.pi * 0.05 * time)
    hovers = hum + 1.2 * np.exp(2j * np.pi * 0.3 * time)
    for empty in (hum[:1], hum[:5]):
        assert not present(hum[5:], twin, empty).any()
        assert present(hovers[5:], twin, empty).mean() > 0.95


@pytest.mark.parametrize(
    "name, inside, outside",
    [
        ("cw_24ghz", [0.5, 17.0], [18.5, 40.0]),
        ("bird_drone_10ghz", [0.5, 7.0], [8.0, 30.0]),
        ("uav_3ghz", [2.0, 55.0], [58.0, 100.0]),
    ],
)
def test_a_line_beyond_the_speeds_that_windows_show_is_named_with_its_speed(name, inside, outside):
    twin = radars()[name]
    rate = 24000.0
    time = np.arange(round(3.3 * twin.symbols * twin.symbol_interval_s * rate)) / rate
    noise = 0.01 * np.random.default_rng(4).standard_normal((2, len(time)))
    for speed in (*inside, *outside):
        tone = (
            np.exp(4j * np.pi * speed / 299792458.0 * twin.carrier_hz * time)
            + noise[0]
            + 1j * noise[1]
        )
        found = beyond_mps(tone.real if twin.channel == "real" else tone, rate, twin, 3)
        if speed in outside:
            np.testing.assert_allclose(found, speed, atol=0.3)
        else:
            assert np.isnan(found).all()
    # A rotor's fast lines are no other kind of target: the slow ones are as strong.
    slow = np.exp(4j * np.pi * inside[0] / 299792458.0 * twin.carrier_hz * time)
    assert np.isnan(beyond_mps(slow + 2 * tone, rate, twin, 3)).all()


def test_a_line_beyond_the_band_that_never_moves_is_interference_and_one_that_moves_is_not():
    twin = radars()["cw_24ghz"]
    rate = 48000.0
    length = round(twin.symbols * twin.symbol_interval_s * rate)
    time = np.arange(10 * length) / rate
    noise = 0.01 * np.random.default_rng(6).standard_normal(len(time))
    spur = np.cos(2 * np.pi * (10050.0 * time + 0.05 * np.sin(time)))
    assert np.isnan(beyond_mps(spur + noise, rate, twin, 10)).all()
    # A fast target is named where it stands as far above the spur, and where it changes its speed.
    passes = spur + noise
    passes[3 * length : 4 * length] += 8 * np.cos(2 * np.pi * 7000.0 * time[:length])
    speed = 7000.0 * 299792458.0 / twin.carrier_hz / 2
    found = beyond_mps(passes, rate, twin, 10)
    assert found[3] == pytest.approx(speed, abs=0.3) and np.isnan(np.delete(found, 3)).all()
    slower = np.cos(2 * np.pi * (9000.0 * time - 40.0 * time**2))
    assert np.isfinite(beyond_mps(slower + noise, rate, twin, 10)).all()
