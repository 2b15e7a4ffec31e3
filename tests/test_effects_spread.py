"""Moments spread to subcarriers and searched in one pass, and scenes whose tones come of that pass."""

from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.common.streams import stream
from lowalt.effects import response_tables, sent_alone, spread_search, strongest_cell, waveform
from lowalt.effects.catalogue import called
from lowalt.effects.chain import Chain
from lowalt.effects.received import Scene, received_signal
from test_effects import network, target


def moments(symbols, count, reach=0.4, seed=1):
    """Planes, table, own phase factors, whole cells and rests of a look; symbol 2 is empty where there is one."""
    rng = np.random.default_rng(seed)
    table = response_tables.table(reach, count, 1e-14)
    planes = rng.normal(size=(symbols, 2, len(table)))
    planes[2:3] = 0.0
    own = np.exp(2j * np.pi * rng.random(symbols))
    return planes, table, own, rng.integers(0, 3 * count, symbols), rng.uniform(-0.5, 0.5, symbols)


def written_out(planes, table, own, whole, cells):
    """The responses (N, M) of moments, summed one by one."""
    count = table.shape[1]
    # Whole cells turn by multiples of pi / M, which are reduced in whole numbers: large angles would lose digits.
    place = 2 * np.arange(count) - (count - 1)
    steps = whole[:, None] * place % (2 * count)
    delay = np.exp(-1j * np.pi * (steps + cells[:, None] * place) / count)
    return own[:, None] * delay * ((planes[:, 0] + 1j * planes[:, 1]) @ table)


@pytest.mark.parametrize("count", [1, 2, 7, 16, 33, 256])
@pytest.mark.parametrize("reach", [0.05, 0.4, 2.5])
def test_moments_are_spread_to_all_subcarriers_and_their_strongest_cells_found(count, reach):
    given = moments(5, count, reach)
    wanted = written_out(*given)
    result, value, cell = spread_search.spread_and_search(given, count, None)
    np.testing.assert_allclose(result, wanted, rtol=0, atol=1e-13 * abs(wanted).max())
    found = strongest_cell.strongest(wanted)
    np.testing.assert_array_equal(cell, found[1])
    np.testing.assert_allclose(value, found[0], rtol=0, atol=1e-13 * abs(wanted).max())
    assert cell[2] == 0 and value[2] == 0 and not result[2].any()


@pytest.mark.parametrize("count", [2, 7, 64])
def test_tones_are_those_of_the_responses_and_the_cells_the_same(count):
    given, signs = moments(5, count), waveform.sent_signs(stream(1, "waveform"), 5, count)
    responses, *plain = spread_search.spread_and_search(given, count, None)
    tones, *found = spread_search.spread_and_search(given, count, signs)
    wanted = waveform.tones_of(responses, waveform.of_signs(signs))
    np.testing.assert_allclose(tones, wanted, rtol=0, atol=1e-15 * abs(wanted).max())
    np.testing.assert_allclose(found[0], plain[0], rtol=0, atol=1e-14 * abs(plain[0]).max())
    np.testing.assert_array_equal(found[1], plain[1])


def test_the_signs_of_data_are_those_of_their_parts_and_leave_their_size():
    signs = waveform.sent_signs(stream(5, "waveform"), 6, 9)
    data = waveform.of_signs(signs)
    assert signs.shape == (2, 6, 9) and signs.dtype == np.int8 and set(signs.ravel()) == {-1, 1}
    np.testing.assert_array_equal(np.sign([data.real, data.imag]), signs)
    np.testing.assert_array_equal(data, waveform.sent(stream(5, "waveform"), 6, 9))
    np.testing.assert_allclose(abs(data), 1.0, rtol=1e-15)


def test_cells_of_a_response_like_noise_are_found_by_a_transform():
    given = moments(60, 64, reach=20.0)
    result, value, cell = spread_search.spread_and_search(given, 64, None)
    cells = np.fft.ifft(result, axis=1)
    np.testing.assert_array_equal(cell, abs(cells).argmax(axis=1))
    np.testing.assert_allclose(value, cells[np.arange(60), cell], rtol=0, atol=1e-14 * abs(cells).max())


