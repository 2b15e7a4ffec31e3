"""Inputs of the echo on which a formula written down naively fails: one symbol of one station a
case.

The truth is `lowalt.measure.fifty_digits`.
"""

import dataclasses
from typing import NamedTuple

import mpmath
import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo import echo_signal
from lowalt.measure.fifty_digits import cells_mp

C = SPEED_OF_LIGHT


class Case(NamedTuple):
    """A hard case: why it is hard, the network and its station, points (L, 3) m, and where the beam
    aims (3,) m.
    """

    why: str
    network: Network
    station: Station
    points_m: np.ndarray
    aim_m: np.ndarray


def network(**changes) -> Network:
    """Return the cases' network: the default's radar with one station at the origin, with these
    fields changed.
    """
    station = Station("A", (0.0, 0.0, 25.0), 0.0, changes.get("carrier_hz", 4.9e9))
    base = Network(4.9e9, 120e3, 256, 10, 2.5e-3, 400, (16, 4), (16, 4), 1.0, (station,))
    return dataclasses.replace(base, **changes)


def away(distance: float, x: float = 1.0, y: float = 0.3, z: float = 0.1) -> np.ndarray:
    """Return a point (3,) at a distance (m) from the station, in the direction (x, y, z)."""
    direction = np.array([x, y, z]) / np.linalg.norm([x, y, z])
    return np.array([0.0, 0.0, 25.0]) + distance * direction


def cluster(distance: float, count: int = 5, size: float = 0.5, seed: int = 3) -> np.ndarray:
    """Return `count` points (count, 3) about one at this distance (m), scattered by `size` (m)."""
    return away(distance) + np.random.default_rng(seed).normal(scale=size, size=(count, 3))


def _grating() -> tuple:
    """A point in the first grating lobe of the arrays: network, station, its place (1, 3) and the
    aim (3,) in m.
    """
    # kappa = 1.02 makes the first grating lobe visible: it is 2 / kappa away from the beam in
    # direction cosine.
    net = network()
    station = dataclasses.replace(net.stations[0], frequency_hz=1.02 * net.carrier_hz)
    psi0 = -0.985
    psi = -0.985 + 2 / 1.02
    aim = np.array([100 * np.sqrt(1 - psi0**2), 100 * psi0, 25.0])
    return net, station, np.array([[100 * np.sqrt(1 - psi**2), 100 * psi, 25.0]]), aim


NET = network()
CELL = NET.cell_m
EDGE = np.array([[30.5 * CELL, 0.0, 25.0]])
CENTRE = np.array([[30 * CELL, 0.0, 25.0]])
MAX = C / (2 * 120e3)

_LISTED = {
    "straight above": (
        "azimuth is 0/0",
        NET,
        NET.stations[0],
        np.array([[0.0, 0.0, 90.0]]),
        (0.0, 0.0, 80.0),
    ),
    "behind the array": (
        "angles leave the front half",
        NET,
        NET.stations[0],
        cluster(120) * [-1, 1, 1],
        (-90, 40, 30),
    ),
    "on a grating lobe": ("sin(N u) / sin(u) is 0/0 away from the beam", *_grating()),
    "at the beam's centre": (
        "sin(N u) / sin(u) is 0/0",
        NET,
        NET.stations[0],
        away(150)[None],
        away(150),
    ),
    "at a cell's edge": ("two cells tie", NET, NET.stations[0], EDGE, EDGE[0] + [0, 1, 1]),
    "at a cell's centre": (
        "the cell kernel is 0/0",
        NET,
        NET.stations[0],
        CENTRE,
        CENTRE[0] + [0, 1, 1],
    ),
    "at the unambiguous range": (
        "the cell wraps to 0",
        NET,
        NET.stations[0],
        away(MAX)[None],
        away(1200, y=0.31),
    ),
    "past the unambiguous range": (
        "the cell wraps",
        NET,
        NET.stations[0],
        cluster(1.7 * MAX),
        away(2000),
    ),
    "at 1 cm": (
        "1 / r^2 and direction are extreme",
        NET,
        NET.stations[0],
        away(0.01)[None],
        away(0.02, y=0.2),
    ),
    "at 100 km": ("2e7 rad of phase", NET, NET.stations[0], cluster(1e5), away(1e5)),
    "100 km at 77 GHz": (
        "3e8 rad of phase",
        network(carrier_hz=77e9),
        network(carrier_hz=77e9).stations[0],
        cluster(1e5, size=0.01),
        away(1e5),
    ),
    "one point": ("nothing to average", NET, NET.stations[0], away(77.7)[None], away(77, y=0.32)),
    "arrays of 7 x 3 and 25 x 1": (
        "no powers of two",
        network(transmit=(7, 3), receive=(25, 1)),
        NET.stations[0],
        cluster(90),
        away(88),
    ),
    "arrays of 256": (
        "recurrences lose digits",
        network(transmit=(256, 1)),
        NET.stations[0],
        cluster(300),
        away(299),
    ),
    "M = 1": ("one cell for all", network(subcarriers=1), NET.stations[0], cluster(90), away(88)),
    "M = 2": (
        "cells tie by symmetry",
        network(subcarriers=2),
        NET.stations[0],
        cluster(90),
        away(88),
    ),
    "M = 3300": (
        "cells of 0.4 m",
        network(subcarriers=3300),
        NET.stations[0],
        cluster(90, size=0.1),
        away(88),
    ),
    "larger than its range": (
        "no expansion in size / range",
        NET,
        NET.stations[0],
        cluster(3, size=4),
        away(3),
    ),
    "deep fade": (
        "half a wave apart: the sum all but cancels",
        NET,
        NET.stations[0],
        np.array(
            [[30.2 * CELL, 0, 25.0], [30.2 * CELL + C / (4.9e9 + 127.5 * 120e3) / 4, 0, 25.0]]
        ),
        (150, 1, 25),
    ),
}
CASES = {name: Case(*values) for name, values in _LISTED.items()}
"""The hard cases by name."""


def judged(name: str) -> tuple[complex, complex, bool, float]:
    """Return one case's value by the engine and in fifty digits, whether its cell is the strongest,
    and its bound.
    """
    _, net, station, points, aim = CASES[name]
    rcs = np.linspace(0.5, 1.5, len(points)) if len(points) != 2 else np.ones(2)
    result = echo_signal(net, station, points[None], rcs, aim)
    cell = int(result.cell[0])
    # All cells about the target and some of the others: far cells of one cluster cannot be the
    # strongest.
    near = {(cell + j) % net.subcarriers for j in range(-2, 3)}
    listed = sorted(near | set(range(0, net.subcarriers, max(1, net.subcarriers // 7))))
    values = dict(
        zip(listed, cells_mp(net, station, points.tolist(), rcs.tolist(), aim, listed), strict=True)
    )
    right = all(
        abs(values[cell]) >= abs(other) * (1 - mpmath.mpf(10) ** -11) for other in values.values()
    )
    return result.signal[0], complex(values[cell]), right, result.bound
