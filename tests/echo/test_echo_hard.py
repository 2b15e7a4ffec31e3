"""The echo's hard cases by name, each judged in 50 digits.

Each has the right cell, a small error and a bound that holds.

The cases stand in `tests/support/hard_cases.py`.
"""

import numpy as np
import pytest

import reference
from hard_cases import CASES, away, cluster, judged, network
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo import echo_signal

C = SPEED_OF_LIGHT
NET = network()
CELL = NET.cell_m


@pytest.mark.parametrize("name", CASES)
def test_hard_case(name):
    ours, truth, right, bound = judged(name)
    error = abs(ours - truth) / abs(truth)
    assert right
    assert error < 1e-9 and error <= bound


def seen(name):
    """Ranges (m) of a case's points and of its aim, and direction cosines across and up.

    All are dot products.
    """
    case = CASES[name]
    assert case.station.position_m == (0.0, 0.0, 25.0) and case.station.normal_rad == 0
    places = np.vstack([case.points_m, case.aim_m]) - case.station.position_m
    ranges = np.linalg.norm(places, axis=1)
    return ranges, places[:, 1] / ranges, places[:, 2] / ranges


def test_every_case_is_as_hard_as_its_name_says():
    """Distances in cells and waves, angles and numbers: what makes each case hard."""
    for name in ("straight above", "at the beam's centre"):
        _, across, up = seen(name)
        np.testing.assert_allclose(
            [across, up], [across[:1].repeat(2), up[:1].repeat(2)], rtol=1e-15, atol=0
        )
    np.testing.assert_array_equal(seen("straight above")[1:], [[0, 0], [1, 1]])
    assert (CASES["behind the array"].points_m[:, 0] < -50).all() and CASES[
        "behind the array"
    ].aim_m[0] < 0
    ranges, across, up = seen("on a grating lobe")
    np.testing.assert_allclose(ranges, 100)
    kappa = (
        CASES["on a grating lobe"].station.frequency_hz
        / CASES["on a grating lobe"].network.carrier_hz
    )
    np.testing.assert_allclose(kappa * np.diff(across), -2)
    assert (abs(up) == 0).all()
    cells = {"at a cell's edge": 30.5, "at a cell's centre": 30, "at the unambiguous range": 256}
    for name, wanted in cells.items():
        assert seen(name)[0][:-1] / CELL == pytest.approx([wanted], rel=1e-12)
    assert seen("past the unambiguous range")[0] / CELL == pytest.approx(1.7 * 256, rel=0.1)
    metres = {"at 1 cm": 0.01, "at 100 km": 1e5, "100 km at 77 GHz": 1e5, "one point": 77.7}
    for name, wanted in metres.items():
        assert seen(name)[0][:-1] == pytest.approx(wanted, rel=2e-5)
    at_77_ghz = CASES["100 km at 77 GHz"]
    assert at_77_ghz.station.frequency_hz == at_77_ghz.network.carrier_hz == 77e9
    assert len(CASES["one point"].points_m) == 1
    sizes = np.ptp(CASES["larger than its range"].points_m, axis=0)
    assert sizes.max() > seen("larger than its range")[0][-1]
    # A way there and back that differs by half a wave of the middle subcarrier.
    near, far, _ = seen("deep fade")[0]
    assert far - near == pytest.approx(
        C / (4.9e9 + 127.5 * 120e3) / 4, rel=1e-9
    ) and near == pytest.approx(30.2 * CELL)
    assert abs(judged("deep fade")[0]) < 0.02 * abs(judged("one point")[0])
    for name in CASES.keys() - {
        "on a grating lobe",
        "behind the array",
        "larger than its range",
        "deep fade",
    }:
        _, across, up = seen(name)
        # The beams are about 0.1 wide across and 0.5 upwards.
        assert abs(across - across[-1]).max() < 0.2 and abs(up - up[-1]).max() < 0.3, name


def test_a_hundred_thousand_points():
    net = NET
    points = np.repeat(cluster(130, 50), 2000, axis=0)
    result = echo_signal(net, net.stations[0], points[None], 1.0, away(128))
    truth = reference.cell_mp(
        net, net.stations[0], points[::2000].tolist(), [2000.0**2] * 50, away(128), result.cell[0]
    )
    assert abs(result.signal[0] - truth) < 1e-11 * abs(truth)


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
    path = np.stack([100 + 0.2 * np.cos(angle), 0.2 * np.sin(angle), 0 * angle + 25.0], axis=1)[
        :, None
    ]
    result = echo_signal(NET, NET.stations[0], path, 1.0, (100.0, 1.0, 25.0))
    # Symbols a whole number of turns apart hold equal positions, so their values are equal to
    # rounding.
    late = result.signal[-1000:]
    early = result.signal[:1000]
    assert abs(late - early).max() < 1e-13 * abs(early).max()
    truth = reference.cell_mp(
        NET, NET.stations[0], path[-1].tolist(), [1.0], (100.0, 1.0, 25.0), result.cell[-1]
    )
    assert abs(result.signal[-1] - truth) < 1e-12 * abs(truth)
