"""A target's frequency response under beams that may be turned during the look."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from lowalt.common.network import Station
from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import constants, radar
from lowalt.effects import lit_points, strongest_cell, waveform
from lowalt.effects.gain_times import Instant
from lowalt.effects.response import ImagePath, OneWayFactors
from lowalt.effects.view import View


def echo(
    view: View, paths: Sequence[ImagePath] = (), factor: np.ndarray | float = 1.0, direct: np.ndarray | None = None,
    **asked,
) -> np.ndarray:  # fmt: skip
    """Return the subcarriers (N, M) of the view's target; paths, factor and others as in `response`.

    direct: those of the direct path alone where they are known, which are not changed. Where beams are turned, the
    arrays' weights keep the phase of the arrays' middles.
    """
    rays = Steered(view, paths, **asked, lit=lit_points.lit(factor))
    return rays.echo(factor) if direct is None or not rays.steady else rays.echo_beside(direct, factor)


class SameSymbols(NamedTuple):
    """What instants of the same symbols share: the beams (`View.beam_rows`), and how much ranges differ (m)."""

    rows: list[tuple[int, np.ndarray, np.ndarray]]
    farther_m: float


class Steered:
    """The one-way factors of a view's target, beam by beam, from which echoes of any strengths follow."""

    def __init__(
        self, view: View, paths: Sequence[ImagePath] = (), *, squint: bool = False, wavefront: bool = False,
        error: float = 1e-14, kept: dict | None = None, like: "Steered | None" = None, span: SameSymbols | None = None,
        instant: Instant | None = None, lit: np.ndarray | None = None, once: bool = True,
    ):  # fmt: skip
        """Prepare the factors; kept, like, instant and once: as in `response.OneWayFactors`, for every beam.

        span: of the symbols, where the view is one of several instants in them; lit: the only points (N, W) of each
        symbol that have any strength (`lit_points.lit`), None for all.
        """
        self.view, self.lit = view, lit
        places = view.places
        if lit is not None:
            places, paths = lit_points.places_at(places, lit), [lit_points.path_at(path, lit) for path in paths]
        self.paths = paths
        """The paths to the points that have strength, except the direct one."""
        asked = {"squint": squint, "wavefront": wavefront, "error": error, "instant": instant, "once": once}
        asked["farther_m"] = 0.0 if span is None else span.farther_m
        given, self.steady = (view.network, view.station), not view.turning
        if self.steady:
            out, back = view.aims_m
            asked["like"] = None if like is None else like.beams[0][2]
            rays = OneWayFactors(*given, places, back, paths, sender_aim_m=out, kept=kept, **asked)
            self.beams = [(slice(None), 1.0, rays)]
            return
        self.beams = []
        for place, (number, aims, rows) in enumerate(view.beam_rows() if span is None else span.rows):
            some = [at_rows(path, rows) for path in paths]
            own = None if kept is None else kept.setdefault(number, {})
            asked["like"] = None if like is None else like.beams[place][2]
            rays = OneWayFactors(
                *given, places[rows], aims[1], some, sender_aim_m=aims[0], kept=own, **asked
            )  # fmt: skip
            self.beams.append((rows, _kept_phase(view, aims), rays))

    def echo(self, factor: np.ndarray | float = 1.0) -> np.ndarray:
        """Return the subcarriers (N, M) with `factor` on every point's amplitude as in `response`.

        Symbols in which the factor is zero for all points are zero.
        """
        return self.spectrum(self.moments(self.paired(factor)))

    def echo_beside(self, direct: np.ndarray, factor: np.ndarray | float = 1.0) -> np.ndarray:
        """Return what `echo` does, where the direct path's subcarriers (N, M) are known and beams are not turned."""
        rays = self.beams[0][2]
        rays.leave_out_direct()
        return rays.spectrum(self.moments(self.paired(factor))[0], direct.copy())

    def paired(self, factor: np.ndarray | float = 1.0) -> list[list[np.ndarray]]:
        """Return every beam's amplitudes (`response.OneWayFactors.paired`), with `factor` on every point's amplitude.

        They serve all instants of the same symbols.
        """
        roots = np.sqrt(self.view.cloud.rcs_m2)
        if self.lit is not None:
            roots, factor = roots[self.lit], lit_points.at_points(factor, self.lit)
        return [rays.paired(rows_of(roots, rows), rows_of(factor, rows)) for rows, _, rays in self.beams]

    def moments(self, paired: list[list[np.ndarray]]) -> list[list[np.ndarray]]:
        """Return the moments (`response.OneWayFactors.moments`) of every beam, with the amplitudes of `paired`."""
        return [rays.moments(mine) for (_, _, rays), mine in zip(self.beams, paired, strict=True)]

    def spectrum(self, moments: list[list[np.ndarray]]) -> np.ndarray:
        """Return the subcarriers (N, M) of every beam's moments, or of sums of such of instants alike."""
        if self.steady:
            return self.beams[0][2].spectrum(moments[0])
        result = np.empty((len(self.view.times_s), self.view.network.subcarriers), np.complex128)
        for (rows, phase, rays), mine in zip(self.beams, moments, strict=True):
            result[rows] = phase * rays.spectrum(mine)
        return result

    def tones(self, moments: list[list[np.ndarray]], data: np.ndarray) -> np.ndarray:
        """Return the tones (N, M) (`waveform.tones_of`) of symbols that carry data (N, M), of every beam's moments."""
        if self.steady:
            return self.beams[0][2].tones(moments[0], data)
        return waveform.tones_of(self.spectrum(moments), data)

    def searched(
        self, moments: list[list[np.ndarray]], signs: np.ndarray | None
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
        """Return `spectrum`, or with signs (2, N, M) its tones that carry them, and its strongest range cells.

        signs: int8, those of QPSK data (`waveform.sent_signs`). Values and numbers (N,) of cells are those of
        `strongest_cell.strongest`.
        """
        if self.steady and len(self.beams[0][2].pairs) == 1:
            return self.beams[0][2].searched(moments[0], signs)
        responses = self.spectrum(moments)
        value, cell = strongest_cell.strongest(responses)
        return responses if signs is None else waveform.tones_of(responses, waveform.of_signs(signs)), value, cell

    def largest(self, moments: list[list[np.ndarray]]) -> float:
        """Return a bound of the largest subcarrier that `spectrum` makes of these moments."""
        return max(rays.largest(mine) for (_, _, rays), mine in zip(self.beams, moments, strict=True))


def rows_of(values: np.ndarray | complex, rows: np.ndarray | slice) -> np.ndarray | complex:
    """The rows of a table (N, L) or (R, N, L), or the value that all rows share."""
    return values[..., rows, :] if np.ndim(values) > 1 and values.shape[-2] > 1 else values


def at_rows(path: ImagePath, rows: np.ndarray) -> ImagePath:
    """A path at some symbols alone."""
    sender = None if path.sender is None else at_rows(path.sender, rows)
    return ImagePath(path.places[rows], rows_of(path.coefficient, rows), path.station_m, sender)


def _kept_phase(view: View, aims_m: np.ndarray) -> complex:
    """Phase factor that cancels the phase change of both arrays' middles from the first beams to those at `aims_m`.

    aims_m: (2, 3) m, the sender's and the receiver's.
    """
    station, network = view.station, view.network
    if station.transmitter is None:
        exact, (across, up) = constants(radar(network, station).exact), _turned(view, station, view.aim_m, aims_m[1])
        return np.exp(2j * np.pi * (exact.phase_h[0] * across + exact.phase_v[0] * up))
    turns = 0.0
    ends = (station.transmitter, network.transmit), (station, network.receive)
    for (end, counts), first, later in zip(ends, view.aims_m, aims_m, strict=True):
        across, up = _turned(view, end, first, later)
        turns += 0.25 * radar(network, station).kappa * ((counts[0] - 1) * across + (counts[1] - 1) * up)
    return np.exp(2j * np.pi * turns)


def _turned(view: View, station: Station, first_m: np.ndarray, later_m: np.ndarray) -> tuple[float, float]:
    """Change of a beam's direction cosines along a station's axes."""
    radio = radar(view.network, station)
    (h0, v0), (h1, v1) = (
        aim_cosines(np.asarray(aim, np.float64), radio.station, radio.sine, radio.cosine) for aim in (first_m, later_m)
    )
    return h1 - h0, v1 - v0
