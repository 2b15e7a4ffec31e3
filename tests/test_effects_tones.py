"""The compiled passes of the receiver: the strongest cells without a transform, and data as NumPy draws them."""

from dataclasses import replace
from typing import Protocol, runtime_checkable

import numpy as np
import pytest

from lowalt.common.streams import stream
from lowalt.effects import chain, receiving, strongest_cell, tone_loops, waveform
from lowalt.effects.catalogue import called
from lowalt.effects.received import Scene, observe, received_signal
from test_effects import network, target


def looks(rng, symbols, subcarriers, noise):
    """Responses (N, M) of three points that drift over cells, of which two are nearly as strong; noise: of a cell."""
    drift = rng.uniform(0, subcarriers) + np.linspace(0, 3, symbols)[:, None]
    turns = np.arange(subcarriers) / subcarriers
    points = [(1.0, 0.0), (0.99, 0.6), (0.3, -0.4)]
    echo = sum(size * np.exp(-2j * np.pi * (drift + off) * turns) for size, off in points)
    random = rng.normal(size=echo.shape) + 1j * rng.normal(size=echo.shape)
    return np.exp(2j * np.pi * rng.random((symbols, 1))) * echo + noise * np.sqrt(subcarriers) * random


@pytest.mark.parametrize("subcarriers", [1, 2, 7, 16, 17, 64])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 0.1])
@pytest.mark.parametrize("carried", [False, True])
def test_the_strongest_cell_is_that_of_a_transform(subcarriers, noise, carried):
    rng = np.random.default_rng(1)
    responses = looks(rng, 60, subcarriers, noise)
    cells = np.fft.ifft(responses, axis=1)
    signs = waveform.sent_signs(stream(1, "waveform"), 60, subcarriers) if carried else None
    given = waveform.tones_of(responses, waveform.of_signs(signs)) if carried else responses
    value, cell = strongest_cell.strongest(given, signs)
    np.testing.assert_allclose(abs(cells)[np.arange(60), cell], abs(cells).max(axis=1), rtol=1e-12)
    np.testing.assert_allclose(value, cells[np.arange(60), cell], rtol=0, atol=1e-13 * abs(cells).max())


def test_a_stronger_cell_far_from_the_one_before_is_found():
    cells = np.zeros((3, 64), complex)
    cells[:, 5], cells[1, 40] = 1.0, 1.0 + 1e-9
    value, cell = strongest_cell.strongest(np.fft.fft(cells, axis=1))
    assert cell.tolist() == [5, 40, 5] and abs(value[1]) > 1 + 5e-10


def test_symbols_without_any_response_have_the_cell_that_a_transform_gives_them():
    cells = np.zeros((4, 32), complex)
    cells[1:3, 9] = 1.0
    value, cell = strongest_cell.strongest(np.fft.fft(cells, axis=1))
    assert cell.tolist() == [0, 9, 9, 0] and (value[[0, 3]] == 0).all()


@pytest.mark.parametrize("subcarriers", [1, 64])
def test_no_symbols_have_no_cells(subcarriers):
    value, cell = strongest_cell.strongest(np.empty((0, subcarriers), complex))
    assert value.shape == cell.shape == (0,)


def test_few_cells_are_worked_out_of_a_target_and_none_but_by_the_transform_of_noise(monkeypatch):
    rng, transformed = np.random.default_rng(2), []
    plain = strongest_cell._cells
    monkeypatch.setattr(
        strongest_cell, "_cells", lambda given, data: transformed.append(len(given)) or plain(given, data)
    )
    strongest_cell.strongest(looks(rng, 100, 64, 1e-3))
    assert transformed == [1]
    strongest_cell.strongest(rng.normal(size=(100, 64)) + 0j)
    assert 90 < transformed[-1] <= 100


def test_a_receiver_finds_the_cells_that_a_transform_of_its_responses_finds(monkeypatch):
    cloud, row = target(np.random.default_rng(3))
    radio = network(subcarriers=32, symbols=40)
    scene = Scene(radio, 5, None, tuple(called({"phase_noise": {"level_db": 20}, "adc": {"bits": 6}})))
    close = received_signal(scene, radio.stations[0], cloud, row)
    monkeypatch.setattr(strongest_cell, "FEWEST", 33)
    whole = received_signal(scene, radio.stations[0], cloud, row)
    np.testing.assert_array_equal(close.cell, whole.cell)
    np.testing.assert_allclose(close.signal, whole.signal, rtol=1e-12)


