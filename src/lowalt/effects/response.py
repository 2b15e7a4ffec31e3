"""The frequency response of a moving cloud over any routes: Y[n, m] of Eq. 24 and what goes beyond it.

Over its few range cells a target's response is a smooth function of frequency. So every symbol is summed into
Chebyshev moments of the points' ranges, and one matrix product turns moments into all M subcarriers:
exp(-j B x u) = sum eps_p (-j)^p J_p(B x) T_p(u), |u| <= 1. No array of symbols x points x subcarriers exists.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import jv

from lowalt.echo.compile import kernel
from lowalt.echo.precise import reference
from lowalt.echo.radar import Radar, radar
from lowalt.echo.terms import aim_cosines
from lowalt.errors import InputError
from lowalt.network import SPEED_OF_LIGHT, Network, Station


class Way(NamedTuple):
    """One route between a station and every point.

    places: (N, L, 3) m, where the station sees the points (their images); coefficient: the route's complex factor
    beside 1/r, a number or (N, L).
    """

    places: np.ndarray
    coefficient: np.ndarray | complex = 1.0


class _Route(NamedTuple):
    """Geometry of a way: ranges, half the two-way excess over the reference, direction cosines; each (N, L)."""

    range_m: np.ndarray
    excess_m: np.ndarray
    psi: np.ndarray
    omega: np.ndarray
    coefficient: np.ndarray | complex


def response(
    network: Network,
    station: Station,
    places: np.ndarray,
    rcs_m2: np.ndarray,
    aim_m: np.ndarray,
    *,
    ways: Sequence[Way] = (),
    factor: np.ndarray | float = 1.0,
    squint: bool = False,
    wavefront: bool = False,
) -> np.ndarray:
    """Return the subcarriers Y (N, M) complex128 of points at `places` (N, L, 3) m, the known symbol removed.

    rcs_m2: (L,) m2; aim_m: (3,) m, where both beams point; ways: routes beside the direct one: waves go out by any and
    come back by any; factor: real factor on every point's two-way amplitude, (N, L); squint: the arrays' phases
    follow each subcarrier's frequency while the beams' weights do not; wavefront: elements see spherical waves.
    Raises: InputError for a point in the station. Source: paper Eqs. 4, 7 and 24; Jacobi-Anger expansion.
    """
    radio = radar(network, station)
    refs = reference(places[:, 0], radio.station, radio.turns, radio.turns_lo, radio.cells, radio.cells_lo)
    aims = aim_cosines(np.asarray(aim_m, np.float64), radio.station, radio.sine, radio.cosine)
    routes = [_route(radio, refs, places[:, 0], way, station.name) for way in (Way(places), *ways)]
    strength = radio.scale * np.sqrt(rcs_m2) * factor
    pairs = _pairs(len(routes), network.transmit == network.receive)
    cells = [refs[:, 6:7] + radio.cells * 0.5 * (routes[a].excess_m + routes[b].excess_m) for a, b, _ in pairs]
    reach = _round_up(max(float(abs(u).max()) for u in cells))
    table = _table(reach, radio.subcarriers)
    own = np.exp(-2j * np.pi * refs[:, 4:5])
    result = None
    for kappa, weight in _frequencies(network, radio, squint):
        out = [_one_way(radio, route, aims, kappa, network.transmit, wavefront, network) for route in routes]
        back = out
        if network.transmit != network.receive:
            back = [_one_way(radio, route, aims, kappa, network.receive, wavefront, network) for route in routes]
        moments = np.zeros((len(places), len(table)), np.complex128)
        for (a, b, count), u in zip(pairs, cells, strict=True):
            z = strength * (count * out[a]) * back[b]
            _moments(np.ascontiguousarray(z.real), np.ascontiguousarray(z.imag), u / reach, moments)
        part = (moments * own) @ table
        result = part if weight is None else part * weight if result is None else result + part * weight
    return result * _whole_cells(refs[:, 5], radio.subcarriers)


def _pairs(routes: int, symmetric: bool) -> list[tuple[int, int, float]]:
    """Routes out and back, and how often each pair counts: with equal arrays there and back are the same."""
    if symmetric:
        return [(a, b, 1.0 if a == b else 2.0) for a in range(routes) for b in range(a, routes)]
    return [(a, b, 1.0) for a in range(routes) for b in range(routes)]


def _route(radio: Radar, refs: np.ndarray, origin: np.ndarray, way: Way, name: str) -> _Route:
    d = way.places - radio.station
    offset = way.places - origin[:, None]
    r = np.sqrt(np.einsum("nli,nli->nl", d, d))
    if not r.all():
        n, point = (int(i) for i in np.argwhere(r == 0)[0])
        raise InputError(f"position of point {point} at symbol {n} is that of station {name} (r = 0), expected r > 0")
    # r^2 - r_ref^2 over r + r_ref: a difference of ranges without cancellation.
    excess = np.einsum("nli,nli->nl", offset, 2.0 * refs[:, None, :3] + offset) / (r + refs[:, 3:4])
    psi = (radio.cosine * d[..., 1] - radio.sine * d[..., 0]) / r
    return _Route(r, excess, psi, d[..., 2] / r, way.coefficient)


def _one_way(
    radio: Radar, route: _Route, aims, kappa: float, shape: tuple[int, int], wavefront: bool, network: Network
) -> np.ndarray:
    """Complex factor (N, L) of one array and one route: coefficient, array sum, 1/r and half the two-way phase."""
    if wavefront:
        spacing = SPEED_OF_LIGHT / (2 * network.carrier_hz)
        gain = np.empty(route.range_m.shape, np.complex128)
        _near_field(
            route.range_m, route.psi, route.omega, spacing, np.pi * kappa / spacing, radio.kappa * np.pi, aims[0],
            aims[1], shape[0], shape[1], gain,
        )  # fmt: skip
        turn = -0.5 * radio.turns * route.excess_m
    else:
        h = 0.5 * (kappa * route.psi - radio.kappa * aims[0])
        v = 0.5 * (kappa * route.omega - radio.kappa * aims[1])
        gain = _array_sum(h, shape[0]) * _array_sum(v, shape[1])
        turn = 0.5 * ((shape[0] - 1) * h + (shape[1] - 1) * v) - 0.5 * radio.turns * route.excess_m
    turn -= np.rint(turn)
    return route.coefficient * gain / route.range_m * np.exp(2j * np.pi * turn)


def _array_sum(x: np.ndarray, count: int) -> np.ndarray:
    """sin(pi count x) / sin(pi x) with its limits at whole x."""
    k = np.rint(x)
    f = x - k
    sign = 1.0 - 2.0 * ((k % 2) * ((count - 1) % 2))
    below = np.sin(np.pi * f)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.sin(np.pi * (count * f - 2 * np.rint(0.5 * count * f))) / below
    return sign * np.where(below == 0, float(count), ratio)


@kernel(error_model="numpy")
def _near_field(r, psi, omega, spacing, wave, weight, psi0, omega0, wide, high, out):
    """Array sum of spherical waves: element (i, j) at i d y' + j d z, its range minus r without cancellation."""
    for n in range(r.shape[0]):
        for l in range(r.shape[1]):  # noqa: E741
            total = 0.0j
            for i in range(wide):
                for j in range(high):
                    across, up = i * spacing, j * spacing
                    square = across * across + up * up
                    along = r[n, l] * (across * psi[n, l] + up * omega[n, l])
                    own = np.sqrt(r[n, l] * r[n, l] + square - 2.0 * along)
                    phase = -wave * (square - 2.0 * along) / (own + r[n, l]) - weight * (i * psi0 + j * omega0)
                    total += complex(np.cos(phase), np.sin(phase)) * (r[n, l] / own)
            out[n, l] = total


