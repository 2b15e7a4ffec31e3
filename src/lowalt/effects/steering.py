"""A target's frequency response under beams that may be turned during the look."""

from collections.abc import Sequence

import numpy as np

from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import constants, radar
from lowalt.effects.response import ImagePath, OneWayFactors
from lowalt.effects.view import View


def echo(view: View, paths: Sequence[ImagePath] = (), factor: np.ndarray | float = 1.0, **asked) -> np.ndarray:
    """Return the subcarriers (N, M) of the view's target; paths, factor and others as in `response`.

    Where beams are turned, the arrays' weights keep the phase of the arrays' middles.
    """
    return Steered(view, paths, **asked).echo(factor)


class Steered:
    """The one-way factors of a view's target, beam by beam, from which echoes of any strengths follow."""

    def __init__(
        self, view: View, paths: Sequence[ImagePath] = (), *, squint: bool = False, wavefront: bool = False,
        error: float = 1e-14, kept: dict | None = None,
    ):  # fmt: skip
        """Prepare the factors; kept: as in `response.OneWayFactors`, for every beam."""
        self.view, asked = view, {"squint": squint, "wavefront": wavefront, "error": error}
        given = view.network, view.station
        if view.beams is None or len(view.beams.starts_s) == 1:
            self.beams = [(slice(None), 1.0, OneWayFactors(*given, view.places, view.aim_m, paths, kept=kept, **asked))]
            return
        self.beams = []
        for number, rows in view.beam_rows():
            some = [ImagePath(path.places[rows], _rows_of(path.coefficient, rows)) for path in paths]
            aim = view.beams.aims_m[number]
            own = None if kept is None else kept.setdefault(number, {})
            rays = OneWayFactors(*given, view.places[rows], aim, some, kept=own, **asked)
            self.beams.append((rows, _kept_phase(view, aim), rays))

    def echo(self, factor: np.ndarray | float = 1.0) -> np.ndarray:
        """Return the subcarriers (N, M) with `factor` on every point's amplitude as in `response`.

        Symbols in which the factor is zero for all points are zero.
        """
        view, roots = self.view, np.sqrt(self.view.cloud.rcs_m2)
        if view.beams is None or len(view.beams.starts_s) == 1:
            return self.beams[0][2].summed(roots * factor)
        result = np.empty((len(view.times_s), view.network.subcarriers), np.complex128)
        for rows, phase, rays in self.beams:
            result[rows] = phase * rays.summed(roots * _rows_of(factor, rows))
        return result


def _rows_of(values: np.ndarray | complex, rows: np.ndarray) -> np.ndarray | complex:
    """The rows of a table (N, L) or (R, N, L), or the value that all rows share."""
    return values[..., rows, :] if np.ndim(values) > 1 and values.shape[-2] > 1 else values


def _kept_phase(view: View, aim_m: np.ndarray) -> complex:
    """Phase factor that cancels the phase change of both arrays' middles from the first beam to the beam at `aim_m`."""
    radio = radar(view.network, view.station)
    (h0, v0), (h1, v1) = (
        aim_cosines(np.asarray(aim, np.float64), radio.station, radio.sine, radio.cosine) for aim in (view.aim_m, aim_m)
    )
    exact = constants(radio.exact)
    turns = exact.phase_h[0] * (h1 - h0) + exact.phase_v[0] * (v1 - v0)
    return np.exp(2j * np.pi * turns)