@pytest.mark.parametrize("shape", [(400, 256), (3, 7), (5, 12)])
def test_data_are_the_numbers_that_numpy_draws(shape):
    numpys = np.random.Generator(np.random.PCG64(4)).integers(0, 4, shape, dtype=np.uint8)
    np.testing.assert_array_equal(waveform.sent(np.random.Generator(np.random.PCG64(4)), *shape), waveform.QPSK[numpys])
    assert waveform.sent(stream(4, "waveform"), *shape).shape == shape


def test_a_receiver_that_takes_tones_makes_the_same_samples():
    from effects_frames import frame
    from lowalt.effects.receiver import clock_offset

    look, settings = frame(network(subcarriers=32, symbols=9)), {**clock_offset.DEFAULTS, "fixed_ppm": 3.0}
    samples = np.random.default_rng(5).normal(size=(9, 32)) + 0j
    found = clock_offset.retimed(settings, np.fft.fft(samples, axis=1), look, np.random.default_rng(6))
    np.testing.assert_array_equal(found, clock_offset.receive(settings, samples, look, np.random.default_rng(6)))


@pytest.mark.parametrize("subcarriers", [8, 9])
def test_data_are_divided_out_into_a_response_or_in_addition_to_one(subcarriers):
    rng = np.random.default_rng(8)
    tones, still = rng.normal(size=(2, 5, subcarriers)) + 1j * rng.normal(size=(2, 5, subcarriers))
    data = waveform.sent(stream(1, "waveform"), 5, subcarriers)
    alone = np.fft.fftshift(tones, axes=1) / data
    filled, added = np.full(tones.shape, np.nan + 0j), still.copy()
    tone_loops.divided(tones, data, True, filled)
    tone_loops.divided(tones, data, False, added)
    np.testing.assert_allclose(filled, alone, rtol=1e-14)
    np.testing.assert_allclose(added, still + alone, rtol=1e-14)


def test_weighed_samples_fill_or_add_to_the_first_ones_of_chosen_rows():
    rng = np.random.default_rng(9)
    samples, before = rng.normal(size=(2, 4, 12)) + 1j * rng.normal(size=(2, 4, 12))
    shape, total, part = rng.normal(size=12), np.full((4, 12), np.nan + 0j), before.copy()
    tone_loops.weighed(samples, shape, True, np.arange(4), total)
    tone_loops.weighed(samples[:2], shape[:5], False, np.array([3, 1]), part)
    np.testing.assert_allclose(total, samples * shape, rtol=1e-14)
    np.testing.assert_allclose(part[[3, 1], :5], before[[3, 1], :5] + (samples * shape)[:2, :5], rtol=1e-14)
    np.testing.assert_array_equal(part[:, 5:], before[:, 5:])
    np.testing.assert_array_equal(part[[0, 2]], before[[0, 2]])


@pytest.mark.parametrize("subcarriers", [8, 9])
def test_the_previous_symbol_stands_in_for_the_symbols_own(subcarriers):
    rng = np.random.default_rng(10)
    response, before, now = rng.normal(size=(3, 4, subcarriers)) + 1j * rng.normal(size=(3, 4, subcarriers))
    turns, rows = np.exp(1j * rng.normal(size=subcarriers)), np.array([2, 0])
    tones = np.empty((2, subcarriers), np.complex128)
    tone_loops.carried_before(response, turns, before, now, rows, tones)
    truth = response * (turns * before - now)
    np.testing.assert_allclose(tones, np.fft.ifftshift(truth[rows], axes=1), rtol=1e-13)


@pytest.mark.parametrize("moving", [False, True])
def test_a_chain_that_runs_again_takes_the_numbers_it_has_drawn(moving):
    cloud, row = target(np.random.default_rng(3))
    radio = network(subcarriers=32, symbols=40)
    named = {"receiver_noise": {"noise_figure_db": 60.0}, "phase_noise": {"level_db": 20, "shared": False}}
    named |= {"symbol_motion": {}} if moving else {}
    scene = Scene(radio, 5, None, tuple(called(named)))
    asked, found = [], []
    for again in (False, True):
        built = chain.Chain(
            list(scene.effects), observe(scene, radio.stations[0], cloud, row),
            lambda name: asked.append(name) or scene.stream(name, row, "A"),
        )  # fmt: skip
        built.receiving.again = again
        for _ in range(1 + again):
            on = frozenset(["symbol_motion"] if moving else [])
            found.append(built.run(on).signal)
    np.testing.assert_array_equal(found[0], found[1])
    np.testing.assert_array_equal(found[1], found[2])
    assert set(built.receiving.bare.drawn) >= {"phase_noise"} and len(built.receiving.bare.drawn) == 2


