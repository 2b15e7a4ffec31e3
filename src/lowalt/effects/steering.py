"""A target's frequency response under beams that may be turned during the look."""

from collections.abc import Sequence

import numpy as np

from lowalt.echo.pointwise.terms import aim_cosines
from lowalt.echo.radar import radar
from lowalt.effects.response import ImagePath, response
from lowalt.effects.view import View


def echo(view: View, paths: Sequence[ImagePath] = (), factor: np.ndarray | float = 1.0, **asked) -> np.ndarray:
    """Return the subcarriers (N, M) of the view's target; paths, factor and others as in `response`.

    Where beams are turned, the arrays' weights keep the phase of the arrays' middles.
    """
    given = view.network, view.station
    if view.beams is None or len(view.beams.starts_s) == 1:
        return response(*given, view.places, view.cloud.rcs_m2, view.aim_m, paths=paths, factor=factor, **asked)
    result = np.empty((len(view.times_s), view.network.subcarriers), np.complex128)
    for number, rows in view.beam_rows():
        some = [ImagePath(path.places[rows], _rows_of(path.coefficient, rows)) for path in paths]
        aim = view.beams.aims_m[number]
        result[rows] = _kept_phase(view, aim) * response(
            *given, view.places[rows], view.cloud.rcs_m2, aim, paths=some, factor=_rows_of(factor, rows), **asked
        )  # fmt: skip
    return result


def _rows_of(values: np.ndarray | complex, rows: np.ndarray) -> np.ndarray | complex:
    """The rows of a table (N, ...), or the value that all rows share."""
    return values[rows] if np.ndim(values) and len(values) > 1 else values


def _kept_phase(view: View, aim_m: np.ndarray) -> complex:
    """Phase that undoes the turn of both arrays' middles from the first beam to one at `aim_m`."""
    radio = radar(view.network, view.station)
    (h0, v0), (h1, v1) = (
        aim_cosines(np.asarray(aim, np.float64), radio.station, radio.sine, radio.cosine) for aim in (view.aim_m, aim_m)
    )
    turns = radio.exact.phase_h[0] * (h1 - h0) + radio.exact.phase_v[0] * (v1 - v0)
    return np.exp(2j * np.pi * turns)
