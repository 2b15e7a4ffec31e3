"""The land z = 0 that a station, or a link, sees in each of its range cells.

It consists of patches, whose power under the beams is computed.

The land at one range sum is an ellipse, the section of an ellipsoid whose foci are the two arrays;
of a single station it is a circle. The sum runs over the eccentric anomaly nu, which places patches
most densely where the ellipse passes close to a mast.

Land fills every range cell from edge to edge, and an echo off the centre of its cell has side lobes
in all other cells. Their power is proportional to sin^2(pi x offset), whose mean over a cell is
1/2, as at an offset of a quarter of a cell. The rings of land are therefore centred a quarter of a
cell beyond the centres of the cells.
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
FAINTEST = 1e-300
"""A power below this divides nothing."""


class Land(NamedTuple):
    """Patches of land (K,) in the order of their range cells; none depends on the beams.

    cell: (C,) numbers of the cells with land, and first: (C,) each one's first patch; cells: number
    of all cells; weight: area times the root of both grazing angles' sines, over both squared
    ranges, times both element gains; seen: (2, 2, K) direction cosines, across and up, from the
    sender and the receiver, of a station (1, 2, K); slow: cosine of half the bistatic angle.
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
    """Return values (cells, ...) summed into the M cells that they share.

    Land beyond the unambiguous range folds.
    """
    periods = -(-len(values) // subcarriers)
    beside = values.shape[1:]
    whole = np.zeros((periods * subcarriers, *beside), values.dtype)
    whole[: len(values)] = values
    return whole.reshape(periods, subcarriers, *beside).sum(axis=0)


def with_side_lobes(power: np.ndarray, subcarriers: int) -> np.ndarray:
    """Return the mean power (M,) in the M range cells of patches of independent phase.

    power: (cells,), that of the patches.
    """
    lobe = abs(np.fft.ifft(ramp(subcarriers))) ** 2
    return np.fft.ifft(np.fft.fft(folded(power, subcarriers)) * np.fft.fft(lobe)).real


class Ellipses(NamedTuple):
    """Ellipses of the land, (T,) each; rates are changes with the half range sum t.

    centre, long, short: centre along the axis of the masts and both half axes (m); centre_rate,
    long_rate, short_rate: those of the centre and of both squared half axes.
    """

    centre: np.ndarray
    long: np.ndarray
    short: np.ndarray
    centre_rate: np.ndarray
    long_rate: np.ndarray
    short_rate: np.ndarray


def ellipses(t: np.ndarray, half_m: float, heights_m: tuple[float, float]) -> Ellipses:
    """Return the land's ellipses of half range sums t (T,) m as `Ellipses`.

    The masts stand at -half_m and +half_m on the long axis, the sender first. Source: (R1 + R2)^2 =
    4 t^2 for points in the plane, with the square completed.
    """
    c = half_m
    sends, hears = heights_m
    g = (sends**2 - hears**2) / (4.0 * t)
    q = 1.0 - (c / t) ** 2
    centre = g * c / (t * q)
    centre_rate = -2.0 * t * centre / (t**2 - c**2)
    q_rate = 2.0 * c**2 / (t * t * t)
    short = np.maximum((t + g) ** 2 - c**2 - sends**2 + q * centre**2, 0.0)
    short_rate = 2.0 * (t + g) * (1.0 - g / t) + q_rate * centre**2 + 2.0 * q * centre * centre_rate
    return Ellipses(
        centre=centre,
        long=np.sqrt(short / q),
        short=np.sqrt(short),
        centre_rate=centre_rate,
        long_rate=(short_rate - short * q_rate / q) / q,
        short_rate=short_rate,
    )


def nearest_m(station: Station) -> float:
    """Return the least half range sum (m) by the land: half the way by the mirrored ground."""
    x, y, z = (station.transmitter or station).position_m
    u, v, w = station.position_m
    return 0.5 * float(np.sqrt((x - u) ** 2 + (y - v) ** 2 + (z + w) ** 2))


def _edges(station: Station, reach_m: float, cells_per_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the nearest and farthest half range sum (m) of every cell's land, (cells,).

    Land reaches up to `reach_m`.
    """
    cells = max(int(np.ceil(reach_m * cells_per_m + 0.5 - OFFSET)), 0)
    low_m = nearest_m(station)
    edge = (np.arange(cells)[:, None] + [-0.5, 0.5] + OFFSET) / cells_per_m
    low, high = np.clip(edge, low_m, max(reach_m, low_m)).T
    return low, high


class _Rings(NamedTuple):
    """Ellipses of the land, several in each range cell that has land.

    lit: (C,) those cells, of `cells`; t: (T,) half range sums (m); step: (T,) their shares of a
    cell's extent (m); shapes: of the ellipses; counts: (T,) patches of each ellipse.
    """

    lit: np.ndarray
    cells: int
    t: np.ndarray
    step: np.ndarray
    shapes: Ellipses
    counts: np.ndarray


def _rings(
    station: Station,
    reach_m: float,
    cells_per_m: float,
    half_m: float,
    heights_m: tuple[float, float],
    turns: int,
) -> _Rings:
    """Return NODES ellipses in each range cell; turns: half the patches of a circle."""
    low, high = _edges(station, reach_m, cells_per_m)
    cells = len(low)
    lit = np.flatnonzero(high > low)
    low = low[lit]
    high = high[lit]
    node, share = gauss_legendre(NODES)
    middle = 0.5 * (high + low)[:, None]
    half_extent = 0.5 * (high - low)[:, None]
    t = (middle + half_extent * node).ravel()
    step = (half_extent * share).ravel()
    shapes = ellipses(t, half_m, heights_m)
    # The beams turn past the patches fastest where the ellipse passes a mast.
    beyond = shapes.long - half_m
    sender_m, receiver_m = heights_m
    from_sender = np.hypot(shapes.centre - beyond, sender_m)
    from_receiver = np.hypot(shapes.centre + beyond, receiver_m)
    stretch = np.maximum(1.0, shapes.short / np.minimum(from_sender, from_receiver))
    counts = 2 * np.ceil(turns * stretch - 1e-9).astype(int)
    return _Rings(lit, cells, t, step, shapes, counts)


def _patches(
    rings: _Rings, masts_m: np.ndarray, half_m: float, axis: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the middles (K, 3) m and areas (K,) m2 of the patches of all ellipses.

    masts_m: (2, 3) of the sender and the receiver; axis: (2,) direction of the long axis.
    """
    of_ring = np.repeat(np.arange(len(rings.t)), rings.counts)
    number = np.concatenate([np.arange(0), *map(np.arange, rings.counts)])
    ring = Ellipses(*(values[of_ring] for values in rings.shapes))
    nu = 2.0 * np.pi * (number + 0.5) / rings.counts[of_ring]
    s, c = portable.sine_cosine(nu)
    along = ring.centre + ring.long * c
    aside = ring.short * s
    middle_m = 0.5 * (masts_m[0] + masts_m[1])
    points = np.zeros((len(nu), 3))
    points[:, 0] = middle_m[0] + along * axis[0] - aside * axis[1]
    points[:, 1] = middle_m[1] + along * axis[1] + aside * axis[0]
    narrow = np.sqrt(1.0 - (half_m / rings.t[of_ring]) ** 2)
    area = ring.centre_rate * ring.short * c
    area = area + 0.5 * narrow * ring.long_rate * c * c
    area = area + 0.5 * ring.short_rate / narrow * s * s
    per_patch = rings.step * 2.0 * np.pi / rings.counts
    return points, area * per_patch[of_ring]


@lru_cache(maxsize=12)
def land(network: Network, station: Station, reach_m: float, element: Element | None) -> Land:
    """Return the patches of land up to the half range sum `reach_m`.

    element: the antennas', None for isotropic.
    """
    radio = radar(network, station)
    ends = (station.transmitter or station, station)
    masts_m = np.array([end.position_m for end in ends])
    between = masts_m[1, :2] - masts_m[0, :2]
    half_m = 0.5 * float(np.hypot(*between))
    heights_m = (float(masts_m[0, 2]), float(masts_m[1, 2]))
    # For a station, or ends above each other, the ellipses are circles, which begin along the
    # receiver's array.
    axis = station.horizontal[:2]
    if half_m > 0:
        axis = between / (2.0 * half_m)
    # Over azimuth the trapezoidal rule is exact for a station's arrays, whose patterns are
    # trigonometric.
    turns = int(np.pi * radio.kappa * (network.transmit[0] + network.receive[0])) + 24
    rings = _rings(station, reach_m, radio.cells, half_m, heights_m, turns)
    points, weight = _patches(rings, masts_m, half_m, axis)
    r1 = portable.norm(points - masts_m[0])
    r2 = portable.norm(points - masts_m[1])
    weight *= np.sqrt(heights_m[0] * heights_m[1] / (r1 * r2)) / (r1 * r2) ** 2
    if element is not None:
        weight *= antenna.gain(element, ends[0], points) * antenna.gain(element, ends[1], points)
    counts = rings.counts
    if station.transmitter is not None:
        apart = float(np.sum((masts_m[0] - masts_m[1]) ** 2))
        squared = 0.5 + (r1**2 + r2**2 - apart) / (4.0 * r1 * r2)
        slow = np.sqrt(np.clip(squared, 0.0, 1.0))
        seen = np.stack([cosines(end, points).T for end in ends])
    else:
        # A station sees both halves of each circle, before and behind its array's line, under the
        # same cosines.
        circles = (len(rings.t), 2, turns)
        both = weight.reshape(circles)
        weight = (both + both[:, ::-1, ::-1])[:, 0].ravel()
        on_circles = cosines(station, points).T.reshape(2, *circles)
        seen = on_circles[:, :, 0].reshape(1, 2, -1)
        slow = np.ones(len(weight))
        counts = counts // 2
    of_cells = counts.reshape(-1, NODES).sum(axis=1)
    first = np.cumsum(of_cells) - of_cells
    return Land(rings.lit, first, rings.cells, weight, seen, slow)


def cell_power(
    settings: dict,
    network: Network,
    station: Station,
    aims_m: np.ndarray,
    element: Element | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean power (cells,) W of the land in every cell, and the factor on its Doppler.

    The factor is the mean of cos(beta / 2).

    settings: gamma and reach_m; cells beyond the M unambiguous ones are included; aims_m: (2, 3) m,
    where the sender's and the receiver's beams point; element: as in `land`. The integral of G_T
    G_R sigma0 / (R1^2 R2^2) over the land of a range sum, with sigma0 = gamma (sin psi_1 sin
    psi_2)^(1/2). Source: Willis, Bistatic Radar.
    """
    held = land(network, station, settings["reach_m"], element)
    radio = radar(network, station)
    power = np.zeros(held.cells)
    slow = np.ones(held.cells)
    lit = held.weight.copy()
    ends = (station.transmitter or station, station)
    for number, elements in enumerate((network.transmit, network.receive)):
        aim = cosines(ends[number], aims_m[number])
        # A station has one set of cosines, a link one for each end.
        seen = held.seen[-number]
        gain = np.ones(len(lit))
        for axis in range(2):
            row_sum(seen[axis], radio.kappa, radio.kappa, aim[axis], elements[axis], gain)
        lit *= gain * gain
    if len(lit):
        of_cells = np.add.reduceat(lit, held.first)
        slowed = np.add.reduceat(lit * held.slow, held.first)
        power[held.cell] = of_cells
        slow[held.cell] = np.where(of_cells > 0, slowed / np.maximum(of_cells, FAINTEST), 1.0)
    return radio.scale**2 * settings["gamma"] * power, slow
