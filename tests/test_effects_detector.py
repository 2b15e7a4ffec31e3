"""Noise in all range cells, detection by CFAR and gate, noise behind a canceller: closed forms and laws."""

import functools
import math

import numpy as np
import pytest
from scipy import stats
from scipy.integrate import quad

from effects_frames import frame, network
from lowalt.common.errors import InputError
from lowalt.effects import waveform
from lowalt.effects.catalogue import called
from lowalt.effects.checks import CheckedScene
from lowalt.effects.chunk import scene_signals
from lowalt.effects.detection import _threshold, canceller, detector
from lowalt.effects.received import Scene, received_signal
from lowalt.effects.receiver import cell_noise
from lowalt.effects.set_noise import behind_canceller
from lowalt.noise.__main__ import load_echoes
from lowalt.noise.chunk import noisy_signals
from test_effects_bounds import network as small
from test_effects_bounds import target

CELL = 100


def wins(snr_db: float, cells: int) -> float:
    """Probability that a steady target in its cell is stronger than noise in all other cells."""
    power = 2 * 10 ** (snr_db / 10)
    return quad(lambda x: stats.ncx2.pdf(x, 2, power) * stats.chi2.cdf(x, 2) ** (cells - 1), 0, 200, limit=400)[0]


def drawn(snr_db: float, symbols: int, seed: int = 1, cells: int = 256, fluctuating: bool = False) -> np.ndarray:
    """Range cells of unit noise with a target in one of them."""
    rng = np.random.default_rng(seed)
    result = rng.standard_normal((symbols, 2 * cells)).view(complex) * math.sqrt(0.5)
    shape = rng.standard_normal((symbols, 2)).view(complex)[:, 0] * math.sqrt(0.5) if fluctuating else 1.0
    result[:, CELL] += 10 ** (snr_db / 20) * shape
    return result


