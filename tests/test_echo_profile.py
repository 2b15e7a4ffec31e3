"""Range profiles against sums over subcarriers, and their laws."""

import numpy as np
import pytest

import reference
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo import echo_matrix, echo_signal, range_profile
from lowalt.files.errors import InputError
from test_echo import cloud_in_motion, network, positions, relative

WIDE = {"subcarrier_spacing_hz": 480e3, "subcarriers": 1024}
"""A band of 491.52 MHz: cells of 0.305 m."""


def window(matrix: np.ndarray, tracked: np.ndarray, cells: int) -> np.ndarray:
    """The cells (N, cells) around the tracked ones of a matrix (N, M), modulo M."""
    offsets = np.arange(cells) - cells // 2
    return np.take_along_axis(matrix, (tracked[:, None] + offsets) % matrix.shape[1], axis=1)


@pytest.mark.parametrize(
    "changes, cells", [({}, 33), (WIDE, 33), (WIDE, 1023), ({"subcarriers": 7}, 7), ({"subcarriers": 1}, 1)]
)
@pytest.mark.parametrize("centre", [(180.0, 120.0, 60.0), (0.4, 0.3, 25.2)])
def test_a_profile_is_the_inverse_dft_of_the_sum_over_points_at_each_subcarrier(changes, cells, centre):
    """The second target lies around the station, so that cells below 0 come in, which are those at the other end."""
    net = network(**changes)
    motion = cloud_in_motion(np.random.default_rng(3), 5, 40, centre, 1.5, 30.0)
    given = net, net.stations[1 if centre[0] > 1 else 0], motion, np.linspace(0.2, 2, 40), motion.translation[0, 0]
    found = range_profile(*given, cells)
    subcarriers = echo_matrix(*given, "subcarriers")
    turn = np.outer(*[np.arange(net.subcarriers)] * 2) % net.subcarriers / net.subcarriers
    truth = subcarriers @ np.exp(2j * np.pi * turn) / net.subcarriers
    assert relative(found.values, window(truth, found.cell, cells)) < 1e-12


def test_a_profile_is_that_of_the_paper_s_steering_vectors():
    net = network(**WIDE)
    motion = cloud_in_motion(np.random.default_rng(4), 3, 12, (180.0, 120.0, 60.0), 1.5, 30.0)
    rcs, aim = np.linspace(0.2, 2, 12), motion.translation[0, 0]
    truth = reference.range_cells(net, net.stations[0], positions(motion), rcs, aim)
    found = range_profile(net, net.stations[0], motion, rcs, aim, 21)
    assert relative(found.values, window(truth, abs(truth).argmax(axis=1), 21)) < 1e-9


def test_the_strongest_cell_is_in_the_middle_and_holds_the_echo_s_signal():
    net = network(**WIDE)
    motion = cloud_in_motion(np.random.default_rng(5), 50, 200, (180.0, 120.0, 60.0), 1.5, 30.0)
    given = net, net.stations[0], motion, 1.0, motion.translation[0, 0]
    found, signal = range_profile(*given, 41), echo_signal(*given)
    assert relative(found.values[:, 20], signal.signal) < 1e-12 and (found.cell == signal.cell).all()
    assert (abs(found.values).argmax(axis=1) == 20).all() and len(set(found.cell)) > 10


@pytest.mark.parametrize("past", [0.0, 0.25, 0.499])
def test_a_point_has_the_peak_and_width_of_the_band(past):
    """Of a point on the axis of both beams, `past` cells beyond the centre of a cell, each cell is a known share."""
    net = network(**WIDE, symbols=1)
    station = net.stations[0]
    cell_m = SPEED_OF_LIGHT / (2 * 1024 * 480e3)
    assert 0.30 < cell_m < 0.31
    distance = (600 + past) * cell_m
    place = np.array(station.position_m) + distance * np.array([0.6, 0.8, 0.0])
    found = abs(range_profile(net, station, place[None, None], 1.0, place, 65).values[0])
    amplitude = np.sqrt(64.0 * 64.0) * SPEED_OF_LIGHT / 4.9e9 / ((4 * np.pi) ** 1.5 * distance**2)
    offsets = np.arange(65) - 32 - past
    share = np.sinc(offsets) / np.sinc(offsets / 1024)
    assert relative(found, amplitude * abs(share)) < 1e-9
    # Half a cell from the centre a point is 3.9 dB down, so its width at that level is one cell.
    if past == 0.499:
        assert found[32] == pytest.approx(amplitude * 2 / np.pi, rel=2e-3)


def test_a_profile_of_all_cells_has_the_energy_of_the_subcarriers():
    """Parseval: the mean over subcarriers of |y|^2 is the sum over cells of |Y|^2."""
    net = network(subcarriers=255, subcarrier_spacing_hz=480e3)
    motion = cloud_in_motion(np.random.default_rng(6), 8, 60, (180.0, 120.0, 60.0), 1.5, 30.0)
    given = net, net.stations[1], motion, 1.0, motion.translation[0, 0]
    cells = (abs(range_profile(*given, 255).values) ** 2).sum(axis=1)
    np.testing.assert_allclose(cells, (abs(echo_matrix(*given, "subcarriers")) ** 2).mean(axis=1), rtol=1e-12)


@pytest.mark.parametrize("cells", [0, 2, -1, 257, 3.0, True])
def test_a_number_of_cells_that_has_no_middle_or_exceeds_the_band_is_refused(cells):
    net = network()
    place = np.full((1, 1, 3), 100.0)
    with pytest.raises(InputError, match="expected an odd number from 1 to the 256"):
        range_profile(net, net.stations[0], place, 1.0, place[0, 0], cells)


def test_a_point_in_the_station_and_a_link_are_refused_as_for_the_echo():
    net = network()
    place = np.array(net.stations[0].position_m)[None, None]
    with pytest.raises(InputError, match="place of station A"):
        range_profile(net, net.stations[0], place, 1.0, np.ones(3), 3)
