"""One array's complex factors over one path to every point: coefficient, array sum, 1/r and half the two-way phase."""

from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.memory import aligned
from lowalt.common.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo import Rigid
from lowalt.echo.pointwise.reference_range import CELL, RANGE, REST, TURN, reference
from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import Radar, radar
from lowalt.effects import direct_loops, near_field, response_loops, waves
from lowalt.effects import response_tables as tables
from lowalt.effects.gain_times import ONE, Instant, Kept
from lowalt.effects.moment_loops import extremes, padded


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


class OneWay(NamedTuple):
    """One array over one path: factors (2, Q, N, L), real and imaginary, and excess range (N, L) (m)."""

    factors: np.ndarray
    excess: np.ndarray

    def span(self) -> tuple[np.ndarray, float]:
        """Return the middle (N,) of each symbol's excess ranges, and their largest reach to either side (m)."""
        low, high = np.empty((2, len(self.excess)))
        extremes(self.excess, low, high)
        return 0.5 * (low + high), float(0.5 * (high - low).max())


def end(
    network: Network, station: Station, paths: Sequence[ImagePath], aim_m: np.ndarray, origin: np.ndarray,
    refs: np.ndarray | None = None,
) -> tuple[list, np.ndarray]:  # fmt: skip
    """Return the paths as one station's arrays see them, and the ranges from it of the points (N, 3) `origin`.

    refs: these ranges (N, 7) where they are known.
    """
    radio = radar(network, station)
    refs = reference(origin, radio) if refs is None else refs
    aims = aim_cosines(np.asarray(aim_m, np.float64), radio.station, radio.sine, radio.cosine)
    return [PathFactors(network, station.name, radio, refs, origin, aims, path) for path in paths], refs


