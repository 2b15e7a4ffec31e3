"""The echo's hard cases by name, each judged in 50 digits: right cell, small error, a bound that holds.

The cases stand in `tests/support/hard_cases.py`.
"""

import numpy as np
import pytest

import reference
from hard_cases import CASES, away, cluster, judged, network
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo import Path, echo_signal
from lowalt.files.errors import BelowFloor

C = SPEED_OF_LIGHT
NET = network()
CELL = NET.cell_m


@pytest.mark.parametrize("name", CASES)
def test_hard_case(name):
    ours, truth, right, bound = judged(name)
    error = abs(ours - truth) / abs(truth)
    assert right
    assert error < 1e-9 and error <= bound


def test_a_hundred_thousand_points():
    net, points = NET, np.repeat(cluster(130, 50), 2000, axis=0)
    result = echo_signal(net, net.stations[0], points[None], 1.0, away(128))
    truth = reference.cell_mp(
        net, net.stations[0], points[::2000].tolist(), [2000.0**2] * 50, away(128), result.cell[0]
    )
    assert abs(result.signal[0] - truth) < 1e-11 * abs(truth)


def test_all_points_cancel():
    paths = [Path(0.0, 1.0), Path(0.0, -1.0)]
    result = echo_signal(NET, NET.stations[0], cluster(90)[None], 1.0, away(90), paths=paths)
    direct = echo_signal(NET, NET.stations[0], cluster(90)[None], 1.0, away(90))
    assert abs(result.signal[0]) < 1e-14 * abs(direct.signal[0]) and result.bound > 1
    nothing = echo_signal(NET, NET.stations[0], cluster(90)[None], 0.0, away(90))
    assert nothing.signal[0] == 0 and nothing.cell[0] == 0


def test_doppler_exactly_at_the_edge_of_the_band():
    net = NET
    centre = 4.9e9 + 127.5 * 120e3
    for speed in (1.0, -1.0):
        step = speed * C / (4 * centre)
        x = 30 * CELL + step * np.arange(40)
        path = np.stack([x, 0 * x, 0 * x + 25.0], axis=1)[:, None]
        result = echo_signal(net, net.stations[0], path, 1.0, path[0, 0])
        assert len(set(result.cell)) == 1
        turn = np.angle(-result.signal[1:] / result.signal[:-1])
        assert abs(turn).max() < 1e-9


def test_a_million_symbols_do_not_drift():
    n = np.arange(1_000_000)
    angle = 2 * np.pi * ((n * 137) % 1000) / 1000
    path = np.stack([100 + 0.2 * np.cos(angle), 0.2 * np.sin(angle), 0 * angle + 25.0], axis=1)[:, None]
    result = echo_signal(NET, NET.stations[0], path, 1.0, (100.0, 1.0, 25.0))
    # Symbols a whole number of turns apart hold equal positions, so their values are equal to rounding.
    late, early = result.signal[-1000:], result.signal[:1000]
    assert abs(late - early).max() < 1e-13 * abs(early).max()
    truth = reference.cell_mp(NET, NET.stations[0], path[-1].tolist(), [1.0], (100.0, 1.0, 25.0), result.cell[-1])
    assert abs(result.signal[-1] - truth) < 1e-12 * abs(truth)


@pytest.mark.parametrize("tolerance", [1e-16, 1e-14])
def test_a_tolerance_below_the_floor_is_refused(tolerance):
    with pytest.raises(BelowFloor, match="below the floor"):
        echo_signal(NET, NET.stations[0], cluster(130)[None], 1.0, away(128), tolerance)
