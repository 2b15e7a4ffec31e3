"""Cubes: their range cells, noise and truth, and the images made of them.

Range cells are tested against the echo's definition.
"""

import io
import pickle
from dataclasses import replace

import numpy as np
import pytest

import pointwise_echo
from lowalt.config.blocks import render_blocks
from lowalt.config.layers import merge
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo import Rigid
from lowalt.files.errors import InputError
from lowalt.motion import poses
from lowalt.noise.awgn import add_noise
from lowalt.numerics.streams import stream
from lowalt.scene.effects.detection import canceller
from lowalt.shards import ShardSet
from lowalt.shards.dataset import Dataset
from lowalt.shards.stored_cubes import cubes_of, of_cubes
from lowalt.spectra import Spectra, spectrum
from lowalt.spectra.cube import TRUTH, Cube
from lowalt.spectra.kinds import hrrp, range_doppler
from lowalt.tiles import triangle
from lowalt.tiles.cubes import Cubes
from lowalt.tiles.render import Renderer, split
from small_configuration import configuration
from stage_runs import check_members, run_stages

SHOWN = {"hrrp": {"window": 2, "hop": 1, "cells": 9}, "range_doppler": {"cells": 9, "points": 512}}
SNRS = [3.0, float("inf")]
LAND = {"clutter": {"gamma": 0.5, "reach_m": 200.0}, "canceller": {"kind": "mean"}}


@pytest.fixture(scope="module")
def dataset():
    """Two motion models of two subtypes with five images a station, at a band of cells of 0.6 m."""
    config = configuration()
    config["targets"]["select"] = ["DJI Mini 2", "Owl"]
    config["motion"] |= {"models": 2, "models_per_chunk": 2}
    config["split"] = {"by": "motion", "train": 1, "val": 0, "test": 1}
    config["network"] |= {"subcarriers": 512, "subcarrier_spacing_hz": 480e3}
    config["images"] |= {"size": 32}
    config["spectra"] |= SHOWN
    return Dataset(config)


def without(config: dict) -> dict:
    return config | {
        "spectra": {name: block for name, block in config["spectra"].items() if name not in SHOWN}
    }


def cubes_of_row(maker, row: dict, snr_db: float) -> list[Cube]:
    """The cubes of all stations of a motion model at an SNR (dB)."""
    return maker.cubes(row, snr_db, maker.signal(row, snr_db))


def truth(cube: Cube, name: str) -> np.ndarray:
    return cube.truth[:, TRUTH.index(name)]


def test_images_of_cells_come_after_the_other_three_which_stay_as_without_them(dataset):
    three = Dataset(without(dataset.config), dataset.clouds)
    for number in (0, 3):
        sample = dataset[number]
        plain = three[number]
        found = split(sample.image, 5).reshape(3, 5, 32, 32)
        old = split(plain.image, 3).reshape(3, 3, 32, 32)
        assert (found[:, :3] == old).all() and (sample.signal == plain.signal).all()
        assert sample.record == plain.record
        # The chosen cell is the middle one, where the profile is brightest on average.
        assert np.isin(found[:, 3].astype(float).mean(axis=2).argmax(axis=1), (15, 16)).all()


def test_the_stages_draw_what_a_data_set_draws_on_the_spot(dataset, tmp_path):
    one = {"targets": {"select": ["Owl"]}, "motion": {"models": 1, "models_per_chunk": 1}}
    one["split"] = {"train": 1, "val": 0, "test": 0}
    config = merge(dataset.config, {"effects": LAND, **one})
    made = Dataset(config, dataset.clouds)
    stored = ShardSet(run_stages(made, tmp_path, "image"))
    check_members(pickle.loads(pickle.dumps(made)), stored)
    assert stored.tile(0).shape == (3 * 32, 5 * 32)


def test_cells_without_noise_are_those_of_the_echo_s_definition_and_the_chosen_ones_are_the_signal(
    dataset,
):
    row = dataset.row(dataset.place(1))
    network = dataset.maker.network
    cloud = dataset.clouds[row["subtype"]]
    motion = Rigid(*poses(cloud, row, network.times_s), cloud.points, cloud.part)
    aim = np.array([row["x_m"], row["y_m"], row["z_m"]])
    signal = dataset.maker.signal(row, np.inf)
    cube = dataset.maker.cubes(row, np.inf, signal)[1]
    expected = pointwise_echo.range_cells(network, network.stations[1], motion, cloud.rcs_m2, aim)
    assert abs(cube.cells - expected).max() < 1e-7 * abs(expected).max()
    assert (cube.chosen == abs(expected).argmax(axis=1)).all() and (cube.signal == signal[1]).all()


