"""Other methods for the echo (`lowalt.measure`), each against sums in fifty digits."""

import sys
from pathlib import Path

import numpy as np
import pytest

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo import echo_signal
from lowalt.echo.echo_input import Rigid
from lowalt.measure import echo_baselines, fifty_digits

sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
import echo_scenes

STATION = Station("B", (30.0, -12.0, 21.0), 0.7, 4.93e9)


def small(subcarriers):
    """A radar of odd sizes. Its station faces 0.7 rad from the x axis and has another carrier than
    the network.
    """
    return Network(4.9e9, 120e3, subcarriers, 10, 2.5e-3, 3, (3, 2), (2, 5), 1.7, (STATION,))


def turning():
    """Two parts that turn and move between three symbols: motion, cross sections (m^2) and aim (m)."""
    angles = np.array([[0.0, 0.4], [0.3, 0.1], [0.9, -0.2]])
    rotation = np.zeros((3, 2, 3, 3))
    rotation[..., 0, 0] = rotation[..., 1, 1] = np.cos(angles)
    rotation[..., 1, 0], rotation[..., 0, 1], rotation[..., 2, 2] = (
        np.sin(angles),
        -np.sin(angles),
        1,
    )
    translation = np.array([90.0, 35.0, 40.0]) + np.arange(18).reshape(3, 2, 3) / 3
    points = np.array([[0.4, 0.1, -0.2], [-0.3, 0.8, 0.1], [0.2, -0.5, 0.6], [700.0, 9.0, 1.0]])
    motion = Rigid(rotation, translation, points, np.array([0, 0, 1, 1]))
    return motion, np.array([0.5, 1.0, 0.2, 300.0]), np.array([95.0, 36.0, 44.0])


def places(motion):
    """Positions (N, L, 3) m, a point at a time."""
    return np.array(
        [
            [
                motion.rotation[n, part] @ point + motion.translation[n, part]
                for point, part in zip(motion.points, motion.part, strict=True)
            ]
            for n in range(len(motion.rotation))
        ]
    )


@pytest.mark.parametrize("count", [37, 16, 33, 1])
def test_every_method_has_the_strongest_of_the_cells_in_fifty_digits(count):
    """The last point lies many unambiguous ranges away."""
    network = small(count)
    given = turning()
    motion, rcs, aim = given
    truth = []
    for n in range(3):
        at = fifty_digits.positions_mp(motion, n)
        np.testing.assert_allclose(np.array(at, float), places(motion)[n], rtol=1e-13)
        cells = [
            complex(cell)
            for cell in fifty_digits.cells_mp(network, STATION, at, rcs.tolist(), aim, range(count))
        ]
        judge = echo_scenes.judge(network, STATION, *given, n)
        np.testing.assert_allclose(judge, cells, atol=1e-11 * max(map(abs, cells)), rtol=0)
        truth.append(max(cells, key=abs))
    np.testing.assert_allclose(echo_signal(network, STATION, *given).signal, truth, rtol=1e-9)
    np.testing.assert_allclose(echo_baselines.closed(network, STATION, *given), truth, rtol=1e-9)
    single = echo_baselines.closed(network, STATION, *given, np.float32)
    assert single.dtype == np.complex64 and 1e-7 < abs(single / truth - 1).max() < 0.1
    pytest.importorskip("finufft")
    np.testing.assert_allclose(
        echo_baselines.finufft(network, STATION, *given, 1e-12), truth, rtol=1e-8
    )


def test_light_is_as_fast_in_fifty_digits():
    assert fifty_digits.C == SPEED_OF_LIGHT
