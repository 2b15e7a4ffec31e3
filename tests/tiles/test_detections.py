"""Detections: an echo is found where it is and called true, and noise alone passes at the rate asked for."""

import numpy as np
import pytest

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.errors import InputError
from lowalt.shards.dataset import Dataset
from lowalt.spectra.cube import TRUTH, Cube
from lowalt.tiles.cubes import Cubes
from lowalt.tiles.detections import detections
from small_configuration import configuration


@pytest.fixture(scope="module")
def dataset():
    config = configuration()
    config["targets"]["select"] = ["DJI Mini 2"]
    return Dataset(config)


def noise(network, seed=1):
    rng = np.random.default_rng(seed)
    shape = (network.symbols, network.subcarriers)
    return (rng.normal(size=shape) + 1j * rng.normal(size=shape)).astype(np.complex64)


def held(network, cells, cell, speed_mps):
    truth = np.zeros((network.symbols, len(TRUTH)))
    truth[:, TRUTH.index("cell")] = truth[:, TRUTH.index("observed_cell")] = cell
    truth[:, TRUTH.index("observed_mps")] = speed_mps
    return Cube(cells, np.full(network.symbols, 40), truth)


def test_noise_alone_passes_at_the_rate_asked_for(dataset):
    network = dataset.maker.network
    for rate, cfar in ((1e-2, "cell_averaging"), (1e-3, "cell_averaging"), (1e-2, "ordered_statistic")):
        found = [
            detections(held(network, noise(network, n), 0, 0), network, network.stations[0], rate, cfar=cfar)
            for n in range(3)
        ]
        # A value is a detection only where none of its eight neighbours, which the window makes alike, is larger.
        per_value = np.mean([len(each) for each in found]) / (network.symbols * network.subcarriers)
        assert 0.4 * rate < per_value < 1.1 * rate


@pytest.mark.parametrize("speed_mps", [-3.0, 2.0, 8.0])
def test_an_echo_in_noise_is_found_at_its_range_and_folded_speed(dataset, speed_mps):
    network = dataset.maker.network
    station = network.stations[0]
    cells = noise(network)
    turns = 4 * np.pi * speed_mps * network.times_s * network.effective_hz(station) / SPEED_OF_LIGHT
    cells[:, 51] += np.exp(-1j * turns)
    best = detections(held(network, cells, 51, speed_mps), network, station)[0]
    fold = SPEED_OF_LIGHT / (4 * network.effective_hz(station) * network.symbol_interval_s)
    assert best["true"] and best["cell"] == 51 and best["range_m"] == pytest.approx(51 * network.cell_m)
    assert abs(best["radial_mps"] - ((speed_mps + fold) % (2 * fold) - fold)) <= 2 * fold / network.symbols
    # A Hann window spreads the noise of 2 over 400 symbols, 1.5 times as much as none: 21 dB below an echo of 1.
    assert best["over_db"] == pytest.approx(10 * np.log10(network.symbols / (2 * 1.5)), abs=2)
    wrong = detections(held(network, cells, 54, speed_mps), network, station)[0]
    assert wrong["cell"] == 51 and not wrong["true"]
    # Ranges wrap around: the first cell follows the last.
    wrapped = detections(held(network, np.roll(cells, -52, axis=1), 0, speed_mps), network, station)[0]
    assert wrapped["cell"] == network.subcarriers - 1 and wrapped["true"]


def test_a_target_longer_than_the_guard_hides_itself(dataset):
    network = dataset.maker.network
    cells = noise(network)
    cells[:, 49:54] += 1
    for guard, seen in ((0, False), (4, True)):
        found = detections(held(network, cells, 51, 0), network, network.stations[0], 1e-4, guard, training=2)
        assert (abs(found["cell"][found["over_db"] > 15] - 51) <= 2).any() == seen


def test_a_weaker_neighbour_of_one_speed_is_seen_by_an_ordered_threshold_behind_a_range_window(dataset):
    network, station = dataset.maker.network, dataset.maker.network.stations[0]
    cells, steps = noise(network), np.arange(network.subcarriers)
    for cell, level in ((51.5, 30.0), (58.0, 1.0)):
        # An echo between two cells: its frequency response turns by a whole number and a half over the subcarriers.
        cells += level * np.fft.ifft(np.exp(-2j * np.pi * steps * cell / network.subcarriers))
    for cfar, window, seen in (
        ("cell_averaging", "none", False), ("cell_averaging", "hann", False),
        ("ordered_statistic", "none", False), ("ordered_statistic", "hann", True),
    ):  # fmt: skip
        found = detections(held(network, cells, 58, 0), network, station, cfar=cfar, range_window=window)
        assert found["true"].any() == seen, (cfar, window)
    with pytest.raises(InputError, match=r"cfar: 'ordered', expected one of cell_averaging, ordered_statistic"):
        detections(held(network, cells, 58, 0), network, station, cfar="ordered")
    with pytest.raises(InputError, match="guard: 1, expected at least 2"):
        detections(held(network, cells, 58, 0), network, station, guard=1, range_window="hann")


def test_a_target_is_detected_and_the_same_look_without_it_is_empty(dataset):
    place = dataset.place(0)
    row, network = dataset.row(place), dataset.maker.network
    settings = {"seed": 1, "network": dataset.config["network"], "tolerance": None, "effects": {}}
    for empty in (False, True):
        cube = Cubes.from_settings(settings, dataset.clouds, empty=empty).of(row, 3.0, network.stations[1])
        found = detections(cube, network, network.stations[1], 1e-6)
        assert found["true"].any() != empty and len(found) < 1000