def test_noise_has_the_power_of_the_snr_in_every_cell_and_streams_of_its_own(dataset):
    row = dataset.row(dataset.place(1))
    maker = dataset.maker
    signal, clean = maker.signal(row, 3.0), maker.signal(row, np.inf)
    noisy = maker.cubes(row, 3.0, signal)
    silent = maker.cubes(row, np.inf, clean)
    drawn = [cube.cells - still.cells for cube, still in zip(noisy, silent, strict=True)]
    for place, noise in enumerate(drawn):
        power = np.mean(abs(clean[place]) ** 2) / 10**0.3
        np.testing.assert_allclose(np.mean(abs(noise) ** 2), power, rtol=0.02)
        assert abs(np.mean(noise[:, 0] * noise[:, 1].conj())) < 0.2 * power
        assert (noisy[place].signal == signal[place]).all()
    assert not np.allclose(drawn[0] / abs(drawn[0]).max(), drawn[1] / abs(drawn[1]).max(), atol=0.1)
    again = maker.cubes(row, 3.0, signal)
    assert all((cube.cells == other.cells).all() for cube, other in zip(noisy, again, strict=True))
    other = Cubes.from_settings(
        {"seed": 6, "network": dataset.config["network"], "tolerance": None, "effects": {}},
        dataset.clouds,
    ).of(row, 3.0, maker.network.stations[0], signal[0])
    same = abs(other.cells - noisy[0].cells).max(axis=0) == 0
    assert not same.any() and (other.signal == signal[0]).all()


def test_noise_of_cells_passes_the_canceller_as_the_signal_s_does(dataset):
    maker = Dataset(dataset.config | {"effects": LAND}, dataset.clouds).maker
    row = dataset.row(dataset.place(1))
    quiet, noisy = (cubes_of_row(maker, row, snr)[0] for snr in (np.inf, 3.0))
    power = maker.received(row)[1][0, 0]
    rng = stream(dataset.plan.seed, "cells", row["subtype"], row["model"], "A", 3.0)
    white = add_noise(np.zeros(quiet.cells.shape), 3.0, rng, power)
    expected = canceller.filtered({**canceller.DEFAULTS, "kind": "mean"}, white)
    others = np.arange(512) != quiet.chosen[:, None]
    assert abs((noisy.cells - quiet.cells - expected)[others]).max() < 1e-6 * abs(expected).max()


def test_truth_is_the_middle_of_the_target_as_each_station_sees_it(dataset):
    place = dataset.place(1)
    row = dataset.row(place)
    record = dataset.record(1)
    network = dataset.maker.network
    for station, cube in zip(network.stations, dataset.cubes(1), strict=True):
        seen = record["geometry"][station.name]
        assert abs(truth(cube, "range_m")[0] - seen["range_m"]) < 0.2
        for name in ("psi", "omega"):
            assert abs(truth(cube, name)[0] - seen[name]) < 1e-3
        moved = np.gradient(truth(cube, "range_m"), network.times_s, edge_order=2)
        np.testing.assert_allclose(truth(cube, "radial_mps"), moved, atol=1e-6 * abs(moved).max())
        cells = np.rint(truth(cube, "range_m") / network.cell_m) % network.subcarriers
        assert (truth(cube, "cell") == cells).all() and np.mean(abs(cells - cube.chosen) <= 1) > 0.9
    assert row["subtype"] == place.subtype


def test_a_range_doppler_map_peaks_at_the_range_and_folded_speed_of_an_echo():
    symbols = 400
    interval_s = 2.5e-3
    cells = 64
    wavelength_m = SPEED_OF_LIGHT / 4.9e9
    times = np.arange(symbols) * interval_s
    fold = wavelength_m / (4 * interval_s)
    settings = range_doppler.Settings(9, 512)
    for speed_mps in (-4.0, 0.0, 2.5, 9.0):
        held = np.zeros((symbols, cells), np.complex64)
        held[:, 22] = 3 * np.exp(-4j * np.pi * speed_mps * times / wavelength_m)
        found = range_doppler.definition(
            Cube(held, np.full(symbols, 20), np.zeros((symbols, len(TRUTH)))), settings
        )
        row, column = np.unravel_index(found.argmax(), found.shape)
        folded = (speed_mps + fold) % (2 * fold) - fold
        speeds = -np.fft.fftshift(np.fft.fftfreq(512, interval_s))[::-1] * wavelength_m / 2
        assert row == 4 + 2 and abs(speeds[column] - folded) < 2 * fold / 512
        assert 2.7 < found.max() <= 3.001  # between two speeds a Hann window loses up to a tenth


def test_a_range_profile_is_the_mean_power_around_the_chosen_cells():
    rng = np.random.default_rng(1)
    cells = (rng.normal(size=(40, 16)) + 1j * rng.normal(size=(40, 16))).astype(np.complex64)
    cube = Cube(cells, rng.integers(0, 16, 40), np.zeros((40, len(TRUTH))))
    for settings in (hrrp.Settings(1, 1, 9), hrrp.Settings(5, 3, 9)):
        found = hrrp.definition(cube, settings)
        for column in (0, 7, found.shape[1] - 1):
            powers = [
                [abs(cells[n, (cube.chosen[n] + step) % 16]) ** 2 for step in range(-4, 5)]
                for n in range(column, column + settings.window)
            ]
            np.testing.assert_allclose(found[:, column] ** 2, np.mean(powers, axis=0), rtol=1e-5)