def test_halves_that_a_shuffle_does_not_need_are_drawn_again():
    one, other = stream(7, "shuffle"), stream(7, "shuffle")
    for count in (2, 3, 20, 31, 33, 100, 7):
        np.testing.assert_array_equal(one.permutation(count), slowly_shuffled(other, count))
        assert one.integers(0, 1000) == other.integers(0, 1000)


def slowly_shuffled(draws, count):
    order = np.arange(count)
    for place in range(count - 1, 0, -1):
        partner = place + 1
        while partner > place:
            partner = int(draws._halves(1)[0]) & ((1 << place.bit_length()) - 1)
        order[[place, partner]] = order[[partner, place]]
    return order


@pytest.mark.parametrize("subcarriers", [32, 9, 256])
@pytest.mark.parametrize(
    "name, settings",
    [
        ("receiver_noise", {"noise_figure_db": 150.0}), ("cell_noise", {"snr_db": 3.0}), ("cell_noise", {}),
        ("timing_offset", {"fixed_s": 1e-7}), ("clock_offset", {"fixed_ppm": 3.0}),
        ("carrier_offset", {"fixed_ppm": 3.0}), ("phase_noise", {"shared": False}),
        ("iq_imbalance", {"gain_db": 1.0, "phase_deg": 5.0}),
    ],
)  # fmt: skip
def test_an_effect_on_tones_makes_the_tones_of_its_samples(name, settings, subcarriers):
    from effects_frames import frame

    look, effect = frame(network(subcarriers=subcarriers, symbols=9)), called({name: settings})[0]
    look = replace(look, reference=1.0)
    rng = np.random.default_rng(5)
    samples = rng.normal(size=(9, subcarriers)) + 1j * rng.normal(size=(9, subcarriers))
    truth = np.fft.fft(effect.module.receive(effect.settings, samples, look, stream(6, name)), axis=1)
    found = effect.module.retoned(effect.settings, np.fft.fft(samples, axis=1), look, stream(6, name))
    assert abs(truth - np.fft.fft(samples, axis=1)).max() > 1e-6 * abs(truth).max() or settings == {}
    np.testing.assert_allclose(found, truth, rtol=0, atol=1e-13 * abs(truth).max())


@runtime_checkable
class Never(Protocol):
    """What no module offers."""

    def never_there(self) -> None:
        """Do nothing."""


ALL_ON_TONES = {"receiver_noise": {}, "timing_offset": {}, "clock_offset": {"fixed_ppm": 2.0}, "iq_imbalance": {}}


@pytest.mark.parametrize(
    "effects",
    [
        ALL_ON_TONES, ALL_ON_TONES | {"adc": {}}, {"timing_offset": {}, "phase_noise": {"shared": False}, "adc": {}},
        ALL_ON_TONES | {"symbol_motion": {}}, ALL_ON_TONES | {"data_symbols": {}},
        ALL_ON_TONES | {"carrier_offset": {"fixed_ppm": 2.0}, "power_amplifier": {}},
    ],
)  # fmt: skip
def test_a_receiver_on_tones_hears_what_it_hears_on_samples(monkeypatch, effects):
    cloud, row = target(np.random.default_rng(3))
    radio = network(subcarriers=64, symbols=24, symbol_interval_s=2.5e-3)
    scene = Scene(radio, 5, None, tuple(called(effects)))
    given = radio.stations[0], cloud, row
    found = received_signal(scene, *given)
    monkeypatch.setattr(receiving, "ChangesTones", Never)
    monkeypatch.setattr(receiving, "TakesTones", Never)
    truth = received_signal(scene, *given)
    np.testing.assert_array_equal(found.cell, truth.cell)
    assert abs(found.signal - truth.signal).max() <= 1e-12 * abs(truth.signal).max()


@pytest.mark.parametrize("kind", ["mean", "pulse", "exponential"])
@pytest.mark.parametrize("more", [{}, {"slow_time": {"jitter_s": 1e-4}}, {"cell_error": {}}])
def test_a_canceller_of_responses_is_one_of_cells(monkeypatch, kind, more):
    cloud, row = target(np.random.default_rng(3))
    radio = network(subcarriers=64, symbols=24)
    effects = {"clutter": {}, "canceller": {"kind": kind}} | more
    scene = Scene(radio, 5, None, tuple(called(effects)))
    given = radio.stations[0], cloud, row
    found = received_signal(scene, *given)
    monkeypatch.setattr(chain, "FiltersSymbols", Never)
    truth = received_signal(scene, *given)
    assert abs(found.signal - truth.signal).max() <= 1e-12 * abs(truth.signal).max()
    assert (found.cell == truth.cell)[abs(truth.signal) > 0].all()
