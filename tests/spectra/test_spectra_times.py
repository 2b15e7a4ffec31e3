"""Spectra at the instants of received symbols: fits by hand and exact lines.

Where sampling is even, they have today's bits.
"""

import numpy as np
import pytest

from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.files.errors import InputError
from lowalt.spectra import Fourier, Spectra, Transfer, spectrum
from lowalt.tiles import Images, Renderer, join
from lowalt.tiles.render import normalised
from pictures import NETWORK, echoes

INTERVAL = 2.5e-3
CARRIER = 4.93192e9
SETTINGS = {
    "vrp": Fourier(16, 1, 16),
    "trp": Fourier(8, 1, 32),
    "vt": Transfer(8, 1, -6.1, 6.1, 0.7),
}


def looks(symbols, seed):
    """Which of the symbols are received, and how late they are in symbol intervals."""
    rng = np.random.default_rng(seed)
    return rng.random(symbols) > 0.4, rng.uniform(0.0, 0.9, symbols)


def known(name, signal, late):
    out = np.empty((spectrum(name).rows(SETTINGS[name]), len(signal) - SETTINGS[name].window))
    times = np.arange(len(signal)) + late
    spectrum(name).fill_known(signal, times, SETTINGS[name], CARRIER, INTERVAL, out)
    return out


def fitted(signal, present, times, turns, first, count):
    """Amplitude of the line of one frequency that fits the received symbols of one window.

    It is found by the normal equations.
    """
    at = [n for n in range(first, first + count) if present[n]]
    if not at:
        return 0.0
    line = np.exp(2j * np.pi * turns * times[at])[:, None]
    return abs(np.linalg.lstsq(line, signal[at], rcond=None)[0][0])


@pytest.mark.parametrize("name", ["vrp", "trp", "vt"])
def test_every_window_holds_the_lines_that_fit_it(name):
    symbols = 24
    setting = SETTINGS[name]
    present, late = looks(symbols, 1)
    present[6:16] = False
    rng = np.random.default_rng(2)
    signal = np.where(present, rng.normal(size=symbols) + 1j * rng.normal(size=symbols), 0)
    found = known(name, signal, late)
    times = np.arange(symbols) + late
    length = setting.window
    for row in range(len(found)):
        for first in range(found.shape[1]):
            if name == "vt":
                speed = -6.1 + 0.7 * row
                turns = -2 * CARRIER * INTERVAL * speed / SPEED_OF_LIGHT
                short, longer = (
                    fitted(signal, present, times, turns, first, count) * length
                    for count in (length, length + 1)
                )
                truth = longer**2 - short**2
            else:
                turns = (row / setting.points + 0.5) % 1 - 0.5
                truth = fitted(signal, present, times, turns, first, length) * length
            assert found[row, first] == pytest.approx(truth, abs=1e-9)


@pytest.mark.parametrize("late_by", [0.0, 0.9])
@pytest.mark.parametrize("name", ["vrp", "trp"])
def test_a_line_is_exact_whatever_is_missing(name, late_by):
    symbols = 400
    setting = SETTINGS[name]
    present, late = looks(symbols, 3)
    turns = 3 / setting.points
    line = 2.5 * np.exp(2j * np.pi * turns * (np.arange(symbols) + late_by * late))
    signal = np.where(present, line, 0)
    found = known(name, signal, late_by * late)
    reached = np.array([present[n : n + setting.window].any() for n in range(found.shape[1])])
    assert reached.sum() > 380
    assert found[3, reached] == pytest.approx(2.5 * setting.window, rel=1e-12)
    assert (found[:, reached] <= 2.5 * setting.window * (1 + 1e-12)).all()
    even = np.empty(found.shape, np.float32)
    re = signal.real.astype(np.float32)
    im = signal.imag.astype(np.float32)
    spectrum(name).fill(re, im, setting, spectrum(name).tables(setting, CARRIER, INTERVAL), even)
    assert abs(even[3] / (2.5 * setting.window) - 1).max() > 0.3


def test_noise_keeps_its_law():
    """The fit of one line to K symbols of white noise has the mean power of a symbol over K."""
    rng = np.random.default_rng(4)
    noise = rng.normal(size=40000) + 1j * rng.normal(size=40000)
    present = rng.random(40000) > 0.5
    found = known("trp", np.where(present, noise, 0), np.zeros(40000))[5, ::8]
    counts = np.array([present[n : n + 8].sum() for n in range(0, 8 * len(found), 8)])
    for count in (2, 4, 6):
        assert np.mean(found[counts == count] ** 2) == pytest.approx(2.0 * 64 / count, rel=0.15)


def test_even_sampling_gives_todays_tiles_to_the_last_bit():
    signals = echoes(seed=1)
    network = Network.from_settings(NETWORK)
    tiles = [
        Renderer(network, Spectra(times=times), Images(size=32)) for times in ("even", "known")
    ]
    plain, same = (one.tile(signals) for one in tiles)
    assert (plain == same).all()
    values = np.empty((2, 32, 32), np.float32)
    for name in SETTINGS:
        for one, out in zip(tiles, values, strict=True):
            one.values(normalised(signals[1]), 1, name, out, np.zeros(signals.shape[1]))
        # Pixels round; the values before them tell the two ways apart.
        assert (values[0] == values[1]).all()
    assert (tiles[1].tile(signals, late=np.zeros(signals.shape)) == plain).all()
    gaps = signals * (np.arange(signals.shape[1]) % 4 != 3)
    assert (tiles[0].tile(gaps) == tiles[0].tile(gaps, late=np.full(gaps.shape, 0.3))).all()
    assert (tiles[1].tile(gaps) != tiles[0].tile(gaps)).any()
    late = np.random.default_rng(5).uniform(0, 0.5, gaps.shape)
    assert (tiles[1].tile(gaps) != tiles[1].tile(gaps, late=late)).any()
    every = tiles[1].some(gaps, range(9), late)
    assert (join(every, 3) == tiles[1].tile(gaps, late=late)).all()


def test_unknown_words_are_refused():
    with pytest.raises(InputError, match=r"spectra.times is 'late'"):
        Spectra.from_settings({"times": "late", "vrp": {"window": 16, "hop": 1, "points": 16}})
    assert (
        Spectra.from_settings(
            {"times": "known", "vrp": {"window": 16, "hop": 1, "points": 16}}
        ).times
        == "known"
    )
    assert list(Spectra(times="known")) == ["vrp", "trp", "vt"]
