"""The compiled passes of the receiver: the strongest cells without a transform, and data as NumPy draws them."""

import numpy as np
import pytest

from lowalt.common.streams import stream
from lowalt.effects import strongest_cell, waveform
from lowalt.effects.catalogue import called
from lowalt.effects.received import Scene, received_signal
from test_effects import network, target


def cells_of(responses):
    cells = np.fft.ifft(responses, axis=1)
    sizes = abs(cells)
    return cells, sizes, sizes.argmax(axis=1)


@pytest.mark.parametrize("subcarriers", [1, 2, 7, 64])
@pytest.mark.parametrize("change", [0.0, 1e-9, 1e-2, 0.1])
def test_the_strongest_cell_is_found_among_all_that_a_change_can_lift(subcarriers, change):
    rng = np.random.default_rng(1)
    cells = np.zeros((60, subcarriers), complex)
    # Two or three cells of nearly the same size, so that small changes decide.
    for row in cells:
        row[rng.integers(subcarriers, size=3)] = 1 + change * rng.normal(size=3)
    before = np.fft.fft(cells, axis=1)
    noise = change * (rng.normal(size=before.shape) + 1j * rng.normal(size=before.shape))
    # A whole symbol may turn and grow: only what fits no multiple of the symbol counts as a change.
    after = np.exp(2j * np.pi * rng.random((60, 1))) * rng.uniform(0.5, 2, (60, 1)) * before + noise
    _, sizes, best = cells_of(before)
    truth, own, number = cells_of(after)
    found = strongest_cell.strongest(before, sizes, best, after)
    assert found is not None
    value, cell = found
    np.testing.assert_allclose(own[np.arange(60), cell], own.max(axis=1), rtol=1e-12)
    np.testing.assert_allclose(value, truth[np.arange(60), cell], rtol=0, atol=1e-12)
    assert change < 1e-9 or (cell == number).all()
    assert subcarriers < 7 or change < 1e-2 or (cell != best).any()


def test_symbols_that_differ_too_much_are_left_to_the_transform():
    rng = np.random.default_rng(2)
    before, after = (rng.normal(size=(40, 64)) + 0j for _ in range(2))
    _, sizes, best = cells_of(before)
    assert strongest_cell.strongest(before, sizes, best, after) is None


def test_a_receiver_finds_the_cells_that_a_transform_of_its_responses_finds(monkeypatch):
    cloud, row = target(np.random.default_rng(3))
    radio = network(subcarriers=32, symbols=40)
    scene = Scene(radio, 5, None, tuple(called({"phase_noise": {"level_db": 20}, "adc": {"bits": 6}})))
    close = received_signal(scene, radio.stations[0], cloud, row)
    monkeypatch.setattr("lowalt.effects.chain.strongest", lambda *given: None)
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
