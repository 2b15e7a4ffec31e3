"""The cell signal on a torch device: the exact mode's numbers, and faults by name."""

import numpy as np
import pytest

from craft import NETWORK, craft, row
from lowalt.common.errors import InputError
from lowalt.common.network import Network
from lowalt.echo import Rigid, echo_signal
from lowalt.echo.device import device_signal
from lowalt.motion import poses, positions

torch = pytest.importorskip("torch")
DEVICES = ["cpu", *(["cuda"] if torch.cuda.is_available() else [])]


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("change", [{}, {"subcarriers": 3, "transmit_array": [7, 3]}, {"subcarriers": 700}])
def test_numbers_are_those_of_the_exact_mode(device, change, monkeypatch):
    monkeypatch.setattr("lowalt.echo.device.LARGEST_ARRAY", 50_000)
    network = Network.from_settings(NETWORK | change)
    for model, place in enumerate(((200.0, 100.0, 60.0), (3.0, 2.0, 24.0), (40e3, 70e3, 300.0))):
        given = row(model) | dict(zip(("x_m", "y_m", "z_m"), place, strict=True))
        cloud = craft()
        motion = Rigid(*poses(cloud, given, network.times_s), cloud.points, cloud.part)
        for station in network.stations:
            exact = echo_signal(network, station, motion, cloud.rcs_m2, place)
            signal, cell = device_signal(network, station, motion, cloud.rcs_m2, place, device)
            largest = abs(exact.signal).max()
            assert abs(abs(signal) - abs(exact.signal)).max() < 1e-11 * largest
            clear = cell == exact.cell
            assert (~clear).sum() <= exact.near_ties
            assert abs(signal - exact.signal)[clear].max() < 1e-11 * largest


def test_positions_give_what_rigid_parts_give():
    network, cloud = Network.from_settings(NETWORK), craft()
    aim = [row(0)[name] for name in ("x_m", "y_m", "z_m")]
    station = network.stations[0]
    motion = Rigid(*poses(cloud, row(0), network.times_s), cloud.points, cloud.part)
    rigid, _ = device_signal(network, station, motion, cloud.rcs_m2, aim, "cpu")
    plain, _ = device_signal(network, station, positions(cloud, row(0), network.times_s), cloud.rcs_m2, aim, "cpu")
    assert abs(rigid - plain).max() < 1e-9 * abs(rigid).max()


def test_one_point_on_one_part_gives_what_its_places_give():
    network, track = Network.from_settings(NETWORK), np.full((30, 1, 3), 50.0)
    motion = Rigid(np.broadcast_to(np.eye(3), (30, 1, 3, 3)), track, np.zeros((1, 3)), np.zeros(1, int))
    one, two = (device_signal(network, network.stations[0], each, 1.0, track[0, 0], "cpu") for each in (motion, track))
    np.testing.assert_allclose(one[0], two[0], rtol=1e-12)
    np.testing.assert_array_equal(one[1], two[1])


def test_faults_are_named():
    network = Network.from_settings(NETWORK)
    station = network.stations[0]
    track = np.full((30, 2, 3), 50.0)
    with pytest.raises(InputError, match="device is 'abacus'"):
        device_signal(network, station, track, 1.0, [50.0, 50, 50], "abacus")
    track[4, 1] = station.position_m
    with pytest.raises(InputError, match=r"craft: position of point 1 at symbol 4 .*r = 0"):
        device_signal(network, station, track, 1.0, [50.0, 50, 50], "cpu", "craft")
    track[2, 0, 1] = np.nan
    with pytest.raises(InputError, match=r"craft: positions\[2, 0, 1\] is nan"):
        device_signal(network, station, track, 1.0, [50.0, 50, 50], "cpu", "craft")
