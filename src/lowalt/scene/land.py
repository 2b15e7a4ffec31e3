"""The land z = 0 that a station, or a link, sees in each of its range cells: patches, and their power under the beams.

The land at one range sum is an ellipse, the section of an ellipsoid whose foci are the two arrays; of a single station
it is a circle. The sum runs over the eccentric anomaly nu, which places patches most densely where the ellipse passes
close to a mast.

Land fills every range cell from edge to edge, and an echo off the centre of its cell has side lobes in all other cells.
Their power is proportional to sin^2(pi x offset), whose mean over a cell is 1/2, as at an offset of a quarter of a
cell. The rings of land are therefore centred a quarter of a cell beyond the centres of the cells.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.echo.radar import radar
from lowalt.numerics import portable
from lowalt.numerics.quadrature import gauss_legendre
from lowalt.scene import antenna
from lowalt.scene.antenna import Element
from lowalt.scene.response import cosines
from lowalt.scene.response_loops import row_sum

OFFSET = 0.25
"""Distance of a patch from the centre of its range cell, in cells."""
NODES = 6
"""Ellipses of a range cell, at the nodes of Gauss and Legendre."""


class Land(NamedTuple):
    """Patches of land (K,) in the order of their range cells; none depends on the beams.

    cell: (C,) numbers of the cells with land, and first: (C,) each one's first patch; cells: number of all cells;
    weight: area times the root of both grazing angles' sines, over both squared ranges, times both element gains;
    seen: (2, 2, K) direction cosines, across and up, from the sender and the receiver, of a station (1, 2, K); slow:
    cosine of half the bistatic angle.
    """

    cell: np.ndarray
    first: np.ndarray
    cells: int
    weight: np.ndarray
    seen: np.ndarray
    slow: np.ndarray


def ramp(subcarriers: int) -> np.ndarray:
    """Return the phase (M,) of the patches' offset at every subcarrier."""
    return np.exp(-2j * np.pi * OFFSET * np.arange(subcarriers) / subcarriers)