def detected(given: dict, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return detector.detect({**detector.DEFAULTS, **given}, abs(cells) ** 2)


@pytest.mark.parametrize(("snr_db", "share"), [(3.0, 0.112), (8.0, 0.582)])
def test_the_right_cell_wins_as_often_as_the_closed_form_says(snr_db, share):
    assert wins(snr_db, 256) == pytest.approx(share, abs=5e-4)
    # A point in the middle of a cell, through the whole chain.
    radio = small(symbols=1500, subcarriers=256)
    cloud, row = target([[0.0, 0.0, 0.0]], x_m=CELL * radio.cell_m)
    scene = Scene(radio, 3, None, tuple(called({"cell_noise": {"snr_db": snr_db}})))
    received = received_signal(scene, radio.stations[0], cloud, row)
    assert np.mean(received.cell == CELL) == pytest.approx(share, abs=5 * math.sqrt(share * (1 - share) / 1500))


@pytest.mark.parametrize("snr_db", [3.0, 8.0])
def test_a_gate_that_stays_leaves_only_its_own_cells_to_compete(snr_db):
    share = wins(snr_db, 7)
    chosen, found = detected({"cfar": "none", "gate_cells": 3, "gain": 0.0}, drawn(snr_db, 6000))
    assert found.all() and abs(chosen - CELL).max() <= 3
    assert np.mean(chosen == CELL) == pytest.approx(share, abs=5 * math.sqrt(share * (1 - share) / 6000))


@pytest.mark.parametrize("kind", ["ca", "os"])
def test_false_alarms_come_as_often_as_set(kind):
    noise = drawn(-300.0, 4000)
    settings = {**detector.DEFAULTS, "cfar": kind, "false_alarm": 1e-2, "training": 8}
    scale = _threshold.factor(kind, 16, detector.rank(settings), 1e-2)
    every = np.zeros(256 + 20)
    alarms = sum(
        _threshold.search(row, cell, cell + 1, scale, 2, 8, detector.rank(settings), every) >= 0
        for row in abs(noise[:400]) ** 2
        for cell in range(256)
    )
    assert alarms / (400 * 256) == pytest.approx(1e-2, abs=5 * math.sqrt(1e-2 / (400 * 256)) * 1.5)


@pytest.mark.parametrize("kind", ["ca", "os"])
@pytest.mark.parametrize("snr_db", [8.0, 15.0])
def test_a_fluctuating_target_is_detected_as_often_as_the_closed_form_says(kind, snr_db):
    settings = {**detector.DEFAULTS, "cfar": kind, "gate_cells": 0, "gain": 0.0, "acquire": 6000}
    _, found = detected(settings, drawn(snr_db, 6000, fluctuating=True))
    # A target of exponential power only stretches the tested cell: the false-alarm law at a smaller factor.
    scale = _threshold.factor(kind, 32, detector.rank(settings), 1e-3) / (1 + 10 ** (snr_db / 10))
    if kind == "ca":
        share = (1 + scale / 32) ** -32
    else:
        share = math.prod((32 - i) / (32 - i + scale) for i in range(detector.rank(settings)))
    assert np.mean(found) == pytest.approx(share, abs=5 * math.sqrt(share * (1 - share) / 6000))


def test_thresholds_compare_with_mean_and_ordered_statistic():
    rng = np.random.default_rng(2)
    power, padded = rng.exponential(size=64), np.empty(64 + 14)
    for cell in (0, 5, 31, 63):
        around = np.array([power[(cell + side * k) % 64] for k in range(3, 8) for side in (-1, 1)])
        for rank, estimate in ((0, around.mean()), (7, np.sort(around)[6])):
            edge = power[cell] / estimate
            for factor, passes in ((edge * 0.999, True), (edge * 1.001, False)):
                found = _threshold.search(power, cell, cell + 1, factor, 2, 5, rank, padded)
                assert found == (cell if passes else -1)


def test_a_gate_follows_a_target_around_all_cells_and_through_a_fade():
    symbols = np.arange(4000)
    true = np.floor(CELL + 0.05 * symbols + 0.5).astype(int) % 256
    cells = drawn(-300.0, 4000, seed=5)
    visible = (symbols < 2000) | (symbols >= 2040)
    cells[symbols, true] += np.where(visible, 10 ** (15 / 20), 0.0)
    chosen, found = detected({}, cells)
    off = (chosen - true + 128) % 256 - 128
    assert np.mean(off[visible] == 0) > 0.97 and abs(off[2040:]).max() <= 4
    assert np.mean(found[2000:2040]) < 0.1 and abs(off[2000:2040]).max() <= 3


def test_without_a_threshold_and_a_gate_the_strongest_cell_is_chosen():
    cells = drawn(3.0, 200)
    open_to_all = {"cfar": "none", "gate_cells": None}
    assert (detected(open_to_all, cells)[0] == abs(cells).argmax(axis=1)).all()
    assert called({"detector": open_to_all}) == []
    # No threshold that any cell passes, a gate of all cells: likewise.
    loose = {"cfar": "ca", "false_alarm": 0.5, "gate_cells": 127, "gain": 0.0}
    assert np.mean(detected(loose, cells)[0] == abs(cells).argmax(axis=1)) > 0.99


def test_every_range_cell_has_the_set_noise():
    look = frame(network(200, 64))
    look = waveform.Frame(look.network, look.station, look.sent, 4.0)
    rng = np.random.default_rng(3)
    noise = cell_noise.receive({"snr_db": 10.0}, np.zeros((200, 64), complex), look, rng)
    cells = np.fft.ifft(waveform.demodulate(noise, look.sent), axis=1)
    assert np.mean(abs(cells) ** 2) == pytest.approx(0.4, rel=0.05)
    assert abs(np.mean(abs(cells) ** 2, axis=0) - 0.4).max() < 0.4 * 5 / math.sqrt(200)


def test_noise_of_each_snr_is_its_own_and_the_noise_stage_adds_none():
    radio = small(symbols=40, subcarriers=32)
    cloud, row = target([[0.0, 0.0, 0.0]], x_m=12 * radio.cell_m)
    scene = Scene(radio, 3, None, tuple(called({"cell_noise": {}, "detector": {"training": 4}})))
    snrs = [3.0, 40.0, math.inf]
    found, power = scene_signals(scene, "A", {"Thing": cloud}, [row], None, snrs)
    assert found.shape == (1, 3, 40)
    plain = received_signal(Scene(radio, 3, None, ()), radio.stations[0], cloud, row).signal
    assert found[0, 2] == pytest.approx(plain, rel=1e-6)
    noise = found[0, :2] - plain
    assert np.mean(abs(noise[1]) ** 2) == pytest.approx(power[0] * 1e-4, rel=0.6)
    assert abs(np.vdot(noise[0], noise[1])) < 0.6 * np.linalg.norm(noise[0]) * np.linalg.norm(noise[1])
    stacked = noisy_signals(np.stack([found, 2 * found]), [row], ["A", "B"], snrs, 3, np.ones((2, 1)))
    assert stacked.shape == (1, 3, 2, 40) and (stacked[0, :, 1] == 2 * found[0]).all()


def test_a_clean_scene_keeps_every_bit_with_an_idle_detector():
    radio = small(symbols=6, subcarriers=32)
    cloud, row = target([[0.0, 0.0, 0.0], [0.3, 0.1, 0.0]], x_m=30.0)
    plain = received_signal(Scene(radio, 3, None, ()), radio.stations[0], cloud, row)
    idle = {"cell_noise": {"snr_db": math.inf}, "detector": {"cfar": "none", "gate_cells": None}}
    received = received_signal(Scene(radio, 3, None, tuple(called(idle))), radio.stations[0], cloud, row)
    assert (received.signal == plain.signal).all()


@pytest.mark.parametrize("order", [1, 2, 3])
def test_noise_behind_a_pulse_canceller_has_its_spectrum_and_its_power(order):
    rng, settings = np.random.default_rng(8), {"kind": "pulse", "order": order}
    looks = [behind_canceller(rng.standard_normal(512).view(complex), settings)[order:] for _ in range(2000)]
    spectrum = np.mean(abs(np.fft.fft(np.array(looks), axis=1)) ** 2, axis=0) / (2 * len(looks[0]))
    turns = np.fft.fftfreq(len(looks[0]))
    want = canceller.response({**canceller.DEFAULTS, **settings}, turns) ** 2
    assert spectrum.mean() == pytest.approx(1, rel=0.02)
    assert want == pytest.approx((2 * np.sin(np.pi * turns)) ** (2 * order) / math.comb(2 * order, order), abs=1e-12)
    # 2000 periodograms have a standard error of 2 %; their edges leak 1 / N of the peak.
    assert abs(spectrum - want).max() < 0.12 * want.max()


def test_noise_at_set_snrs_is_that_which_a_cell_holds_behind_the_canceller():
    rng = np.random.default_rng(4)
    cells, noise = rng.standard_normal((2, 60, 2)).view(complex)[..., 0]
    settings = {**canceller.DEFAULTS, "kind": "pulse", "order": 2}
    both = canceller.process(settings, (cells + noise)[:, None], None, None)[:, 0]
    alone = canceller.process(settings, cells[:, None], None, None)[:, 0]
    assert alone + behind_canceller(noise, settings) == pytest.approx(both, abs=1e-12)


def test_the_noise_stage_passes_its_noise_through_the_scenes_canceller(tmp_path):
    rows = [{"subtype": "crow", "model": 0}]
    echoes, powers = np.ones((1, 1, 400), np.complex64), np.ones((1, 1))
    one_pulse = functools.partial(behind_canceller, canceller={"kind": "pulse"})
    white, coloured = (
        noisy_signals(echoes, rows, ["A"], [0.0], 1, powers, behind)[0, 0, 0] - 1 for behind in (None, one_pulse)
    )
    assert coloured == pytest.approx(one_pulse(white), abs=1e-6)
    np.save(tmp_path / "echo.npy", np.ones((1, 2, 8), np.complex64))
    (found,) = load_echoes([str(tmp_path / "echo.npy")], ["A"], 1, snrs=2)
    assert found.shape == (1, 2, 8)
    with pytest.raises(InputError, match=r"echo.npy: shape \(1, 2, 8\)"):
        load_echoes([str(tmp_path / "echo.npy")], ["A"], 1, snrs=3)


def test_contradictions_are_refused_by_name():
    both = {"receiver_noise": {}, "cell_noise": {}}
    with pytest.raises(InputError, match="expected one of them"):
        cell_noise.check({"snr_db": None}, CheckedScene(network(), both, (math.inf,)))
    with pytest.raises(InputError, match=r"snr_db is 3.0 and noise.snr_db \[8.0\]"):
        cell_noise.check({"snr_db": 3.0}, CheckedScene(network(), {}, (8.0,)))
    for change, name in (({"training": 126}, "training: 128"), ({"gate_cells": 128}, "gate_cells: 128")):
        with pytest.raises(InputError, match=name):
            detector.check({**detector.DEFAULTS, **change}, CheckedScene(network(), {}, ()))
    detector.check({**detector.DEFAULTS, "training": 126, "cfar": "none"}, CheckedScene(network(), {}, ()))
