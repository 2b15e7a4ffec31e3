"""The land between two stations: mean power of the range cells of a link, cell by cell of its range sum.

The land of one range sum is an ellipse in the plane z = 0, the section of an ellipsoid whose foci are both arrays. It
is summed around its eccentric anomaly nu, on which patches stand closest where the ellipse passes close to a mast.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lowalt.common.network import Network, Station
from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import radar
from lowalt.effects.antenna import Element, gain
from lowalt.effects.channel import patches
from lowalt.effects.plane_loops import array_sum
from lowalt.effects.response_loops import LOOPS

STRIP = 256
"""Patches that pass through the loops together."""


class Patches(NamedTuple):
    """Patches of land (K,) of a link in the order of their range cells; none depends on the aims.

    first: (cells with land,) number of each such cell's first patch, and cell: (cells with land,) its number; weight:
    area times the root of both grazing angles' sines over both squared ranges, and both elements' gains; seen: (4, K)
    direction cosines across and up from the sender, then from the receiver; slow: cosine of half the bistatic angle.
    """

    first: np.ndarray
    cell: np.ndarray
    cells: int
    weight: np.ndarray
    seen: np.ndarray
    slow: np.ndarray


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


def nearest_m(network: Network, link: Station) -> float:
    """Return the least half range sum (m) of a link by the land: half the way by the mirrored ground."""
    (x, y, z), (u, v, w) = link.transmitter.position_m, link.position_m
    return 0.5 * float(np.sqrt((x - u) ** 2 + (y - v) ** 2 + (z + w) ** 2))


@lru_cache(maxsize=12)
def land(network: Network, link: Station, reach_m: float, element: Element | None, nodes: int = 6) -> Patches:
    """Return the patches of a link's land up to the half range sum `reach_m`; nodes: of a range cell."""
    radio, ends = radar(network, link), (link.transmitter, link)
    places = np.array([end.position_m for end in ends])
    across = places[1, :2] - places[0, :2]
    half = 0.5 * float(np.hypot(*across))
    # Of ends above each other, the ellipses are circles, which begin along the receiver's array as a station's do.
    axis = across / (2.0 * half) if half > 0 else link.horizontal[:2]
    low_m, heights = nearest_m(network, link), (float(places[0, 2]), float(places[1, 2]))
    cells = max(int(np.ceil(reach_m * radio.cells + 0.5 - patches.OFFSET)), 0)
    edge = (np.arange(cells)[:, None] + [-0.5, 0.5] + patches.OFFSET) / radio.cells
    low, high = np.clip(edge, low_m, max(reach_m, low_m)).T
    lit = np.flatnonzero(high > low)
    low, high = low[lit], high[lit]
    node, weight = np.polynomial.legendre.leggauss(nodes)
    t = (0.5 * (high + low)[:, None] + 0.5 * (high - low)[:, None] * node).ravel()
    step = (0.5 * (high - low)[:, None] * weight).ravel()
    rings = ellipses(t, half, heights)
    # A beam of an end turns past the patches fastest where the ellipse passes its mast.
    tip = [np.hypot(rings[0] + side * (rings[1] - half), heights[side > 0]) for side in (-1, 1)]
    stretch = np.maximum(1.0, rings[2] / np.minimum(*tip))
    turns = int(np.pi * radio.kappa * (network.transmit[0] + network.receive[0])) + 24
    counts = 2 * np.ceil(turns * stretch - 1e-9).astype(int)
    ring = np.repeat(np.arange(len(t)), counts)
    place = np.arange(len(ring)) - np.repeat(np.cumsum(counts) - counts, counts)
    centre, long, short, centre_rate, long_rate, short_rate = (one[ring] for one in rings)
    nu = 2.0 * np.pi * (place + 0.5) / counts[ring]
    c, s = np.cos(nu), np.sin(nu)
    along, aside = centre + long * c, short * s
    flat = np.stack([along * axis[0] - aside * axis[1], along * axis[1] + aside * axis[0]], axis=1)
    points = np.concatenate([0.5 * (places[0, :2] + places[1, :2]) + flat, np.zeros((len(flat), 1))], axis=1)
    narrow = np.sqrt(1.0 - (half / t[ring]) ** 2)
    area = centre_rate * short * c + 0.5 * narrow * long_rate * c * c + 0.5 * short_rate / narrow * s * s
    area *= (step * 2.0 * np.pi / counts)[ring]
    away = points - places[:, None]
    r = np.sqrt(np.einsum("eki,eki->ek", away, away))
    share = area * np.sqrt(heights[0] * heights[1] / (r[0] * r[1])) / (r[0] * r[1]) ** 2
    if element is not None:
        share *= gain(element, ends[0], points) * gain(element, ends[1], points)
    seen = [
        one for end, off, length in zip(ends, away, r, strict=True)
        for one in (off @ end.horizontal / length, off[:, 2] / length)
    ]  # fmt: skip
    apart = float(np.sum((places[0] - places[1]) ** 2))
    slow = np.sqrt(np.clip(0.5 + (r[0] ** 2 + r[1] ** 2 - apart) / (4.0 * r[0] * r[1]), 0.0, 1.0))
    first = np.concatenate([[0], np.cumsum(counts.reshape(len(lit), nodes).sum(axis=1))[:-1]]).astype(int)
    return Patches(first, lit, cells, share, np.array(seen), slow)


