"""The frequency response of a moving cloud over any routes: Y[n, m] of Eq. 24 and what goes beyond it.

Over its few range cells a target's response is a smooth function of frequency. So every symbol is summed into
Chebyshev moments of the points' ranges, and one matrix product turns moments into all M subcarriers:
exp(-j B x u) = sum eps_p (-j)^p J_p(B x) T_p(u), |u| <= 1. No array of symbols x points x subcarriers exists.
"""

from collections.abc import Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.special import factorial, jv

from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo.pointwise.reference_range import reference
from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import Radar, radar
from lowalt.effects import interpolation, rays


class Way(NamedTuple):
    """One route between a station and every point.

    places: (N, L, 3) m, where the station sees the points (their images); coefficient: the route's complex factor
    beside 1/r, a number or (N, L).
    """

    places: np.ndarray
    coefficient: np.ndarray | complex = 1.0


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
    error: float = 1e-14,
) -> np.ndarray:
    """Return the subcarriers Y (N, M) complex128 of points at `places` (N, L, 3) m, the known symbol removed.

    rcs_m2: (L,) m2; aim_m: (3,) m, where both beams point; ways: routes beside the direct one: waves go out by any and
    come back by any; factor: real factor on every point's two-way amplitude, (N, L); squint: the arrays' phases
    follow each subcarrier's frequency while the beams' weights do not; wavefront: elements see spherical waves; error:
    of all that is interpolated or cut off here, relative to the sum of peak amplitudes.
    Raises: InputError for a point in the station. Source: paper Eqs. 4, 7 and 24; Jacobi-Anger expansion.
    """
    radio = radar(network, station)
    refs = reference(places[:, 0], radio.station, radio.turns, radio.turns_lo, radio.cells, radio.cells_lo)
    aims = aim_cosines(np.asarray(aim_m, np.float64), radio.station, radio.sine, radio.cosine)
    chosen = [_Route(network, station.name, radio, refs, places[:, 0], aims, way) for way in (Way(places), *ways)]
    strength = np.atleast_2d(radio.scale * np.sqrt(rcs_m2) * factor)
    symmetric = network.transmit == network.receive
    pairs = _pairs(len(chosen), symmetric)
    result = np.zeros((len(places), radio.subcarriers), np.complex128)
    own = np.exp(-2j * np.pi * refs[:, 4])
    # Half for the frequencies, a tenth each for what is cheap: series and waves of both arrays, and the table. A power
    # of ten, so that what is made for it serves many samples.
    kappas, weights = _frequencies(network, radio, squint, error / 2)
    rest = 10.0 ** np.floor(np.log10(error / 10))
    out = [route.one_way(network.transmit, kappas, squint, wavefront, rest) for route in chosen]
    back = out if symmetric else [route.one_way(network.receive, kappas, squint, wavefront, rest) for route in chosen]
    widest = max(float(abs(excess).max()) for _, excess in (*out, *back))
    reach = _round_up(float(abs(refs[:, 6]).max()) + radio.cells * widest)
    table = _table(reach, radio.subcarriers, rest)
    sums = np.zeros((len(kappas), len(places), len(table)), np.complex128)
    for a, b, times in pairs:
        (there, excess_a), (home, excess_b) = out[a], back[b]
        rays.moments(
            strength, there, home, times, refs[:, 6], excess_a, excess_b, 0.5 * radio.cells, reach, sums
        )  # fmt: skip
    for one, weight in zip(sums, weights, strict=True):
        rays.spread(one, own, table, weight, result)
    return result * _whole_cells(refs[:, 5], radio.subcarriers)