def folded(values: np.ndarray, subcarriers: int) -> np.ndarray:
    """Return values (cells, ...) summed into the M cells that they share: land beyond the unambiguous range folds."""
    whole = np.zeros((-(-len(values) // subcarriers) * subcarriers, *values.shape[1:]), values.dtype)
    whole[: len(values)] = values
    return whole.reshape(-1, subcarriers, *values.shape[1:]).sum(axis=0)


def with_side_lobes(power: np.ndarray, subcarriers: int) -> np.ndarray:
    """Return the mean power (M,) in the M range cells of patches of independent phase with `power` (cells,)."""
    lobe = abs(np.fft.ifft(ramp(subcarriers))) ** 2
    return np.fft.ifft(np.fft.fft(folded(power, subcarriers)) * np.fft.fft(lobe)).real


def ellipses(t: np.ndarray, half_m: float, heights_m: tuple[float, float]) -> tuple[np.ndarray, ...]:
    """Return the land's ellipses of half range sums t (T,) m: centre, both half axes, and the centre's and both squared
    half axes' change with t, each (T,).

    The masts stand at -half_m and +half_m on the long axis, the sender first. Source: (R1 + R2)^2 = 4 t^2 for points in
    the plane, with the square completed.
    """
    c, (sends, hears) = half_m, heights_m
    g = (sends**2 - hears**2) / (4.0 * t)
    q = 1.0 - (c / t) ** 2
    centre = g * c / (t * q)
    centre_rate = -2.0 * t * centre / (t**2 - c**2)
    q_rate = 2.0 * c**2 / t**3
    short = np.maximum((t + g) ** 2 - c**2 - sends**2 + q * centre**2, 0.0)
    short_rate = 2.0 * (t + g) * (1.0 - g / t) + q_rate * centre**2 + 2.0 * q * centre * centre_rate
    return centre, np.sqrt(short / q), np.sqrt(short), centre_rate, (short_rate - short * q_rate / q) / q, short_rate


def nearest_m(station: Station) -> float:
    """Return the least half range sum (m) by the land: half the way by the mirrored ground."""
    (x, y, z), (u, v, w) = (station.transmitter or station).position_m, station.position_m
    return 0.5 * float(np.sqrt((x - u) ** 2 + (y - v) ** 2 + (z + w) ** 2))


def _edges(station: Station, reach_m: float, cells_per_m: float) -> tuple[np.ndarray, np.ndarray]:
    """The nearest and farthest half range sum (m) of every cell's land up to `reach_m`, (cells,)."""
    cells, low_m = max(int(np.ceil(reach_m * cells_per_m + 0.5 - OFFSET)), 0), nearest_m(station)
    edge = (np.arange(cells)[:, None] + [-0.5, 0.5] + OFFSET) / cells_per_m
    low, high = np.clip(edge, low_m, max(reach_m, low_m)).T
    return low, high


@lru_cache(maxsize=12)
def land(network: Network, station: Station, reach_m: float, element: Element | None, nodes: int = NODES) -> Land:
    """Return the patches of land up to the half range sum `reach_m`; element: the antennas', None for isotropic."""
    radio, ends = radar(network, station), (station.transmitter or station, station)
    places = np.array([end.position_m for end in ends])
    between = places[1, :2] - places[0, :2]
    half, heights = 0.5 * float(np.hypot(*between)), (float(places[0, 2]), float(places[1, 2]))
    # For a station, or ends above each other, the ellipses are circles, which begin along the receiver's array.
    axis = between / (2.0 * half) if half > 0 else station.horizontal[:2]
    low, high = _edges(station, reach_m, radio.cells)
    cells, lit = len(low), np.flatnonzero(high > low)
    low, high = low[lit], high[lit]
    node, share = gauss_legendre(nodes)
    t = (0.5 * (high + low)[:, None] + 0.5 * (high - low)[:, None] * node).ravel()
    step = (0.5 * (high - low)[:, None] * share).ravel()
    rings = ellipses(t, half, heights)
    # The beams turn past the patches fastest where the ellipse passes a mast.
    tip = [np.hypot(rings[0] + side * (rings[1] - half), heights[side > 0]) for side in (-1, 1)]
    stretch = np.maximum(1.0, rings[2] / np.minimum(*tip))
    # Over azimuth the trapezoidal rule is exact for a station's arrays, whose patterns are trigonometric.
    turns = int(np.pi * radio.kappa * (network.transmit[0] + network.receive[0])) + 24
    counts = 2 * np.ceil(turns * stretch - 1e-9).astype(int)
    ring, place = np.repeat(np.arange(len(t)), counts), np.concatenate([np.arange(0), *map(np.arange, counts)])
    centre, long, short, centre_rate, long_rate, short_rate = (values[ring] for values in rings)
    nu = 2.0 * np.pi * (place + 0.5) / counts[ring]
    c, s = np.cos(nu), np.sin(nu)
    along, aside = centre + long * c, short * s
    points = np.zeros((len(nu), 3))
    points[:, 0] = 0.5 * (places[0, 0] + places[1, 0]) + along * axis[0] - aside * axis[1]
    points[:, 1] = 0.5 * (places[0, 1] + places[1, 1]) + along * axis[1] + aside * axis[0]
    narrow = np.sqrt(1.0 - (half / t[ring]) ** 2)
    area = centre_rate * short * c + 0.5 * narrow * long_rate * c * c + 0.5 * short_rate / narrow * s * s
    r = [portable.norm(points - mast) for mast in places]
    weight = area * (step * 2.0 * np.pi / counts)[ring]
    weight *= np.sqrt(heights[0] * heights[1] / (r[0] * r[1])) / (r[0] * r[1]) ** 2
    if element is not None:
        weight *= antenna.gain(element, ends[0], points) * antenna.gain(element, ends[1], points)
    apart = float(np.sum((places[0] - places[1]) ** 2))
    slow = np.sqrt(np.clip(0.5 + (r[0] ** 2 + r[1] ** 2 - apart) / (4.0 * r[0] * r[1]), 0.0, 1.0))
    seen = np.stack([cosines(end, points).T for end in (ends if station.transmitter else ends[1:])])
    if station.transmitter is None:
        # A station sees both halves of each circle, before and behind its array's line, under the same cosines.
        circles = (len(t), 2, turns)
        weight = (weight.reshape(circles) + weight.reshape(circles)[:, ::-1, ::-1])[:, 0].ravel()
        seen, slow = seen.reshape(1, 2, *circles)[:, :, :, 0].reshape(1, 2, -1), np.ones(len(weight))
        counts = counts // 2
    first = np.concatenate([np.zeros(1, int), np.cumsum(counts.reshape(-1, nodes).sum(axis=1))[:-1]])[: len(lit)]
    return Land(lit, first, cells, weight, seen, slow)


def cell_power(
    settings: dict, network: Network, station: Station, aims_m: np.ndarray, element: Element | None = None,
    nodes: int = NODES,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return the mean power (cells,) W of the land in every cell, and the factor on its Doppler, mean cos(beta / 2).

    settings: gamma and reach_m; cells beyond the M unambiguous ones are included; aims_m: (2, 3) m, where the sender's
    and the receiver's beams point; element: as in `land`. The integral of G_T G_R sigma0 / (R1^2 R2^2) over the land of
    a range sum, with sigma0 = gamma (sin psi_1 sin psi_2)^(1/2). Source: Willis, Bistatic Radar.
    """
    held, radio = land(network, station, settings["reach_m"], element, nodes), radar(network, station)
    power, slow, lit = np.zeros(held.cells), np.ones(held.cells), held.weight.copy()
    aims = [cosines(end, aim_m) for end, aim_m in zip((station.transmitter or station, station), aims_m, strict=True)]
    for end, counts in enumerate((network.transmit, network.receive)):
        gain = np.ones(len(lit))
        for axis in range(2):
            row_sum(held.seen[-end][axis], radio.kappa, radio.kappa, aims[end][axis], counts[axis], gain)
        lit *= gain * gain
    if len(lit):
        power[held.cell] = np.add.reduceat(lit, held.first)
        slowed = np.add.reduceat(lit * held.slow, held.first)
        slow[held.cell] = np.where(power[held.cell] > 0, slowed / np.maximum(power[held.cell], 1e-300), 1.0)
    return radio.scale**2 * settings["gamma"] * power, slow