def test_axes_are_metres_and_metres_a_second(dataset):
    network, station = dataset.maker.network, dataset.maker.network.stations[0]
    (_, left, right), (_, low, high) = range_doppler.axes(
        range_doppler.Settings(9, 512), network, station
    )
    # Bins begin one above the negative end, at which speeds fold; the carrier is that of the middle
    # subcarrier.
    middle_hz = station.frequency_hz + 511 / 2 * 480e3
    assert right == pytest.approx(SPEED_OF_LIGHT / (4 * middle_hz * network.symbol_interval_s))
    assert left == pytest.approx(-right * 255 / 256)
    assert high == -low == pytest.approx(4 * SPEED_OF_LIGHT / (2 * 512 * 480e3))
    assert hrrp.axes(hrrp.Settings(2, 1, 9), network, station)[0][2] == pytest.approx(398 * 2.5e-3)


@pytest.mark.parametrize("name", sorted(SHOWN))
def test_images_of_cells_are_the_resampled_definition(dataset, name):
    renderer = Renderer.from_settings(render_blocks(dataset.config))
    cube = cubes_of_row(dataset.maker, dataset.row(dataset.place(0)), SNRS[0])[1]
    found = np.empty((32, 32), np.float32)
    renderer.values(cube, 1, name, found)
    values = spectrum(name).definition(cube, renderer.spectra[name])
    expected = triangle(len(values), 32) @ values @ triangle(values.shape[1], 32).T
    # The largest range is on top.
    np.testing.assert_allclose(found, expected[::-1], atol=1e-5 * values.max())


def test_a_signal_alone_gives_no_image_of_cells(dataset):
    renderer = Renderer.from_settings(render_blocks(dataset.config))
    signals = np.ones((3, renderer.network.symbols), np.complex64)
    for ask in (lambda: renderer.tile(signals), lambda: renderer.some(signals, [3])):
        with pytest.raises(InputError, match="made of range cells, and a signal alone"):
            ask()
    assert renderer.some(signals, [0]).shape == (1, 32, 32)


@pytest.mark.parametrize("cells", [4, 1, 2.5, True])
def test_cells_have_a_middle_and_neighbours(cells):
    for make in (lambda: hrrp.Settings(1, 1, cells), lambda: range_doppler.Settings(cells, 512)):
        with pytest.raises(InputError, match=r"cells is"):
            make()


def test_images_of_cells_ask_for_a_band_with_enough_cells_and_speeds_for_all_symbols():
    Spectra(hrrp=hrrp.Settings(1, 1, 511)).check(400, 3, 512)
    with pytest.raises(InputError, match="513, expected at most the 512"):
        Spectra(hrrp=hrrp.Settings(1, 1, 513)).check(400, 3, 512)
    with pytest.raises(InputError, match="points is 256, expected at least the 400"):
        Spectra(range_doppler=range_doppler.Settings(9, 256)).check(400, 3, 512)
    assert spectrum("range_doppler") is range_doppler


def test_symbols_that_were_not_received_are_zeros(dataset):
    gaps = {"slow_time": {"tdd_period_s": 0.01, "downlink": 0.75}}
    maker = Dataset(dataset.config | {"effects": gaps}, dataset.clouds).maker
    row = dataset.row(dataset.place(1))
    signal = maker.signal(row, np.inf)
    cube = maker.cubes(row, np.inf, signal)[0]
    lost = cube.chosen < 0
    assert (
        0 < lost.sum() < len(lost)
        and not cube.cells[lost].any()
        and cube.cells[~lost].any(axis=1).all()
    )
    assert (cube.signal == signal[0]).all()


@pytest.mark.parametrize("number", ["complex64", "int16"])
def test_each_target_in_the_beam_has_a_truth_of_its_own_which_shards_keep(dataset, number):
    company = {"companions": {"subtypes": ["Owl"], "count": [2, 2], "spread_m": 8.0}}
    settings = {
        "seed": 1,
        "network": dataset.config["network"],
        "tolerance": None,
        "effects": company,
    }
    row = dataset.row(dataset.place(1))
    network = dataset.maker.network
    # The labelled target reflects nothing, so what is seen is a companion.
    makers = [Cubes.from_settings(settings, dataset.clouds, empty=dark) for dark in (True, False)]
    dark, whole = (maker.of(row, np.inf, network.stations[0]) for maker in makers)
    assert len(dark.others) == 2 and (dark.truth == whole.truth).all()
    cell = TRUTH.index("cell")
    seen = abs(dark.cells).argmax(axis=1)
    assert min(np.median(abs(other[:, cell] - dark.truth[:, cell])) for other in dark.others) > 4
    assert (
        np.mean(np.min([abs(seen - other[:, cell]) for other in dark.others], axis=0) <= 2) > 0.95
    )
    stored, facts = of_cubes([whole], replace(network, stations=network.stations[:1]), number)
    (back,) = cubes_of({"cube": facts}, np.lib.format.read_array(io.BytesIO(stored)))
    for kept, other in zip((back.truth, *back.others), (whole.truth, *whole.others), strict=True):
        np.testing.assert_allclose(kept, other, atol=5.1e-7)
