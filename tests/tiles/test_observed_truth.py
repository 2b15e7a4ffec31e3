"""The observed truth: where echoes appear in range cells and speeds, in all scenes.

It is read back out of the cubes.
"""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.spectra import Fourier, spectrum
from lowalt.spectra.cube import TRUTH
from lowalt.spectra.kinds import range_doppler
from lowalt.tiles.cubes import Cubes

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "benchmarks"))
import observed_truth  # noqa: E402

SCENES = [
    *sorted(path.stem for path in (ROOT / "config/scenes").glob("*.yaml")),
    *observed_truth.FURTHER,
]
QUICK = {"worst", "fmcw", "frames", "links, 0.017 ppm", "continuous wave"}
TIE = 0.505
"""Half a cell or speed, and what a tie between two needs."""


@pytest.mark.parametrize("symbols", [64, 65])
@pytest.mark.parametrize(
    "name",
    [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in SCENES],
)
def test_an_echo_peaks_within_half_a_cell_and_half_a_speed_of_the_observed_truth(name, symbols):
    config = observed_truth.block_of(ROOT, name)
    found = np.array(observed_truth.distances(config, name, symbols, 2))[:, :2]
    assert found.shape == (2 * len(config["network"]["stations"]), 2)
    assert found.max() <= TIE


@pytest.mark.parametrize("symbols", [100, 101])
def test_one_speed_axis_reads_a_sweep_of_speeds_in_maps_and_spectra(symbols):
    config = observed_truth.block_of(ROOT, "paper")
    network = Network.from_settings(config["network"] | {"symbols": symbols})
    cubes = Cubes(observed_truth.Scene(network, 1, None, ()), {"Point": observed_truth.point()})
    # One point passes over the middle of each station's face at 4 km, where the radial speed stays
    # what it is.
    for station in network.stations:
        away = np.array([np.cos(station.normal_rad), np.sin(station.normal_rad), 0.0])
        for number, speed_mps in enumerate(np.linspace(-40, 40, 9)):
            place = station.position_m + 4000 * away
            velocity = speed_mps * away
            row = observed_truth.course(network, "sweep", number) | {"model": number}
            row |= {f"{axis}_m": place[i] for i, axis in enumerate("xyz")}
            row |= {f"v{axis}_mps": velocity[i] for i, axis in enumerate("xyz")}
            cube = cubes.of(row, np.inf, station)
            shown_mps = network.folded_mps(speed_mps, station)
            step_mps = 2 * network.largest_mps(station) / symbols
            assert abs(cube.truth[:, TRUTH.index("observed_mps")] - shown_mps).max() < 1e-6
            doppler = range_doppler.definition(cube, range_doppler.Settings(17, symbols))
            column = np.unravel_index(doppler.argmax(), doppler.shape)[1]
            strongest_mps = network.bin_speeds_mps(symbols, station)[column]
            assert abs(network.folded_mps(strongest_mps - shown_mps, station)) <= TIE * step_mps
            settings = Fourier(64, 1, 64)
            held = cube.cells[:, int(cube.truth[symbols // 2, TRUTH.index("cell")])].astype(complex)
            image = spectrum("vrp").definition(held, settings, "vrp", 0.0, 0.0)
            first, last = spectrum("vrp").speeds(settings, network, station)
            seen_mps = np.linspace(first, last, 64)[image[:, 0].argmax()]
            assert (
                abs(network.folded_mps(seen_mps - shown_mps, station)) <= TIE * (first - last) / 63
            )


@pytest.mark.parametrize("shape", [(8, 8), (1, 1)])
def test_the_observed_speed_is_the_rate_of_the_echo_s_phase_to_a_tenth_of_a_millimetre(shape):
    """A point close by moves across the face, so that the arrays' middles change the rate by 2 cm/s."""
    config = observed_truth.block_of(ROOT, "paper")
    network = Network.from_settings(config["network"] | {"symbols": 33})
    network = replace(network, transmit=shape, receive=shape)
    cubes = Cubes(observed_truth.Scene(network, 1, None, ()), {"Point": observed_truth.point()})
    for station in network.stations:
        away = np.array([np.cos(station.normal_rad), np.sin(station.normal_rad), 0.0])
        aside = np.array([-away[1], away[0], 0.0])
        position_m = station.position_m + 60 * away + 10 * aside
        row = observed_truth.course(network, "across", 0) | {"model": 0}
        row |= dict(zip(("x_m", "y_m", "z_m"), position_m, strict=True))
        row |= dict(zip(("vx_mps", "vy_mps", "vz_mps"), 12 * aside, strict=True))
        cube = cubes.of(row, np.inf, station)
        cell = int(cube.truth[16, TRUTH.index("cell")])
        turns = np.unwrap(np.angle(cube.cells[:, cell])) / (2 * np.pi)
        doppler_hz = np.gradient(turns, network.symbol_interval_s, edge_order=2)
        wavelength_m = SPEED_OF_LIGHT / network.effective_hz(station)
        speed_mps = network.folded_mps(-doppler_hz * wavelength_m / 2, station)
        assert abs(speed_mps - cube.truth[:, TRUTH.index("observed_mps")]).max() < 1e-4


def test_geometric_truth_stays_where_the_target_is_while_clocks_move_its_echo():
    config = observed_truth.block_of(ROOT, "links")
    network = Network.from_settings(config["network"] | {"symbols": 16})
    row = observed_truth.course(network, "links", 0)
    point = {"Point": observed_truth.point()}
    scenes = {}, {"link_offset": {"sigma_ppm": 0.0, "sigma_s": 1e-6}}
    still, moved = (
        Cubes(observed_truth.Scene(network, 1, None, tuple(observed_truth.called(effects))), point)
        .of(row, np.inf, network.station("A-B"))
        .truth
        for effects in scenes
    )
    assert (moved[:, :5] == still[:, :5]).all()
    # Clocks of 1 us move echoes by several cells of 0.13 us, as strongest cells show in the law
    # above.
    assert abs(moved[:, 5] - still[:, 5]).min() > 3 and (moved[:, 6] == still[:, 6]).all()