def range_sum(network: Network, station: Station, origin: np.ndarray) -> np.ndarray:
    """Return reference ranges of a link, (N, 7): both ways added, whole turns and range cells carried.

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


class PathFactors:
    """One path, and the complex factors that an array has over it."""

    def __init__(self, network: Network, name: str, radio: Radar, refs, origin, aims, path: ImagePath):
        self.network, self.name, self.radio, self.refs, self.origin = network, name, radio, refs, origin
        self.aims, self.places = aims, np.asarray(path.places, np.float64)
        self.coefficient = np.atleast_2d(np.asarray(path.coefficient, np.complex128))

    def one_way(
        self, shape: tuple[int, int], kappas: np.ndarray, squint: bool, wavefront: bool, error: float,
        kept: Kept | None, instant: Instant | None,
    ) -> OneWay:  # fmt: skip
        """Return coefficient, array sum, 1/r and half the two-way phase of all points, and their excess range.

        kappas: the arrays' frequencies (Q,) over the carrier; kept: what instants of the same symbols share, where this
        is the `instant`.
        Raises: InputError for a point in the station.
        """
        radio, axes = self.radio, (self.radio.sine, self.radio.cosine)
        spacing = SPEED_OF_LIGHT / (2 * self.network.carrier_hz)
        count = self.places.shape[:2]
        out, excess = np.empty((2, len(kappas), *count)), np.empty(count)
        gains, shares = np.empty((0, 0, 0, 0), np.complex128), ONE
        if wavefront:
            wave, series, highest = _spherical(tuple(kappas.tolist()), spacing, shape, error / 40)
            array = near_field.Arrays(
                radio.station, axes, spacing, wave, radio.kappa, self.aims, shape, series, waves.waves(error / 40),
                highest,
            )  # fmt: skip
            if kept is None:
                gains = np.empty((1, *out.shape[1:]), np.complex128)
                near_field.sums(self.places, array, error, gains[0])
            else:
                gains, shares = kept.sums(self.places, array, error, len(kappas), instant)
        fault = response_loops.one_way(
            self._planes, radio.station, axes, self.refs, self.origin,
            0.5 * radio.turns, spacing, self.aims, radio.kappa, kappas, *_stepped(kappas), squint, shape,
            self.coefficient, gains, shares, np.empty((13, count[1])), *np.empty((2, len(kappas), count[1])),
            np.empty(count[1], np.complex128), out, excess,
        )  # fmt: skip
        self._check(fault)
        return OneWay(out, excess)

    def spans(self, shape: tuple[int, int], squint: bool) -> tuple[np.ndarray, np.ndarray, float]:
        """Return bounds of each symbol's least and largest excess range (N,) of the points (m), as `one_way` counts.

        With squint they count from the origin's range to the array's middle, which the bounds hold too. The third is a
        bound of how much longer an element's path to a point is than the middle's, in spacings.
        """
        low, high, turn = np.empty((3, len(self.places)))
        spacing = SPEED_OF_LIGHT / (2 * self.network.carrier_hz)
        half_m = tables.half_diagonal(shape) * spacing if squint else 0.0
        direct_loops.spans(self._planes, self.refs, self.origin, half_m, low, high, turn)
        if not squint:
            return low, high, 0.0
        away, wide, tall = self.origin - self.radio.station, 0.5 * (shape[0] - 1), 0.5 * (shape[1] - 1)
        with np.errstate(divide="ignore", invalid="ignore"):
            across = (self.radio.cosine * away[:, 1] - self.radio.sine * away[:, 0]) / self.refs[:, RANGE]
            up = away[:, 2] / self.refs[:, RANGE]
        ahead = (wide * across + tall * up) * spacing
        longest = wide * np.minimum(abs(across) + turn, 1.0) + tall * np.minimum(abs(up) + turn, 1.0)
        longest = np.nan_to_num(longest, nan=np.inf).max()
        return low - ahead, high - ahead, float(min(longest, tables.half_diagonal(shape)))

    def longest(self, shape: tuple[int, int], wavefront: bool, moved_m: float) -> float:
        """Return a bound of how much longer an element's path to a point is than the middle's, in spacings.

        moved_m: how far points move at most from where they are. Paths to an element at e from the middle differ by
        -e u, where the direction u changes by at most 2 `moved_m` / r. A spherical wave's direction to any place of the
        array differs from that to its corner by at most 2 d / r, d the array's diagonal.
        """
        spacing, half = SPEED_OF_LIGHT / (2 * self.network.carrier_hz), tables.half_diagonal(shape)
        wide, tall = 0.5 * (shape[0] - 1), 0.5 * (shape[1] - 1)
        most, least = direct_loops.slants(self._planes, *self._axes, wide, tall)
        room = np.sqrt(least) - moved_m
        if not room > 0.0:
            return half
        turn = 2.0 * moved_m + (4.0 * half * spacing if wavefront else 0.0)
        return min(half, (1.0 + 1e-12) * float(np.sqrt(most) + half * turn / room))

    def moments(
        self, shape: tuple[int, int], kappas: np.ndarray, squint: bool, strength: np.ndarray, middle: np.ndarray,
        half_cells: float, reach: float, result: np.ndarray,
    ) -> None:  # fmt: skip
        """Fill result (N, 2, Q, P) with the moments of the echo on this path alone, as plane waves there and back.

        strength: (N or 1, L); middle, half_cells, reach: as in `moment_loops.moments`; the others as in `one_way`.
        Raises: InputError for a point in the station.
        """
        given, work = self._plane_waves(kappas, squint, shape, result.shape[3])
        fault = direct_loops.moments(self._planes, *given, strength, middle, half_cells, reach, *work, result)
        self._check(fault)

    def moments_in_time(
        self, motion: Rigid, matrix: np.ndarray, asked: tuple, strength: np.ndarray, frame: tuple[np.ndarray, float],
        half_cells: float, result: np.ndarray,
    ) -> None:  # fmt: skip
        """Fill result (K, N, 2, Q, P) with matrix (K, T) times the moments at T instants of the symbols.

        motion: poses at all instants, (T N, ...), the first instant of all symbols first; asked: shape, kappas and
        squint, frame: middle and reach of `moments`, as the others.
        Raises: InputError for a point in the station.
        """
        (shape, kappas, squint), (middle, reach) = asked, frame
        given, work = self._plane_waves(kappas, squint, shape, result.shape[4])
        rotation, translation = motion.rotation, np.ascontiguousarray(motion.translation)
        # Nodes of a recording have places alone.
        rotation = np.ascontiguousarray(rotation) if rotation.strides[0] else np.empty((0, *rotation.shape[1:]))
        fault = direct_loops.moments_in_time(
            rotation, translation, np.ascontiguousarray(motion.points.T), np.asarray(motion.part, np.int64), matrix,
            *given, strength, middle, half_cells, reach, *work, np.empty((matrix.shape[1], *result.shape[2:])), result,
        )  # fmt: skip
        self._check(fault)

    def _plane_waves(
        self, kappas: np.ndarray, squint: bool, shape: tuple[int, int], orders: int
    ) -> tuple[tuple, tuple]:
        """What `direct_loops.moments` asks for besides places and strengths, and its work space for so many orders."""
        radio, size = self.radio, padded(self.places.shape[1])
        rows = direct_loops.ROWS + (orders if len(kappas) > 1 else 0)
        given = (
            *self._axes, self.refs, self.origin, 0.5 * radio.turns, SPEED_OF_LIGHT / (2 * self.network.carrier_hz),
            self.aims, radio.kappa, kappas, *_stepped(kappas), squint, shape,
        )  # fmt: skip
        return given, (aligned(rows, size), *aligned(2, len(kappas), size))

    @property
    def _axes(self) -> tuple[np.ndarray, tuple[float, float]]:
        """The station's place (3,) m, and sine and cosine of its normal."""
        return self.radio.station, (self.radio.sine, self.radio.cosine)

    @cached_property
    def _planes(self) -> np.ndarray:
        """The points' places (N, 3, L) m."""
        return np.ascontiguousarray(self.places.swapaxes(1, 2))

    def _check(self, fault: int) -> None:
        """Raise InputError where a loop has found a point in the station, n L + l + 1."""
        if fault:
            raise InputError(
                f"position of a point at symbol {(fault - 1) // self.places.shape[1]} is that of station {self.name} "
                "(r = 0), expected r > 0"
            )


@lru_cache(maxsize=64)
def _spherical(
    given: tuple[float, ...], spacing: float, shape: tuple[int, int], error: float
) -> tuple[float, np.ndarray, float]:  # fmt: skip
    """What `near_field.Arrays` holds of the frequencies `given`: wave, series and highest; series must not change."""
    kappas, centre = np.array(given), 0.5 * (min(given) + max(given))
    series = tables.series(np.pi * (kappas - centre) / spacing, spacing * tables.half_diagonal(shape), error)
    return 0.5 * centre / spacing, series, 0.5 * max(given) / spacing


def _stepped(kappas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Half of how far frequencies over the carrier are from their middle (Q,), and the waves that hold for it."""
    return _stepped_at(tuple(kappas.tolist()))


@lru_cache(maxsize=64)
def _stepped_at(given: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    """What `_stepped` returns for these frequencies, which must not be changed."""
    kappas = np.array(given)
    steps = 0.5 * (kappas - 0.5 * (kappas[0] + kappas[-1]))
    # Every Chebyshev point has a mirror image about the middle; rounding may part the two in the last digit.
    steps = 0.5 * (steps - steps[::-1])
    return steps, waves.waves_within(0.5 * float(abs(steps).max()))
