"""The echo's hard cases by name, each judged in 50 digits (`reference.cells_mp`), and the table of them.

`PYTHONPATH=tests/support python tests/test_echo_hard.py` prints the table that stands in design/echo.md: the errors of
a naive formula and of ours. The naive formula is the closed form as first written down: angles, sin(N u) / sin(u), one
float64 phase.
"""

import dataclasses
import warnings

import mpmath
import numpy as np
import pytest

import reference
from lowalt.common.errors import BelowFloor
from lowalt.common.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo import Path, echo_signal

C = SPEED_OF_LIGHT


def network(**changes) -> Network:
    station = Station("A", (0.0, 0.0, 25.0), 0.0, changes.get("carrier_hz", 4.9e9))
    base = Network(4.9e9, 120e3, 256, 10, 2.5e-3, 400, (16, 4), (16, 4), 1.0, (station,))
    return dataclasses.replace(base, **changes)


def naive(net, station, points, rcs, aim):
    """Strongest cell's value of one symbol by the textbook closed form."""
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")

        def look(p):
            d = np.asarray(p, float) - np.array(station.position_m)
            r, flat = np.sqrt((d * d).sum(-1)), np.sqrt(d[..., 0] ** 2 + d[..., 1] ** 2)
            theta = np.pi / 2 - np.angle((d[..., 0] + 1j * d[..., 1]) / flat * np.exp(-1j * station.normal_rad))
            phi = np.arcsin(d[..., 2] / r)
            return r, np.cos(phi) * np.cos(theta), np.sin(phi)

        r, psi, omega = look(points)
        _, psi0, omega0 = look(aim)
        kappa = station.frequency_hz / net.carrier_hz
        gain = np.ones(len(r), complex)
        for counts in (net.transmit, net.receive):
            for number, x in zip(counts, (psi - psi0, omega - omega0), strict=True):
                u = np.pi * kappa * x / 2
                gain = gain * np.exp(1j * (number - 1) * u) * np.sin(number * u) / np.sin(u)
        wave = C / net.carrier_hz * np.sqrt(rcs) / (4 * np.pi) ** 1.5 / r**2 * gain
        wave = wave * np.exp(-4j * np.pi * station.frequency_hz * r / C)
        count = net.subcarriers
        x = np.arange(count)[:, None] - r / net.cell_m
        kernel = np.exp(1j * np.pi * (count - 1) / count * x) * np.sin(np.pi * x) / (count * np.sin(np.pi * x / count))
        cells = np.sqrt(net.power / (np.prod(net.transmit) * np.prod(net.receive))) * (kernel @ wave)
        return cells[np.argmax(abs(cells))]


def away(distance, x=1.0, y=0.3, z=0.1):
    """A point at a distance (m) from the station, in the direction (x, y, z)."""
    direction = np.array([x, y, z]) / np.linalg.norm([x, y, z])
    return np.array([0.0, 0.0, 25.0]) + distance * direction


def cluster(distance, count=5, size=0.5, seed=3):
    return away(distance) + np.random.default_rng(seed).normal(scale=size, size=(count, 3))


def grating():
    # kappa = 1.02 puts the first grating lobe, 2 / kappa away from the beam, within sight.
    net = network()
    station = dataclasses.replace(net.stations[0], frequency_hz=1.02 * net.carrier_hz)
    psi0, psi = -0.985, -0.985 + 2 / 1.02
    aim = np.array([100 * np.sqrt(1 - psi0**2), 100 * psi0, 25.0])
    return net, station, np.array([[100 * np.sqrt(1 - psi**2), 100 * psi, 25.0]]), aim


NET = network()
CELL = NET.cell_m
EDGE = np.array([[30.5 * CELL, 0.0, 25.0]])
CENTRE = np.array([[30 * CELL, 0.0, 25.0]])
MAX = C / (2 * 120e3)