@kernel(error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
def _moments(real, imag, x, out):
    """Add sum over points of z T_p(x) to out (N, P)."""
    count = x.shape[1]
    before, last = np.empty(count), np.empty(count)
    for n in range(x.shape[0]):
        for l in range(count):  # noqa: E741
            before[l], last[l] = x[n, l], 1.0
        for p in range(out.shape[1]):
            re, im = 0.0, 0.0
            for l in range(count):  # noqa: E741
                t = last[l]
                re += t * real[n, l]
                im += t * imag[n, l]
                last[l] = 2.0 * x[n, l] * t - before[l] if p else x[n, l]
                before[l] = t
            out[n, p] += complex(re, im)


def _round_up(value: float) -> float:
    """Next power of the square root of two, so that few tables serve all samples."""
    return 2.0 ** (np.ceil(2 * np.log2(max(value, 0.25))) / 2)


@lru_cache(maxsize=32)
def _table(reach: float, count: int) -> np.ndarray:
    """Matrix (P, M): eps_p (-j)^p J_p(2 pi (m - (M-1)/2) reach / M), P from the fall of J_p."""
    band = np.pi * reach
    order = int(band) + 8
    while abs(jv(order, band)) > 1e-17:
        order += 1
    p = np.arange(order + 1)
    x = 2 * np.pi * (np.arange(count) - 0.5 * (count - 1)) * reach / count
    scale = np.where(p == 0, 1.0, 2.0) * np.array([1, -1j, -1, 1j])[p % 4]
    return scale[:, None] * jv(p[:, None], x)


def _whole_cells(base: np.ndarray, count: int) -> np.ndarray:
    """Phase (N, M) of the whole range cells `base` (N,) at every subcarrier, reduced in whole numbers."""
    step = 2 * np.arange(count, dtype=np.int64) - (count - 1)
    index = (base.astype(np.int64)[:, None] % (2 * count)) * step % (2 * count)
    return np.exp(-1j * np.pi * np.arange(2 * count) / count)[index]


def _frequencies(network: Network, radio: Radar, squint: bool) -> list[tuple[float, np.ndarray | None]]:
    """Frequencies (relative to the carrier) at which the arrays are evaluated, and their Lagrange weights (M,)."""
    count = radio.subcarriers
    if not squint or count == 1:
        return [(radio.kappa, None)]
    half = 0.5 * (count - 1) * network.subcarrier_spacing_hz / network.carrier_hz
    elements = sum(network.transmit) + sum(network.receive) - 4
    band = np.pi * half * elements
    nodes = int(band) + 4
    while abs(jv(nodes, band)) > 1e-14:
        nodes += 1
    angle = np.pi * (np.arange(nodes) + 0.5) / nodes
    x = np.cos(angle)
    at = np.linspace(-1.0, 1.0, count)
    chebyshev = np.cos(np.arange(nodes)[:, None] * angle) * np.where(np.arange(nodes) == 0, 1.0, 2.0)[:, None] / nodes
    weights = np.cos(np.arange(nodes)[:, None] * np.arccos(at)).T @ chebyshev
    return [(radio.kappa + half + half * x[q], weights[:, q]) for q in range(nodes)]
