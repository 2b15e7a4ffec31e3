"""Noise in range cells: the strongest cells found from few numbers are those of all numbers."""

import numpy as np
import pytest

from lowalt.common.streams import stream
from lowalt.effects import range_noise
from lowalt.effects.catalogue import called
from lowalt.effects.range_noise import LARGEST, RangeNoise
from lowalt.effects.received import Scene, received_signal
from test_effects import network, target

SYMBOLS = 60


def responses(count, seed=3):
    """A target of two scatterers that moves through a quarter of a cell, unlit in symbol 7, split evenly in 9."""
    rng, cell = np.random.default_rng(seed), 0.3 * count + 0.004 * np.arange(SYMBOLS)
    waves = np.exp(-2j * np.pi * np.arange(count) * cell[:, None] / count)
    waves = waves * (1 + 0.4 * np.exp(-2j * np.pi * np.arange(count) * 1.4 / count))
    waves = waves * np.exp(2j * np.pi * rng.random((SYMBOLS, 1)))
    waves[7] = 0.0
    waves[9] = np.exp(-2j * np.pi * np.arange(count) * 2 / count) + np.exp(-2j * np.pi * np.arange(count) * 11 / count)
    return waves


def noise_of(count, snr_db, seed=1):
    words = stream(seed, "noise in cells").bit_generator.random_raw(2 * SYMBOLS * count)
    return RangeNoise(words, (SYMBOLS, count), np.sqrt(0.5 * 10 ** (-snr_db / 10)))


def check(found, given, noise):
    cells = np.fft.ifft(given, axis=1) + noise.cells()
    value, cell = found
    np.testing.assert_array_equal(cell, abs(cells).argmax(axis=1))
    np.testing.assert_allclose(value, cells[np.arange(len(cells)), cell], rtol=0, atol=1e-14 * abs(cells).max())


@pytest.mark.parametrize("snr_db", [-20, -3, 0, 3, 8, 13, 18, 30, 60, 120])
@pytest.mark.parametrize("count", [256, 64, 17, 9])
def test_the_strongest_cells_in_noise_are_those_of_all_cells(count, snr_db):
    given = responses(count)
    for seed in range(3):
        noise = noise_of(count, snr_db, seed)
        check(noise.strongest(given), given, noise)


@pytest.mark.parametrize("count", [256, 40])
@pytest.mark.parametrize("far", [1, 100, 131, 255])
def test_the_largest_number_in_one_far_cell_is_not_overlooked(count, far):
    far, given = far % count, responses(count)
    noise = noise_of(count, 17.0)
    # The word 0 gives the largest number there is; the echo's cell holds at least 0.6 and its noise at most 0.2 here.
    noise.words[:, 2 * far] = 0
    assert abs(noise.cells()[:, far]) == pytest.approx(noise.scale * LARGEST)
    value, cell = noise.strongest(given)
    check((value, cell), given, noise)
    assert (cell == far).any() and (cell[10:] != far).any()


def test_the_largest_number_is_one_that_words_can_make():
    words = np.array([0, 0, 2**64 - 1, 0, 2**11, 2**62], np.uint64)
    cells = RangeNoise(words, (1, 3), 1.0).cells()[0]
    assert cells[0] == pytest.approx(LARGEST, rel=1e-15) and cells[1] == 0.0
    assert abs(cells[2]) == pytest.approx(np.sqrt(2 * 52 * np.log(2)))


def test_no_number_is_made_where_no_noise_can_change_the_choice(monkeypatch):
    given, noise = responses(256)[10:], noise_of(256, 40.0)
    noise = RangeNoise(noise.words[10:].reshape(-1), (SYMBOLS - 10, 256), noise.scale)
    monkeypatch.setattr(range_noise, "circular", None)
    value, cell = noise.strongest(given)
    clean = np.fft.ifft(given, axis=1)
    np.testing.assert_array_equal(cell, abs(clean).argmax(axis=1))
    assert 0 < abs(value - clean[np.arange(len(cell)), cell]).max() < noise.scale * LARGEST


def test_responses_of_noise_have_its_cells():
    noise = noise_of(64, 3.0)
    np.testing.assert_allclose(np.fft.ifft(noise.response, axis=1), noise.cells(), rtol=0, atol=1e-15)
    np.testing.assert_array_equal(noise.cells(np.array([5, 2])), noise.cells()[[5, 2]])


def signal(effects, tolerance=None):
    cloud, row = target(np.random.default_rng(3))
    radio = network(subcarriers=64, symbols=24, symbol_interval_s=2.5e-3)
    return received_signal(Scene(radio, 5, tolerance, tuple(called(effects))), radio.stations[0], cloud, row)


@pytest.mark.parametrize("noise", [{"receiver_noise": {"noise_figure_db": 45.0}}, {"cell_noise": {"snr_db": 6.0}}])
@pytest.mark.parametrize(
    "more",
    [
        {"adc": {"bits": 32, "clip": False}}, {"timing_offset": {"fixed_s": 0.0, "sigma_s": 1e-20}},
        {"cell_error": {"probability": 1e-9}}, {"iq_imbalance": {"gain_db": 1e-13, "phase_deg": 0.0}},
        {"power_amplifier": {"backoff_db": 100.0}}, {"symbol_motion": {}},
    ],
    ids=lambda more: next(iter(more)),
)  # fmt: skip
def test_noise_is_the_same_in_front_of_every_other_effect(noise, more):
    alone, found = signal(noise), signal(noise | more)
    near = 0.1 if "symbol_motion" in more else 1e-9
    clean = signal({})
    assert abs(alone.signal - clean.signal).max() > 0.05 * abs(clean.signal).max()
    assert np.mean(found.cell == alone.cell) > 0.9
    same = found.cell == alone.cell
    assert abs(found.signal - alone.signal)[same].max() < near * abs(alone.signal).max()


@pytest.mark.parametrize(
    "effects",
    [{"receiver_noise": {}}, {"canceller": {}}, {"ground_reflection": {}}, {"adc": {}}],
    ids=lambda one: next(iter(one)),
)
def test_where_no_physics_can_be_left_out_a_tolerance_changes_no_bit(effects):
    exact, found = signal(effects), signal(effects, tolerance=1e-3)
    np.testing.assert_array_equal(found.signal, exact.signal)
    np.testing.assert_array_equal(found.cell, exact.cell)
    assert found.power == exact.power and found.decisions == []
