"""The points of a target that echo in a symbol at all: one-way factors are computed for them alone.

Surfaces hide half of a target's points or more. A symbol's points with any strength come first, and then as many
without as fill the table, so that all symbols have equally many.
"""

from typing import Protocol, runtime_checkable

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.effects.moment_loops import padded
from lowalt.effects.one_way import ImagePath
from lowalt.effects.view import View


@runtime_checkable
class SkipsDarkPoints(Protocol):
    """Channel: an effect on the points' amplitudes that does no work for points which another effect leaves dark."""

    def visible_of(self, settings: dict, view: View, dark: np.ndarray | None) -> np.ndarray:
        """Return the factor (N, L) of `visible`; any value of points that are `dark` (N, L), None for no such."""


MOST = 0.85
"""Largest share of points in any symbol at which gathering them saves time."""


@LEAN
def _sorted(strength, found, numbers):
    """Fill numbers (N, L) with points, those with any strength (R, N, L) first; return the most that a symbol has.

    found: (L,) int64, work space.
    """
    routes, symbols, count = strength.shape
    most = 0
    for n in range(symbols):
        first, last = 0, count
        for r in range(routes):
            own = strength[r, n]
            for i in range(np.uint64(count)):
                before = found[i] if r > 0 else 0
                found[i] = before | (1 if own[i] != 0.0 else 0)
        for l in range(count):  # noqa: E741
            lit = found[l]
            # Both ends of what is not yet filled take the number, and one of them stays: no branch, which is hard to
            # predict.
            numbers[n, first] = l
            numbers[n, last - 1] = l
            first += lit
            last -= 1 - lit
        most = max(most, first)
    return most


@LEAN
def _gathered(planes, numbers, out):
    """Fill out (N, K, W) with planes (N, K, L) at each symbol's points `numbers` (N, W)."""
    for n in range(len(out)):
        chosen = numbers[n]
        for k in range(out.shape[1]):
            plane, row = planes[n, k], out[n, k]
            for i in range(np.uint64(len(row))):
                # Without a sign, no number can count from the end.
                row[i] = plane[np.uint64(chosen[i])]


def lit(factor: np.ndarray | float) -> np.ndarray | None:
    """Return the numbers (N, W) int64 of the points of each symbol that echo, W <= L; None where nearly all do.

    factor: on the points' amplitudes, a number, (N or 1, L), or further axes for routes before these, as in
    `response.response`.
    """
    if np.ndim(factor) < 2 or factor.shape[-2] < 2:
        return None
    numbers = np.empty(factor.shape[-2:], np.int64)
    strength = np.ascontiguousarray(factor, np.float64).reshape(-1, *numbers.shape)
    most = _sorted(strength, np.empty(numbers.shape[1], np.int64), numbers)
    width = max(padded(most), padded(1))
    return np.ascontiguousarray(numbers[:, :width]) if width <= MOST * numbers.shape[1] else None


def at_points(values: np.ndarray | complex, numbers: np.ndarray) -> np.ndarray | complex:
    """Return values (..., N or 1, L) at each symbol's points `numbers` (N, W), (..., N, W).

    A value that all points share stays as it is.
    """
    if np.ndim(values) < 2 or values.shape[-1] == 1:
        return values
    values = np.broadcast_to(values, (*values.shape[:-2], len(numbers), values.shape[-1]))
    planes = np.ascontiguousarray(values).reshape(-1, len(numbers), 1, values.shape[-1])
    out = np.empty((len(planes), len(numbers), 1, numbers.shape[1]), planes.dtype)
    for one, own in zip(planes, out, strict=True):
        _gathered(one, numbers, own)
    return out.reshape(*values.shape[:-1], numbers.shape[1])


def places_at(places: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Return places (N, L, 3) m of each symbol's points `numbers` (N, W): (N, W, 3), ordered as in `carry`."""
    out = np.empty((len(numbers), 3, numbers.shape[1]))
    _gathered(np.ascontiguousarray(places.swapaxes(1, 2)), numbers, out)
    return out.swapaxes(1, 2)


def path_at(path: ImagePath, numbers: np.ndarray) -> ImagePath:
    """Return a path, and its sender's, to each symbol's points `numbers` (N, W) alone."""
    sender = None if path.sender is None else path_at(path.sender, numbers)
    places, coefficient = places_at(path.places, numbers), at_points(path.coefficient, numbers)
    return ImagePath(places, coefficient, path.station_m, sender)
