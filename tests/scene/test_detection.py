"""Cancellers and the detector: what they leave of echoes and noise, and where a track goes."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.linalg import toeplitz
from scipy.stats import beta

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.numerics.streams import stream
from lowalt.scene import set_noise
from lowalt.scene.effects.detection import canceller, cell_error, detector
from lowalt.scene.laws.windblown import windblown
from lowalt.scene.waveform import Look
from scenes import A, network

RADIO = network(symbols=200, subcarriers=64)
KINDS = [{"kind": "mean"}, {"kind": "pulse", "order": 2}, {"kind": "clutter"}]
SPEED_MPS = 299_792_458.0 / 4.9e9 / 4 / 2.5e-3
"""Largest radial speed that does not fold."""


def normals(seed, *shape):
    return set_noise.white(stream(seed, "white"), 1.0, shape)


def filtered(changes, cells):
    return canceller.filtered(canceller.DEFAULTS | changes, cells)


@pytest.mark.parametrize("changes", KINDS)
def test_a_canceller_leaves_nothing_of_what_stands_still_and_keeps_the_level_of_noise(changes):
    still = np.broadcast_to(normals(1, 64), (200, 64))
    assert abs(filtered(changes, still)).max() < 1e-9
    assert np.mean(abs(filtered(changes, normals(2, 200, 500))) ** 2) == pytest.approx(
        1.0, rel=0.02
    )


def loss_db(changes, speed_mps):
    """By how much a filter weakens a steady echo of this radial speed.

    It is the median over the look's symbols.
    """
    turns = 2 * speed_mps * 4.9e9 / 299_792_458.0 * 2.5e-3
    left = filtered(changes, np.exp(2j * np.pi * turns * np.arange(200))[:, None])
    return -10 * np.log10(np.median(abs(left) ** 2))


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_pulse_canceller_weakens_a_steady_echo_as_its_response_says(order):
    """|2 sin(pi f T)|^k over the root of C(2k, k): Richards 2014, 5.2."""
    gain = {1: 2, 2: 6, 3: 20}[order]
    for speed_mps in (0.3, 1.0, 3.0):
        turns = speed_mps / SPEED_MPS / 2
        truth = 10 * np.log10(gain / (2 * np.sin(np.pi * turns)) ** (2 * order))
        found = loss_db({"kind": "pulse", "order": order}, speed_mps)
        assert found == pytest.approx(truth, abs=1e-6)


def land(wind_mps, rng, radio=RADIO):
    """Windblown land of unit power (N, 400).

    It is a still part and lines of an exponential spectrum, drawn one by one.
    """
    still, beta = windblown(wind_mps, radio.carrier_hz)
    wavelength_m = 299_792_458.0 / radio.carrier_hz
    speeds = rng.laplace(0.0, 1 / beta, (300, 400))
    times_s = radio.symbol_interval_s * np.arange(radio.symbols)
    phase = 2j * np.pi * rng.random(speeds.shape)
    lines = np.stack(
        [np.exp(4j * np.pi / wavelength_m * time * speeds + phase).sum(axis=0) for time in times_s]
    )
    moving = lines / np.sqrt(300) / np.sqrt(1 + still)
    return moving + np.sqrt(still / (1 + still)) * np.exp(2j * np.pi * rng.random(400))


def test_the_clutter_filter_leaves_windblown_land_its_depth_below_what_it_was():
    echoes = land(4.5, np.random.default_rng(3))
    assert np.mean(abs(echoes) ** 2) == pytest.approx(1.0, rel=0.1)
    for depth_db in (20.0, 30.0):
        left = filtered({"kind": "clutter", "depth_db": depth_db}, echoes)
        assert -depth_db - 18 < 10 * np.log10(np.mean(abs(left) ** 2)) < -depth_db - 12
    # A mean leaves all that moves.
    assert 10 * np.log10(np.mean(abs(filtered({}, echoes)) ** 2)) > -8


def test_the_clutter_filter_spares_targets_beyond_its_notch_which_grows_with_wind_and_depth():
    def loss(wind_mps, depth_db, speed_mps):
        return loss_db({"kind": "clutter", "wind_mps": wind_mps, "depth_db": depth_db}, speed_mps)

    assert abs(loss(1.0, 50.0, 2.0)) < 1.0 and loss(1.0, 50.0, 0.3) > 20
    pulse = loss_db({"kind": "pulse", "order": 2}, 1.2)
    assert loss(1.0, 50.0, 1.2) < 3.0 < 10.0 < pulse
    kept = [
        canceller.land(200, 4.9e9, 2.5e-3, wind, depth).shape[1]
        for wind, depth in ((1.0, 50.0), (4.5, 50.0), (4.5, 60.0))
    ]
    assert kept == sorted(kept) and len(set(kept)) == 3
    assert canceller.land(200, 4.9e9, 2.5e-3, 0.0, 50.0).shape[1] == 1
    # Speeds fold: a target that seems to stand still is lost whatever its true speed.
    assert loss(1.0, 50.0, 2 * SPEED_MPS) > 20


@pytest.mark.parametrize(
    ("symbols", "wind", "depth"), [(60, 1.0, 50.0), (61, 4.5, 50.0), (200, 4.5, 60.0)]
)
def test_the_land_s_components_span_what_numpy_s_eigenvectors_do(symbols, wind, depth):
    still, slope = windblown(wind, 4.9e9)
    decay_s = slope * SPEED_OF_LIGHT / 4.9e9 / (4 * np.pi)
    moving = toeplitz(1 / (1 + (2.5e-3 * np.arange(symbols) / decay_s) ** 2)) / (1 + still)
    beside = np.eye(symbols) - 1 / symbols
    power, basis = np.linalg.eigh(beside @ moving @ beside)
    basis = basis[:, power > 10 ** (-depth / 10)]
    found = canceller.land(symbols, 4.9e9, 2.5e-3, wind, depth)
    assert found.shape == (symbols, basis.shape[1] + 1)
    np.testing.assert_allclose(found.T @ found, np.eye(found.shape[1]), atol=1e-13)
    np.testing.assert_allclose(found @ found.T, basis @ basis.T + 1 / symbols, atol=1e-8)


def test_noise_behind_a_canceller_is_that_of_its_cell():
    noise = normals(4, 200)
    for changes in KINDS:
        found = set_noise.behind(noise, {"canceller": changes})
        np.testing.assert_array_equal(found, filtered(changes, noise[:, None])[:, 0])
    assert set_noise.in_all_cells({"cell_noise": None}) and not set_noise.in_all_cells(
        {"cell_noise": {"snr_db": 3.0}}
    )


def look_at(cell):
    """A look whose beam was pointed at a range cell."""
    data = np.ones((RADIO.symbols, RADIO.subcarriers), complex)
    return Look(RADIO, A, data, data, RADIO.times_s, 1.0, cell / (64 * 120e3))


def chosen(changes, cells, cell=20.0, seed=1):
    return detector.choose(
        detector.DEFAULTS | {"training": 8} | changes,
        None,
        cells,
        look_at(cell),
        stream(seed, "detector"),
    )


def crossing(cells_a_symbol=0.02, level=30.0):
    """Range cells (200, 64) of noise, a target that moves from cell 20 on, and a louder echo.

    The latter stands at 40.
    """
    place = 20 + cells_a_symbol * np.arange(200)
    cells = normals(5, 200, 64)
    cells[np.arange(200), np.rint(place).astype(int) % 64] += level
    cells[:, 40] += 10 * level
    return cells, np.rint(place).astype(np.int64) % 64


@pytest.mark.parametrize("cells_a_symbol", [0.0, 0.04, -0.15])
def test_a_track_from_the_aim_follows_its_target_past_louder_echoes_and_the_end_of_ranges(
    cells_a_symbol,
):
    cells, place = crossing(cells_a_symbol)
    for seed in range(5):
        found = chosen({}, cells, seed=seed)
        # A range error of a cell: the first symbols may lie outside the gate, and later ones do
        # not.
        assert (found == place)[20:].mean() > 0.97


def test_the_range_error_is_drawn_once_a_look_and_moves_the_gate():
    quiet = np.zeros((200, 64), complex)
    starts = np.array([chosen({"range_error_m": 15.0}, quiet, seed=seed)[0] for seed in range(300)])
    assert np.std(starts - 20) == pytest.approx(15.0 / RADIO.cell_m, rel=0.15)
    assert (chosen({"range_error_m": 0.0}, quiet) == 20).all()


def test_symbols_without_a_detection_take_the_predicted_cell():
    cells, place = crossing(0.05)
    cells[120:140] = normals(6, 20, 64)
    found = chosen({"range_error_m": 0.0, "false_alarm": 1e-6}, cells)
    assert abs(found - place)[120:140].max() <= 1 and (found == place)[140:].mean() > 0.95


def test_the_mean_takes_one_part_of_n_of_the_noise_and_the_clutter_filter_without_wind_makes_up_for_it():
    noise = normals(12, 20, 4000)
    left = filtered({"kind": "mean"}, noise)
    assert np.mean(abs(left) ** 2) / np.mean(abs(noise) ** 2) == pytest.approx(
        1 - 1 / 20, rel=0.005
    )
    still = filtered({"kind": "clutter", "wind_mps": 0.0}, noise)
    np.testing.assert_allclose(still, left * np.sqrt(20 / 19), atol=1e-12)


THRESHOLDS = [
    (cfar, window) for cfar in detector.NAMES["cfar"] for window in detector.NAMES["range_window"]
]


@pytest.mark.parametrize("cfar, window", THRESHOLDS)
def test_noise_exceeds_the_threshold_as_often_as_asked(cfar, window):
    cells = normals(7, 4000, 64)
    for rate in (0.03, 0.003):
        settings = detector.DEFAULTS | {"false_alarm": rate, "cfar": cfar, "range_window": window}
        found = detector.exceeds(settings, abs(detector.windowed(settings, cells)) ** 2).mean()
        # 256,000 cells: four standard deviations of as many independent ones are 4 % and 14 %.
        assert found == pytest.approx(rate, rel=0.05 if rate == 0.03 else 0.15)


@pytest.mark.parametrize(
    "count, rank, rate", [(32, 24, 1e-4), (12, 9, 1e-6), (8, 8, 0.1), (5, 1, 0.01), (1, 1, 0.3)]
)
def test_the_ordered_threshold_passes_noise_as_an_integral_over_the_order_statistic_says(
    count, rank, rate
):
    factor = detector.ordered_factor(count, rank, rate)
    ordered = beta(
        rank, count - rank + 1
    )  # of u = 1 - exp(-x), the rank-th smallest of `count` uniform numbers
    found, _ = quad(lambda u: ordered.pdf(u) * (1 - u) ** factor, 0, 1, epsabs=0, limit=200)
    assert found == pytest.approx(rate, rel=1e-6)


@pytest.mark.parametrize("cfar, window", THRESHOLDS)
def test_a_threshold_is_that_of_the_cells_about_it_one_by_one(cfar, window):
    settings = detector.DEFAULTS | {
        "guard": 2,
        "training": 7,
        "false_alarm": 0.1,
        "cfar": cfar,
        "range_window": window,
    }
    steps = range(3, 10) if window == "none" else (3, 6, 9)
    power = abs(normals(8, 6, 64)) ** 2
    found = detector.exceeds(settings, power)
    for n, m in np.ndindex(power.shape):
        about = sorted(power[n, (m + side * k) % 64] for side in (-1, 1) for k in steps)
        count = len(about)
        rank = {14: 11, 6: 5}[count]
        level = detector.factor(count, 0.1) * np.mean(about)
        if cfar == "ordered_statistic":
            level = detector.ordered_factor(count, rank, 0.1) * about[rank - 1]
        assert found[n, m] == (power[n, m] > level)


def test_the_range_window_is_that_of_the_subcarriers_and_keeps_the_level_of_noise():
    response = normals(9, 50, 64)
    weights = 1 - np.cos(2 * np.pi * np.arange(64) / 64)
    expected = np.fft.ifft(response * weights / np.sqrt(np.mean(weights**2)))
    hann = detector.DEFAULTS | {"range_window": "hann"}
    np.testing.assert_allclose(detector.windowed(hann, np.fft.ifft(response)), expected, atol=1e-14)
    assert detector.windowed(detector.DEFAULTS, response) is response


def test_a_track_finds_its_target_beside_a_louder_one_only_with_an_ordered_threshold():
    cells = normals(11, 200, 64)
    cells[:, 21] += 20
    cells[:, 29] += 200
    start = {"range_error_m": 0.0, "training": 16}
    # Without a detection the predicted cell, where the beam was pointed, is taken.
    assert (chosen(start, cells) == 20).mean() > 0.9
    for window in ("none", "hann"):
        assert (
            chosen(start | {"cfar": "ordered_statistic", "range_window": window}, cells) == 21
        ).mean() > 0.9


@pytest.mark.parametrize("cell", [3, 0])
def test_wrong_cells_are_as_many_and_as_far_as_asked_and_wrap_around_as_ranges_do(cell):
    right = np.full(20_000, cell)
    settings = cell_error.DEFAULTS | {"probability": 0.25, "spread_cells": 2}
    chosen = cell_error.choose(settings, right, np.zeros((20_000, 16)), None, stream(1, "e"))
    share = np.bincount(chosen, minlength=16) / len(chosen)
    expected = np.array([0.75, 1 / 16, 1 / 16, *[0] * 11, 1 / 16, 1 / 16])
    np.testing.assert_allclose(share, np.roll(expected, cell), atol=0.01)