def test_only_symbols_that_are_not_certain_are_transformed(monkeypatch):
    planes, table, own, _, _ = moments(60, 256, reach=0.05)
    whole, cells = np.full(60, 100), np.linspace(-0.5, 0.5, 60)
    whole[30] = 180
    rows, plain = [], strongest_cell.fill
    monkeypatch.setattr(
        strongest_cell, "fill", lambda given, signs, at, *rest: rows.extend(at) or plain(given, signs, at, *rest)
    )
    result, value, _ = spread_search.spread_and_search((planes, table, own, whole, cells), 256, None)
    assert 30 in rows and set(rows) <= {30, 31}
    np.testing.assert_allclose(abs(value), abs(np.fft.ifft(result, axis=1)).max(axis=1), rtol=1e-12)


@pytest.mark.parametrize("near", [0, 40, 41, 63])
def test_a_guess_of_the_first_cell_changes_no_answer_and_a_good_one_saves_a_transform(near, monkeypatch):
    cells = np.random.default_rng(4).normal(size=(40, 64)) * 0.01 + 0j
    cells[:, 40] = 1.0
    responses, transformed, plain = np.fft.fft(cells, axis=1), [], strongest_cell._cells
    monkeypatch.setattr(strongest_cell, "_cells", lambda *given: transformed.append(1) or plain(*given))
    value, cell = strongest_cell.strongest(responses, near=near)
    np.testing.assert_array_equal(cell, 40)
    np.testing.assert_allclose(value, cells[:, 40], rtol=0, atol=1e-14)
    assert len(transformed) == (0 if near == 40 else 1)


RECEIVERS = {
    "one": {"iq_imbalance": {"gain_db": 3.0}},
    "several": {"carrier_offset": {"fixed_hz": 900.0}, "iq_imbalance": {"gain_db": 3.0}, "adc": {"bits": 6}},
    "detected": {"iq_imbalance": {"gain_db": 3.0}, "canceller": {}},
}


@pytest.mark.parametrize("name", RECEIVERS)
def test_a_scene_s_signal_is_the_same_whether_its_tones_come_of_the_search_or_not(name, monkeypatch):
    cloud, row = target(np.random.default_rng(3))
    radio = network(symbols=48, subcarriers=256)
    scene = Scene(radio, 5, None, tuple(called(RECEIVERS[name])))
    sent, plain = [], Chain.heard
    monkeypatch.setattr(Chain, "heard", lambda chain, *rest: sent.append(chain.target._tones) or plain(chain, *rest))
    at_once = received_signal(scene, radio.stations[0], cloud, row)
    monkeypatch.setattr(sent_alone, "send", lambda chain: None)
    apart = received_signal(scene, radio.stations[0], cloud, row)
    assert sent[0].shape == (48, 256) and sent[1] is None
    np.testing.assert_allclose(at_once.signal, apart.signal, rtol=0, atol=1e-13 * abs(apart.signal).max())
    np.testing.assert_array_equal(at_once.cell, apart.cell)
    assert at_once.power == pytest.approx(apart.power, rel=1e-12)


@pytest.mark.parametrize(
    "effects",
    [
        {"receiver_noise": {}}, {"timing_offset": {}}, {"canceller": {}},
        {"clutter": {}, "iq_imbalance": {}}, {"interference": {}, "iq_imbalance": {}},
        {"companions": {}, "iq_imbalance": {}}, {"data_symbols": {"order": 16}, "iq_imbalance": {}},
        {"power_amplifier": {}, "iq_imbalance": {}}, {"ground_reflection": {}, "iq_imbalance": {}},
        {"squint": {}, "iq_imbalance": {}},
    ],
    ids=lambda effects: " ".join(effects),
)  # fmt: skip
def test_tones_are_not_made_at_once_where_something_else_comes_between(effects):
    named = called(effects)
    asked = []
    places = {place: [one for one in named if one.place == place] for place in ("channel", "receiver")}
    bent = bool({"ground_reflection", "squint"} & set(effects))
    chain = SimpleNamespace(
        **places, target=SimpleNamespace(bent=bent, send=lambda: asked.append(1)),
        sending=SimpleNamespace(source="data_symbols" in effects or None, distorts="power_amplifier" in effects),
    )  # fmt: skip
    sent_alone.send(chain)
    assert not asked
