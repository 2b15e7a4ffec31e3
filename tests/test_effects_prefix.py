"""Echoes later than the cyclic prefix: against a sum over time samples, the published balance, and the explanation."""

import numpy as np
import pytest

from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.effects import waveform
from lowalt.effects.catalogue import called
from lowalt.effects.chain import Chain
from lowalt.effects.channel import cyclic_prefix
from lowalt.effects.explain import prefix
from lowalt.effects.explain_text import prefix_line
from lowalt.effects.received import Scene, observe, received_signal
from lowalt.effects.response import response
from test_effects_bounds import network, target


def scene(radio, effects, tolerance=None):
    return Scene(radio, 3, tolerance, tuple(called(effects)))


def cut_by_hand(radio, view, rcs, data, before, prefix_s):
    """Responses (N, M) of points whose windows begin with the previous symbol, sample by sample."""
    count, spacing = radio.subcarriers, radio.subcarrier_spacing_hz
    baseband = (np.arange(count) - count // 2) * spacing
    result = np.zeros((len(view.times_s), count), complex)
    for point in range(len(rcs)):
        places = view.places[:, point : point + 1]
        whole = response(radio, radio.stations[0], places, rcs[point : point + 1], view.aim_m)
        delay = 2 * np.linalg.norm(places[:, 0] - radio.stations[0].position_m, axis=1) / SPEED_OF_LIGHT
        for n in range(len(delay)):
            samples = np.empty(count, complex)
            for i in range(count):
                t = i / (count * spacing)
                late = t < delay[n] - prefix_s
                sent = before[n] * np.exp(2j * np.pi * baseband * prefix_s) if late else data[n]
                samples[i] = (whole[n] * sent * np.exp(2j * np.pi * baseband * t)).sum() / count
            result[n] += waveform.demodulate(samples[None], data[n : n + 1])[0]
    return result


@pytest.mark.parametrize("tolerance", [None, 1e-3])
def test_the_window_begins_with_the_previous_symbol(tolerance):
    radio = network(subcarriers=32, symbols=3, transmit=(4, 2), receive=(4, 2))
    cloud, row = target([[0, 0, 0], [12.0, 3.0, 1.0], [-25.0, 0, 2.0]], x_m=330.0, y_m=20.0, vx_mps=3.0)
    asked, station = scene(radio, {"cyclic_prefix": {}}, tolerance), radio.stations[0]
    received, view = received_signal(asked, station, cloud, row), observe(asked, station, cloud, row)
    data, before = (
        waveform.sent(asked.stream(name, row, "A"), 3, 32) for name in ("waveform", "previous waveform")
    )  # fmt: skip
    truth = cut_by_hand(radio, view, cloud.rcs_m2, data, before, 144 / 2048 / 120e3)
    cells = np.fft.ifft(truth, axis=1)
    value = cells[np.arange(3), abs(cells).argmax(axis=1)]
    assert abs(received.signal - value).max() <= (tolerance or 1e-10) * abs(value).max()


@pytest.mark.parametrize("count", [64, 256])
@pytest.mark.parametrize("share", [0.0, 144 / 2048, 1.0])
def test_land_is_cut_at_the_delay_of_its_cell(count, share):
    radio = network(subcarriers=count, symbols=5)
    rng = np.random.default_rng(1)
    cells = rng.normal(size=(5, count)) + 1j * rng.normal(size=(5, count))
    now, before = rng.normal(size=(2, 5, count)) + 1j * rng.normal(size=(2, 5, count))
    prefix = round(share * count)
    given = {"prefix_s": prefix / (count * 120e3)}
    kept = cells.copy(), now.copy(), before.copy()
    ours = cyclic_prefix.convolved(given, radio, cells, (now, before))
    np.testing.assert_array_equal(kept, (cells, now, before))
    for i in range(count):
        late = np.arange(count) > i + prefix
        sent = np.where(
            late, before[:, (i - np.arange(count) + prefix) % count], now[:, (i - np.arange(count)) % count]
        )
        np.testing.assert_allclose(ours[:, i], (cells * sent).sum(axis=1), rtol=0, atol=1e-14 * abs(ours).max() * 8)


def test_land_and_a_target_in_one_cell_are_cut_alike():
    radio = network(subcarriers=64, symbols=6)
    cell = 40
    range_m = cell * SPEED_OF_LIGHT / (2 * 64 * 120e3)
    cloud, row = target([[0, 0, 0]], x_m=range_m * (1 - 1e-12))
    asked = scene(radio, {"cyclic_prefix": {"prefix_s": 4 / (64 * 120e3)}})
    view = observe(asked, radio.stations[0], cloud, row)
    chain = Chain(list(asked.effects), view, lambda name: asked.stream(name, row, "A"), 1.0)
    alone = chain.cells(frozenset({"cyclic_prefix"}))
    chain._clutter = chain.cells(frozenset())
    chain._clutter = np.fft.fft(chain._clutter, axis=1)
    both = chain.cells(frozenset({"cyclic_prefix"}))
    assert abs(both - 2 * alone).max() < 1e-6 * abs(alone).max()


def test_at_290_m_a_sixth_of_the_window_is_lost():
    radio = network(symbols=400, transmit=(1, 1), receive=(1, 1))
    cloud, row = target([[0, 0, 0]], x_m=290.0)
    asked = scene(radio, {"cyclic_prefix": {}})
    view = observe(asked, radio.stations[0], cloud, row)
    chain = Chain(list(asked.effects), view, lambda name: asked.stream(name, row, "A"), 1.0)
    whole, cut = (np.fft.fft(chain.cells(on), axis=1) for on in (frozenset(), frozenset({"cyclic_prefix"})))
    share = (cut / whole).mean()
    assert 1 - abs(share) == pytest.approx(0.16, abs=0.01)
    assert 20 * np.log10(abs(share)) == pytest.approx(-1.5, abs=0.1)
    interference = np.mean(abs(cut - share * whole) ** 2) / np.mean(abs(whole) ** 2)
    assert 10 * np.log10(interference) == pytest.approx(-5.3, abs=0.3)
    cells = np.fft.ifft(cut / whole - share, axis=1)
    assert 10 * np.log10(np.mean(abs(cells) ** 2)) == pytest.approx(-29.3, abs=0.5)


def test_an_echo_within_the_prefix_keeps_every_bit():
    radio = network(symbols=4)
    cloud, row = target([[0, 0, 0], [0.3, 0.1, 0.0]], x_m=80.0)
    station = radio.stations[0]
    plain, named = (
        received_signal(scene(radio, effects, 1e-3), station, cloud, row) for effects in ({}, {"cyclic_prefix": {}})
    )
    assert (plain.signal == named.signal).all() and not named.decisions[0].computed
    assert named.decisions[0].bound == 0
    row |= {"x_m": 95.0}
    assert received_signal(scene(radio, {"cyclic_prefix": {}}, 1e-3), station, cloud, row).decisions[0].computed


def test_explain_says_the_loss_of_every_echo():
    radio = network()
    assert "covers 88 m: this echo is within it" in prefix_line(prefix(scene(radio, {}), 80.0))
    line = prefix_line(prefix(scene(radio, {}), 290.0))
    assert "loses 16% of its window, -1.5 dB; interference -5 dB a subcarrier, -29 dB a range cell" in line
    assert "not modelled" in line
