"""The frequency response Y[n, m] (Eq. 24) of a moving cloud over any paths, with squint and spherical waves on request.

Over its few range cells a target's response is a smooth function of frequency. So every symbol is summed into
Chebyshev moments of the points' ranges, and one matrix product turns moments into all M subcarriers:
exp(-j B x u) = sum eps_p (-j)^p J_p(B x) T_p(u), |u| <= 1. No array of symbols x points x subcarriers exists.
"""

from collections.abc import Sequence

import numpy as np

from lowalt.common.memory import aligned, aligned_complex
from lowalt.common.network import Network, Station
from lowalt.echo.pointwise.reference_range import CELL, REST, TURN
from lowalt.echo.radar import radar
from lowalt.effects import moment_loops, spread_loops, spread_search, waveform
from lowalt.effects import response_tables as tables
from lowalt.effects.gain_times import Instant, Kept
from lowalt.effects.one_way import ImagePath as ImagePath
from lowalt.effects.one_way import end, range_sum


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
    return rays.summed(np.sqrt(rcs_m2), factor)


class OneWayFactors:
    """All points' one-way factors over every path at given instants, from which responses to any strengths follow.

    The arguments are those of `response`; kept: polynomials of spherical waves that serve several instants of the same
    symbols, filled by the first of them; like: the factors at another instant of the same symbols, whose references
    this instant shares, so that both have moments of the same functions; farther_m: bound of how much any range differs
    between instants that share them (m); instant: how this one gets its array sums, None for by itself; once: whether
    moments are asked for once: factors on the direct path alone are then not kept.
    """

    def __init__(
        self, network: Network, station: Station, places: np.ndarray, aim_m: np.ndarray,
        paths: Sequence[ImagePath] = (), *, squint: bool, wavefront: bool, error: float, kept: dict | None = None,
        sender_aim_m: np.ndarray | None = None, like: "OneWayFactors | None" = None, farther_m: float = 0.0,
        instant: Instant | None = None, once: bool = True,
    ):  # fmt: skip
        self.radio = radio = radar(network, station)
        self.farther_m = farther_m
        self.origin = places[:, 0] if like is None else like.origin
        seen = [ImagePath(places), *paths]
        alone = station.transmitter is None
        chosen, self.refs = end(network, station, seen, aim_m, self.origin, like.refs if like and alone else None)
        sending = chosen
        if station.transmitter is not None:
            out = [path.sender or path for path in seen]
            sender_aim_m = aim_m if sender_aim_m is None else sender_aim_m
            sending, _ = end(network, station.transmitter, out, sender_aim_m, self.origin)
            if station.transmitter.position_m != station.position_m:
                self.refs = range_sum(network, station, self.origin)
        # Error budget: 1/2 for the sampling in frequency, 1/10 each for the series and waves of both arrays, for their
        # sums that follow from other instants, and for the tables.
        self.rest = tenth(error)
        symmetric = network.transmit == network.receive and station.transmitter is None
        self.pairs = _pairs(len(chosen), symmetric)
        self.direct = chosen[0] if once and symmetric and not paths and not wavefront else None
        if self.direct is not None:
            self.out, self.back = [], []
            if like is None:
                *ends, longest = self.direct.spans(network.transmit, squint)
                if squint and farther_m > 0.0:
                    longest = self.direct.longest(network.transmit, False, farther_m)
                self.frames = self._frame(*ends)
                self.nodes = tables.frequencies(network, radio, squint, error / 2, longest)
            else:
                self.frames, self.nodes = like.frames, like.nodes
            self.asked = network.transmit, self.nodes, squint
            return
        longest = None
        # Polynomials are kept for equal frequencies, so instants that share them without `like` need the same.
        if squint and symmetric and like is None and (kept is None or farther_m > 0.0):
            # Instants that are alike differ by less than `farther_m`, in places as in ranges.
            longest = max(path.longest(network.transmit, wavefront, farther_m) for path in chosen)
        self.nodes = like.nodes if like else tables.frequencies(network, radio, squint, error / 2, longest)
        asked = self.nodes, squint, wavefront, self.rest
        self.out = [
            path.one_way(network.transmit, *asked, _own(kept, "out", number), instant)
            for number, path in enumerate(sending)
        ]
        self.back = self.out
        if not symmetric:
            self.back = [
                path.one_way(network.receive, *asked, _own(kept, "back", number), instant)
                for number, path in enumerate(chosen)
            ]
        self.frames = self._frames() if like is None else like.frames

    def summed(self, strength: np.ndarray, factor: np.ndarray | float = 1.0) -> np.ndarray:
        """Return the subcarriers (N, M) of points with these factors (N or 1, L) on their unit two-way amplitudes.

        strength, factor: as in `paired`. Symbols without any strength are zero.
        """
        return self.spectrum(self.moments(self.paired(strength, factor)))

    def paired(self, strength: np.ndarray, factor: np.ndarray | float = 1.0) -> list[np.ndarray]:
        """Return the amplitudes (N or 1, L) of each pair of paths, the same at all instants of the symbols.

        strength, factor: their product, (N or 1, L) on the points' unit two-way amplitudes, also (R, N, L), factors of
        their own for each path there and back; for a way out by path a and back by path b, the factor is the geometric
        mean of those of a and b; or (R, R, N, L), the factors of every way out and way back.
        """
        strength = np.atleast_2d(self.radio.scale * strength * factor)
        if strength.ndim == 4:
            return [strength[a, b] for a, b, _ in self.pairs]
        if strength.ndim == 3:
            return [strength[a] if a == b else np.sqrt(strength[a] * strength[b]) for a, b, _ in self.pairs]
        return [strength for _ in self.pairs]

    def moments(self, paired: list[np.ndarray]) -> list[np.ndarray]:
        """Return real and imaginary parts (N, 2, P) of each pair of paths' coefficients, from which `spectrum` follows.

        paired: the amplitudes that `paired` gives.
        """
        half_cells, result, nodes = 0.5 * self.radio.cells, [], len(self.nodes)
        for (a, b, times), (middle, reach), own in zip(self.pairs, self.frames, paired, strict=True):
            orders = len(tables.table(reach, self.radio.subcarriers, self.rest))
            found = np.empty((len(self.refs), 2, nodes, orders))
            if self.direct is not None:
                self.direct.moments(*self.asked, own, middle, half_cells, reach, found)
            else:
                there, home, count = self.out[a], self.back[b], self.out[a].excess.shape[1]
                rows = moment_loops.SUM_ROWS + (orders if nodes > 1 else 0)
                moment_loops.moments(
                    own, there.factors, home.factors, times, there.excess, home.excess, middle, half_cells, reach,
                    np.empty((rows, moment_loops.padded(count))), np.empty(count, np.int64), found,
                )  # fmt: skip
            planes = found.reshape(2 * len(self.refs), -1)
            if nodes > 1:
                planes = planes @ self.joined(reach)[0]
            result.append(planes.reshape(len(self.refs), 2, -1))
        return result

    def leave_out_direct(self) -> None:
        """Leave the way there and back by the direct path out of all that follows, as its echo is known."""
        self.pairs, self.frames = self.pairs[1:], self.frames[1:]

    def spectrum(self, moments: list[np.ndarray], onto: np.ndarray | None = None) -> np.ndarray:
        """Return the subcarriers (N, M) of each pair of paths' `moments`, or of sums of such of instants alike.

        onto: subcarriers (N, M) to which they are added, None for none.
        """
        return self._spread(moments, np.empty((0, self.radio.subcarriers), np.complex128), onto)

    def tones(self, moments: list[np.ndarray], data: np.ndarray) -> np.ndarray:
        """Return the tones (N, M) (`waveform.tones_of`) of symbols that carry data (N, M), of these `moments`."""
        if len(moments) > 1:
            return waveform.tones_of(self.spectrum(moments), data)
        return self._spread(moments, np.ascontiguousarray(data))

    def searched(self, moments: list[np.ndarray], signs: np.ndarray | None) -> tuple[np.ndarray, ...]:
        """Return what `spread_search.spread_and_search` does of the `moments` of the only pair of paths."""
        given = moments[0], self.functions(self.frames[0][1]), *self.delays(0)
        return spread_search.spread_and_search(given, self.radio.subcarriers, signs)

    def _spread(self, moments: list[np.ndarray], data: np.ndarray, onto: np.ndarray | None = None) -> np.ndarray:
        """The subcarriers (N, M) of moments, added to `onto`, or with data (N, M) the tones of those of one pair."""
        count, half = self.radio.subcarriers, (self.radio.subcarriers + 1) // 2
        work = aligned(4, half), aligned(2, half), aligned(2, count)
        result = aligned_complex(len(self.refs), count) if onto is None else onto
        for number, (planes, (_, reach)) in enumerate(zip(moments, self.frames, strict=True)):
            given = planes, self.functions(reach), *self.delays(number)
            spread_loops.spread(*given, *work, number == 0 and onto is None, data, result)
        return result

    def delays(self, number: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return a pair's own phase factors (N,), whole range cells (N,) and the rest of the delay in cells (N,)."""
        own, whole = np.exp(-2j * np.pi * self.refs[:, TURN]), self.refs[:, CELL].astype(np.int64)
        return own, whole, self.refs[:, REST] + self.frames[number][0]

    def largest(self, moments: list[np.ndarray]) -> float:
        """Return a bound of the largest subcarrier of `moments`: each order's function counts by its largest value."""
        return sum(
            spread_loops.largest(planes, tables.peaks(reach, len(self.nodes), self.radio.subcarriers, self.rest))
            for planes, (_, reach) in zip(moments, self.frames, strict=True)
        )

    def functions(self, reach: float) -> np.ndarray:
        """Return the values (P, M) at the subcarriers of the functions that moments over `reach` multiply."""
        if len(self.nodes) > 1:
            return self.joined(reach)[1]
        return tables.table(reach, self.radio.subcarriers, self.rest)

    def joined(self, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Return tables that join the moments at several frequencies (`response_tables.joined`)."""
        return tables.joined(reach, len(self.nodes), self.radio.subcarriers, self.rest)

    def _frame(self, low: np.ndarray, high: np.ndarray) -> list[tuple[np.ndarray, float]]:
        """The middle (N,) and reach of the direct path's ranges (cells), which run from low to high (N,) m."""
        reach = 0.5 * self.radio.cells * (float((high - low).max()) + 2.0 * self.farther_m)
        return [(0.5 * self.radio.cells * (low + high), tables.round_up(reach))]

    def _frames(self) -> list[tuple[np.ndarray, float]]:
        """Middle (N,) and reach of each pair's ranges (cells). Few orders matter where a pair has its own middle."""
        half_cells, result = 0.5 * self.radio.cells, []
        out = [one.span() for one in self.out]
        back = out if self.back is self.out else [one.span() for one in self.back]
        for a, b, _ in self.pairs:
            (there, far), (home, near) = out[a], back[b]
            reach = half_cells * (far + near + 2.0 * self.farther_m)
            result.append((half_cells * (there + home), tables.round_up(reach)))
        return result


def tenth(error: float) -> float:
    """Return a tenth of an error, rounded down to a power of ten, so that a cached table serves many samples."""
    return 10.0 ** np.floor(np.log10(error / 10))


def _own(kept: dict | None, *key) -> Kept | None:
    """The part of `kept` that belongs to one array over one path, None where nothing is kept."""
    return None if kept is None else kept.setdefault(key, Kept())


def _pairs(paths: int, symmetric: bool) -> list[tuple[int, int, float]]:
    """Pairs (path out, path back) and their weights; with equal arrays, (a, b) stands for (b, a) too."""
    if symmetric:
        return [(a, b, 1.0 if a == b else 2.0) for a in range(paths) for b in range(a, paths)]
    return [(a, b, 1.0) for a in range(paths) for b in range(paths)]
