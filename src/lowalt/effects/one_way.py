"""One array's complex factors over one path to every point: coefficient, array sum, 1/r and half the two-way phase."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT, Network, Station
from lowalt.echo.pointwise.reference_range import CELL, REST, TURN, reference
from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import Radar, radar
from lowalt.effects import near_field, response_loops
from lowalt.effects import response_tables as tables
from lowalt.effects.gain_times import ONE, Instant, Kept


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
    """One array over one path: factors (Q, N, L), excess range (N, L), its middle (N,) and reach to either side (m)."""

    factors: np.ndarray
    excess: np.ndarray
    middle: np.ndarray
    reach: float


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
        out, excess = np.empty((len(kappas), *count), np.complex128), np.empty(count)
        gains, shares = np.empty((0, 0, 0, 0), np.complex128), ONE
        if wavefront:
            centre = 0.5 * (kappas.min() + kappas.max())
            series = tables.series(
                np.pi * (kappas - centre) / spacing, spacing * tables.half_diagonal(shape), error / 40
            )
            array = near_field.Arrays(
                radio.station, axes, spacing, 0.5 * centre / spacing, radio.kappa, self.aims, shape, series,
                response_loops.waves(error / 40), 0.5 * float(kappas.max()) / spacing,
            )  # fmt: skip
            if kept is None:
                gains = np.empty((1, *out.shape), np.complex128)
                near_field.sums(self.places, array, error, gains[0])
            else:
                gains, shares = kept.sums(self.places, array, error, len(kappas), instant)
        fault = response_loops.one_way(
            np.ascontiguousarray(self.places.swapaxes(1, 2)), radio.station, axes, self.refs, self.origin,
            0.5 * radio.turns, spacing, self.aims, radio.kappa, kappas, squint, shape, self.coefficient, gains, shares,
            out, excess,
        )  # fmt: skip
        if fault:
            raise InputError(
                f"position of a point at symbol {(fault - 1) // count[1]} is that of station {self.name} (r = 0), "
                "expected r > 0"
            )
        low, high = excess.min(axis=1), excess.max(axis=1)
        return OneWay(out, excess, 0.5 * (low + high), float(0.5 * (high - low).max()))