class _Route:
    """One way, and the complex factors of an array over it."""

    def __init__(self, network: Network, name: str, radio: Radar, refs, origin, aims, way: Way):
        self.network, self.name, self.radio, self.refs, self.origin = network, name, radio, refs, origin
        self.aims, self.places = aims, np.ascontiguousarray(way.places, np.float64)
        self.coefficient = np.atleast_2d(np.asarray(way.coefficient, np.complex128))

    def one_way(
        self, shape: tuple[int, int], kappas: np.ndarray, squint: bool, wavefront: bool, error: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return (Q, N, L), coefficient, array sum, 1/r and half the two-way phase, and the excess range (N, L) m.

        kappas: the arrays' frequencies (Q,) over the carrier. Raises: InputError for a point in the station.
        """
        radio, axes = self.radio, (self.radio.sine, self.radio.cosine)
        spacing = SPEED_OF_LIGHT / (2 * self.network.carrier_hz)
        count = self.places.shape[:2]
        out, excess = np.empty((len(kappas), *count), np.complex128), np.empty(count)
        gains = np.empty((0, 0, 0), np.complex128)
        if wavefront:
            gains = np.empty_like(out)
            centre = 0.5 * (kappas.min() + kappas.max())
            series = _series(np.pi * (kappas - centre) / spacing, spacing * _half_diagonal(shape), error)
            rays.near_field(
                self.places, radio.station, axes, spacing, 0.5 * centre / spacing, radio.kappa, self.aims, shape,
                series, rays.waves(error), gains,
            )  # fmt: skip
        fault = rays.routes(
            self.places, radio.station, axes, self.refs, self.origin, 0.5 * radio.turns, spacing, self.aims,
            radio.kappa, kappas, squint, shape, self.coefficient, gains, out, excess,
        )  # fmt: skip
        if fault:
            raise InputError(
                f"position of a point at symbol {(fault - 1) // count[1]} is that of station {self.name} (r = 0), "
                "expected r > 0"
            )
        return out, excess


def _half_diagonal(shape: tuple[int, int]) -> float:
    """Distance of an array's corner from its middle, in spacings: no path differs by more from the middle's."""
    return 0.5 * float(np.hypot(shape[0] - 1, shape[1] - 1))


def _series(rates: np.ndarray, longest: float, error: float) -> np.ndarray:
    """Terms (Q, K) of exp(-j rate s) as a series in s, |s| <= `longest`, K so that the rest is below `error`."""
    band = float(abs(rates).max()) * longest
    count, term = 1, band
    # The rest is at most e^band times its first term.
    while term * np.exp(band) > error:
        count += 1
        term *= band / count
    order = np.arange(count)
    return (-1j * rates[:, None]) ** order / factorial(order)


def _pairs(routes: int, symmetric: bool) -> list[tuple[int, int, float]]:
    """Routes out and back, and how often each pair counts: with equal arrays there and back are the same."""
    if symmetric:
        return [(a, b, 1.0 if a == b else 2.0) for a in range(routes) for b in range(a, routes)]
    return [(a, b, 1.0) for a in range(routes) for b in range(routes)]


def _round_up(value: float) -> float:
    """Next power of the square root of two, so that few tables serve all samples."""
    return 2.0 ** (np.ceil(2 * np.log2(max(value, 0.25))) / 2)


@lru_cache(maxsize=32)
def _table(reach: float, count: int, error: float) -> np.ndarray:
    """Matrix (P, M): eps_p J_p(2 pi (m - (M-1)/2) reach / M), P from the fall of J_p: the rest is below `error`."""
    band = np.pi * reach
    order = int(band) + 1
    # From there on J_p falls faster than by half.
    while 4.0 * abs(jv(order + 1, band)) > error:
        order += 1
    p = np.arange(order + 1)
    x = 2 * np.pi * (np.arange(count) - 0.5 * (count - 1)) * reach / count
    return np.where(p == 0, 1.0, 2.0)[:, None] * jv(p[:, None], x)


def _whole_cells(base: np.ndarray, count: int) -> np.ndarray:
    """Phase (N, M) of the whole range cells `base` (N,) at every subcarrier, reduced in whole numbers."""
    step = 2 * np.arange(count, dtype=np.int64) - (count - 1)
    index = (base.astype(np.int64)[:, None] % (2 * count)) * step % (2 * count)
    return np.exp(-1j * np.pi * np.arange(2 * count) / count)[index]


def _frequencies(network: Network, radio: Radar, squint: bool, error: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies (Q,) over the carrier at which the arrays are evaluated, and their Lagrange weights (Q, M).

    What changes with frequency beside the middles' phases, which count as range, are paths against the middles'.
    """
    count = radio.subcarriers
    if not squint or count == 1:
        return np.array([radio.kappa]), np.ones((1, count))
    half = 0.5 * (count - 1) * network.subcarrier_spacing_hz / network.carrier_hz
    band = np.pi * half * (_half_diagonal(network.transmit) + _half_diagonal(network.receive))
    # Interpolation of exp(j B x) errs by at most 4 sum over p >= nodes of |J_p(B)|, and J_p falls faster than by half.
    nodes = int(band) + 2
    while 8.0 * abs(jv(nodes, band)) > error:
        nodes += 1
    x, weights = interpolation.points(nodes), interpolation.weights(nodes, np.linspace(-1.0, 1.0, count))
    return radio.kappa + half + half * x, np.ascontiguousarray(weights.T)