# name: (why it is hard, network, station, points, aim)
CASES = {
    "straight above": ("azimuth is 0/0", NET, NET.stations[0], np.array([[0.0, 0.0, 90.0]]), (0.0, 0.0, 80.0)),
    "behind the array": ("angles leave the front half", NET, NET.stations[0], cluster(120) * [-1, 1, 1], (-90, 40, 30)),
    "on a grating lobe": ("sin(N u) / sin(u) is 0/0 away from the beam", *grating()),
    "at the beam's centre": ("sin(N u) / sin(u) is 0/0", NET, NET.stations[0], away(150)[None], away(150)),
    "at a cell's edge": ("two cells tie", NET, NET.stations[0], EDGE, EDGE[0] + [0, 1, 1]),
    "at a cell's centre": ("the cell kernel is 0/0", NET, NET.stations[0], CENTRE, CENTRE[0] + [0, 1, 1]),
    "at the unambiguous range": ("the cell wraps to 0", NET, NET.stations[0], away(MAX)[None], away(1200, y=0.31)),
    "past the unambiguous range": ("the cell wraps", NET, NET.stations[0], cluster(1.7 * MAX), away(2000)),
    "at 1 cm": ("1 / r^2 and direction are extreme", NET, NET.stations[0], away(0.01)[None], away(0.02, y=0.2)),
    "at 100 km": ("2e7 rad of phase", NET, NET.stations[0], cluster(1e5), away(1e5)),
    "100 km at 77 GHz": (
        "3e8 rad of phase", network(carrier_hz=77e9), network(carrier_hz=77e9).stations[0], cluster(1e5, size=0.01),
        away(1e5),
    ),
    "one point": ("nothing to average", NET, NET.stations[0], away(77.7)[None], away(77, y=0.32)),
    "arrays of 7 x 3 and 25 x 1": (
        "no powers of two", network(transmit=(7, 3), receive=(25, 1)), NET.stations[0], cluster(90), away(88),
    ),
    "arrays of 256": ("recurrences lose digits", network(transmit=(256, 1)), NET.stations[0], cluster(300), away(299)),
    "M = 1": ("one cell for all", network(subcarriers=1), NET.stations[0], cluster(90), away(88)),
    "M = 2": ("cells tie by symmetry", network(subcarriers=2), NET.stations[0], cluster(90), away(88)),
    "M = 3300": ("cells of 0.4 m", network(subcarriers=3300), NET.stations[0], cluster(90, size=0.1), away(88)),
    "larger than its range": ("no expansion in size / range", NET, NET.stations[0], cluster(3, size=4), away(3)),
    "deep fade": (
        "half a wave apart: the sum all but cancels", NET, NET.stations[0],
        np.array([[30.2 * CELL, 0, 25.0], [30.2 * CELL + C / (4.9e9 + 127.5 * 120e3) / 4, 0, 25.0]]), (150, 1, 25),
    ),
}  # fmt: skip


def judged(name):
    """Return (our value, the naive one, the true one in our cell, whether that cell is right, our bound) of a case."""
    _, net, station, points, aim = CASES[name]
    rcs = np.linspace(0.5, 1.5, len(points)) if len(points) != 2 else np.ones(2)
    result = echo_signal(net, station, points[None], rcs, aim)
    ours, cell = result.signal[0], int(result.cell[0])
    # All cells about the target and some of the others: far cells of one cluster cannot be the strongest.
    near = {(cell + j) % net.subcarriers for j in range(-2, 3)} | set(
        range(0, net.subcarriers, max(1, net.subcarriers // 7))
    )
    values = reference.cells_mp(net, station, points.tolist(), rcs.tolist(), aim, sorted(near))
    strength = dict(zip(sorted(near), [abs(value) for value in values], strict=True))
    truth = complex(dict(zip(sorted(near), values, strict=True))[cell])
    right = all(strength[cell] >= other * (1 - mpmath.mpf(10) ** -11) for other in strength.values())
    return ours, naive(net, station, points, rcs, aim), truth, right, result.bound


@pytest.mark.parametrize("name", CASES)
def test_hard_case(name):
    ours, _, truth, right, bound = judged(name)
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


def table() -> str:
    """The hard cases as a Markdown table."""
    lines = ["| case | why it is hard | naive formula, relative error | ours | proved bound |", "|---|---|---|---|---|"]
    for name, case in CASES.items():
        ours, plain, truth, _, bound = judged(name)
        wrong = "NaN" if not np.isfinite(plain) else f"{abs(plain - truth) / abs(truth):.0e}"
        lines.append(f"| {name} | {case[0]} | {wrong} | {abs(ours - truth) / abs(truth):.0e} | {bound:.0e} |")
    return "\n".join(lines)


if __name__ == "__main__":
    print(table())
