"""The frequency response Y[n, m] (Eq. 24) of a moving cloud over any paths, with squint and spherical waves on request.

Over its few range cells a target's response is a smooth function of frequency. So every symbol is summed into
Chebyshev moments of the points' ranges, and one matrix product turns moments into all M subcarriers:
exp(-j B x u) = sum eps_p (-j)^p J_p(B x) T_p(u), |u| <= 1. No array of symbols x points x subcarriers exists.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo.pointwise.reference_range import CELL, REST, TURN, reference
from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import Radar, radar
from lowalt.effects import moment_loops, near_field, response_loops
from lowalt.effects import response_tables as tables


class ImagePath(NamedTuple):
    """A one-way propagation path between a station and every point, given by the points' images.

    places: (N, L, 3) m, where the station sees the points (their images); coefficient: the path's complex factor in
    addition to 1/r, a number or (N, L); station_m: (3,) m, the station's image, where the points see the station;
    sender: on a link, the path of the same kind between the sender and the points, None where both are alike.
    """

    places: np.ndarray
    coefficient: np.ndarray | complex = 1.0
    station_m: np.ndarray | None = None
    sender: "ImagePath | None" = None


def response(
    network: Network,
    station: Station,
    places: np.ndarray,
    rcs_m2: np.ndarray,
    aim_m: np.ndarray,
    *,
    sender_aim_m: np.ndarray | None = None,
    paths: Sequence[ImagePath] = (),
    factor: np.ndarray | float = 1.0,
    squint: bool = False,
    wavefront: bool = False,
    error: float = 1e-14,
) -> np.ndarray:
    """Return the subcarriers Y (N, M) complex128 of points at `places` (N, L, 3) m, the known symbol removed.

    rcs_m2: (L,) m2; aim_m: (3,) m, where both beams point, on a link the receiver's; sender_aim_m: where the sender's
    points, None for the same; paths: all but the direct one; waves go out by any path and come back by any; factor:
    real factor on every point's two-way amplitude, (N, L), or (R, N, L) for each of the R routes there and back by one
    path, the direct one first, or (R, R, N, L) by the way out and the way back; squint: the arrays' phases
    follow each subcarrier's frequency while the beams' weights do not; wavefront: elements see spherical waves; error:
    largest error of interpolation and truncation together, relative to the sum of peak amplitudes.
    A link goes out by its transmitter's array and paths, and comes back by its receiver's.
    Raises: InputError for a point in the station. Source: paper Eqs. 4, 7 and 24;
    Jacobi-Anger expansion; Willis, Bistatic Radar, 2nd ed. 1995, ch. 3, for links.
    """
    asked = {"squint": squint, "wavefront": wavefront, "error": error}
    rays = OneWayFactors(network, station, places, aim_m, paths, sender_aim_m=sender_aim_m, **asked)
    return rays.summed(np.sqrt(rcs_m2) * factor)


class OneWayFactors:
    """All points' one-way factors over every path at given instants, from which responses to any strengths follow.

    The arguments are those of `response`; kept: polynomials of spherical waves that serve several instants of the same
    symbols, filled by the first of them.
    """

    def __init__(
        self, network: Network, station: Station, places: np.ndarray, aim_m: np.ndarray,
        paths: Sequence[ImagePath] = (), *, squint: bool, wavefront: bool, error: float, kept: dict | None = None,
        sender_aim_m: np.ndarray | None = None,
    ):  # fmt: skip
        self.radio = radio = radar(network, station)
        seen = [ImagePath(places), *paths]
        chosen, self.refs = _end(network, station, seen, aim_m)
        sending = chosen
        if station.transmitter is not None:
            out = [path.sender or path for path in seen]
            sending, _ = _end(network, station.transmitter, out, aim_m if sender_aim_m is None else sender_aim_m)
            if station.transmitter.position_m != station.position_m:
                self.refs = _range_sum(network, station, places[:, 0])
        # Error budget: 1/2 for the sampling in frequency, 1/10 each for the series and waves of both arrays and for the
        # tables. The tenth is rounded down to a power of ten, so that a cached table serves many samples.
        self.nodes = kappas = tables.frequencies(network, radio, squint, error / 2)
        self.rest = 10.0 ** np.floor(np.log10(error / 10))
        symmetric = network.transmit == network.receive and station.transmitter is None
        self.pairs = _pairs(len(chosen), symmetric)
        asked = kappas, squint, wavefront, self.rest
        self.out = [
            path.one_way(network.transmit, *asked, _own(kept, "out", number)) for number, path in enumerate(sending)
        ]
        self.back = self.out
        if not symmetric:
            self.back = [
                path.one_way(network.receive, *asked, _own(kept, "back", number)) for number, path in enumerate(chosen)
            ]

    def summed(self, strength: np.ndarray) -> np.ndarray:
        """Return the subcarriers (N, M) of points with these factors (N or 1, L) on their unit two-way amplitudes.

        strength: also (R, N, L), factors of their own for each path there and back; for a way
        out by path a and back by path b, the factor is the geometric mean of those of a and b; or (R, R, N, L), the
        factors of every way out and way back. Symbols without any strength are zero.
        """
        radio, refs = self.radio, self.refs
        strength = radio.scale * np.atleast_2d(strength)
        own, whole = np.exp(-2j * np.pi * refs[:, TURN]), refs[:, CELL].astype(np.int64)
        result = np.zeros((len(refs), radio.subcarriers), np.complex128)
        for a, b, times in self.pairs:
            there, home = self.out[a], self.back[b]
            # Each pair's ranges are measured from their own middle, so that few orders of its moments matter.
            middle = 0.5 * radio.cells * (there.middle + home.middle)
            reach = tables.round_up(0.5 * radio.cells * (there.reach + home.reach))
            bessel = tables.table(reach, radio.subcarriers, self.rest)
            orders = np.empty((len(refs), 2, len(self.nodes), len(bessel)))
            paired = strength
            if strength.ndim == 4:
                paired = strength[a, b]
            elif strength.ndim == 3:
                paired = strength[a] if a == b else np.sqrt(strength[a] * strength[b])
            moment_loops.moments(
                paired, there.factors, home.factors, times, there.excess, home.excess, middle, 0.5 * radio.cells,
                reach, orders,
            )  # fmt: skip
            planes, table = orders.reshape(2 * len(refs), -1), bessel
            if len(self.nodes) > 1:
                mix, table = tables.joined(reach, len(self.nodes), radio.subcarriers, self.rest)
                planes = planes @ mix
            planes = (planes @ table).reshape(len(refs), 2, -1)
            moment_loops.delayed(planes, own, whole, refs[:, REST] + middle, result)
        return result


def _own(kept: dict | None, *key) -> dict | None:
    """The part of `kept` that belongs to one array over one path, None where nothing is kept."""
    return None if kept is None else kept.setdefault(key, {})


class _OneWay(NamedTuple):
    """One array over one path: factors (Q, N, L), excess range (N, L), its middle (N,) and reach to either side (m)."""

    factors: np.ndarray
    excess: np.ndarray
    middle: np.ndarray
    reach: float


def _end(network: Network, station: Station, paths: Sequence[ImagePath], aim_m: np.ndarray) -> tuple[list, np.ndarray]:
    """The paths as one station's arrays see them, and the ranges of the first path's first point from it."""
    radio = radar(network, station)
    origin = paths[0].places[:, 0]
    refs = reference(origin, radio)
    aims = aim_cosines(np.asarray(aim_m, np.float64), radio.station, radio.sine, radio.cosine)
    return [_PathFactors(network, station.name, radio, refs, origin, aims, path) for path in paths], refs


def _range_sum(network: Network, station: Station, origin: np.ndarray) -> np.ndarray:
    """Reference ranges of a link: both ways added, whole turns and range cells carried.

    Each way's fraction is rounded before the sum, which is off by at most 2^-53 of a turn.
    """
    table = _one_way(network, station, origin) + _one_way(network, station.transmitter, origin)
    carried = np.rint(table[:, REST])
    table[:, TURN] -= np.rint(table[:, TURN])
    table[:, CELL] += carried
    table[:, REST] -= carried
    return table


def _one_way(network: Network, station: Station, origin: np.ndarray) -> np.ndarray:
    """Reference ranges with half of the two-way turns and range cells. Halving a double is exact."""
    radio = radar(network, station)
    halves = {name: 0.5 * getattr(radio, name) for name in ("turns", "turns_lo", "cells", "cells_lo")}
    return reference(origin, radio._replace(**halves))


class _PathFactors:
    """One path, and the complex factors that an array has over it."""

    def __init__(self, network: Network, name: str, radio: Radar, refs, origin, aims, path: ImagePath):
        self.network, self.name, self.radio, self.refs, self.origin = network, name, radio, refs, origin
        self.aims, self.places = aims, np.asarray(path.places, np.float64)
        self.coefficient = np.atleast_2d(np.asarray(path.coefficient, np.complex128))

    def one_way(
        self, shape: tuple[int, int], kappas: np.ndarray, squint: bool, wavefront: bool, error: float,
        kept: dict | None,
    ) -> _OneWay:  # fmt: skip
        """Return coefficient, array sum, 1/r and half the two-way phase of all points, and their excess range.

        kappas: the arrays' frequencies (Q,) over the carrier; kept: as in `near_field.sums`.
        Raises: InputError for a point in the station.
        """
        radio, axes = self.radio, (self.radio.sine, self.radio.cosine)
        spacing = SPEED_OF_LIGHT / (2 * self.network.carrier_hz)
        count = self.places.shape[:2]
        out, excess = np.empty((len(kappas), *count), np.complex128), np.empty(count)
        gains = np.empty((0, 0, 0), np.complex128)
        if wavefront:
            gains = np.empty_like(out)
            centre = 0.5 * (kappas.min() + kappas.max())
            series = tables.series(
                np.pi * (kappas - centre) / spacing, spacing * tables.half_diagonal(shape), error / 40
            )
            array = near_field.Arrays(
                radio.station, axes, spacing, 0.5 * centre / spacing, radio.kappa, self.aims, shape, series,
                response_loops.waves(error / 40), 0.5 * float(kappas.max()) / spacing,
            )  # fmt: skip
            near_field.sums(self.places, array, error, gains, kept)
        fault = response_loops.one_way(
            np.ascontiguousarray(self.places.swapaxes(1, 2)), radio.station, axes, self.refs, self.origin,
            0.5 * radio.turns, spacing, self.aims, radio.kappa, kappas, squint, shape, self.coefficient, gains, out,
            excess,
        )  # fmt: skip
        if fault:
            raise InputError(
                f"position of a point at symbol {(fault - 1) // count[1]} is that of station {self.name} (r = 0), "
                "expected r > 0"
            )
        low, high = excess.min(axis=1), excess.max(axis=1)
        return _OneWay(out, excess, 0.5 * (low + high), float(0.5 * (high - low).max()))


def _pairs(paths: int, symmetric: bool) -> list[tuple[int, int, float]]:
    """Pairs (path out, path back) and their weights; with equal arrays, (a, b) stands for (b, a) too."""
    if symmetric:
        return [(a, b, 1.0 if a == b else 2.0) for a in range(paths) for b in range(a, paths)]
    return [(a, b, 1.0) for a in range(paths) for b in range(paths)]