@LOOPS
def lit_by_beams(seen, aimed, half_kappa, counts, weight, out):
    """Fill out (K,) with weight (K,) times the squared array sums at direction cosines seen (4, K) off aimed (4,).

    counts: (4,) elements across and up of the sender's array, then of the receiver's.
    """
    x, square, c, total = np.empty(STRIP), np.empty(STRIP), np.empty(STRIP), np.empty(STRIP)
    for start in range(0, len(weight), STRIP):
        size = min(STRIP, len(weight) - start)
        for i in range(size):
            out[start + i] = weight[start + i]
        for k in range(4):
            for i in range(size):
                x[i] = half_kappa * (seen[k, start + i] - aimed[k])
            array_sum(x, counts[k], square, c, total, size)
            for i in range(size):
                out[start + i] *= total[i] * total[i]


def cell_power(
    settings: dict, network: Network, link: Station, aims_m: np.ndarray, element: Element | None = None, nodes: int = 6
) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean power (cells,) (W) of a link's land, and by how much it slows Doppler, mean cos(beta / 2).

    aims_m: (2, 3) m, where the sender's and the receiver's beams point; settings, element: as `clutter.cell_power`.
    The integral of G_T G_R sigma0 / (R1^2 R2^2) over the land of a range sum, Gauss-Legendre over the sum and
    trapezoidal around the ellipse; sigma0 = gamma (sin psi_1 sin psi_2)^(1/2). Source: Willis, Bistatic Radar.
    """
    found, radio = land(network, link, settings["reach_m"], element, nodes), radar(network, link)
    aimed = []
    for end, aim in zip((link.transmitter, link), aims_m, strict=True):
        own = radar(network, end)
        aimed += aim_cosines(np.asarray(aim, np.float64), own.station, own.sine, own.cosine)
    power, slow = np.zeros(found.cells), np.ones(found.cells)
    if len(found.weight):
        each = np.empty(len(found.weight))
        counts = np.array([*network.transmit, *network.receive])
        lit_by_beams(found.seen, np.array(aimed), 0.5 * radio.kappa, counts, found.weight, each)
        power[found.cell] = np.add.reduceat(each, found.first)
        slowed = np.add.reduceat(each * found.slow, found.first)
        slow[found.cell] = np.where(power[found.cell] > 0, slowed / np.maximum(power[found.cell], 1e-300), 1.0)
    return radio.scale**2 * settings["gamma"] * power, slow
