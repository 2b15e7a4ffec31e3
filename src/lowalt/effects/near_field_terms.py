"""Which Chebyshev terms an array's sums of spherical waves need over a box of directions and ranges.

Each element's path beyond that of the array's middle changes by at most STRETCH times half the array's side per unit of
direction cosine, and by at most DEPTH D^2 per unit of inverse range, D being the array's diagonal. That holds for
complex directions too, as long as cosines are below WIDEST and D times the inverse range below NEAR: with
a = -(x psi + y omega), b = x^2 + y^2 and u = 2 t a + t^2 b, a path is (sqrt(1 + u) - 1) / t, and |u| < 0.104. These
rates bound the sum on ellipses in the complex plane, and so the size of its Chebyshev terms (Trefethen, Approximation
Theory and Approximation Practice, 2013, theorems 8.1 and 8.2). Error budget of a box: 1/4 for its nodes, 1/4 for terms
that are small by these bounds, 1/4 for those that are found small.
"""

from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from lowalt.effects.near_field_loops import TOGETHER, listed

if TYPE_CHECKING:
    from lowalt.effects.near_field import Arrays

STRETCH, DEPTH, LOUDER = 1.23, 3.2, 1.06
WIDEST, NEAR = 1.2, 0.03
ELLIPSES = 1.0 + 2.0 ** np.arange(-3.0, 14.0)
"""Sums of the semi-axes of the ellipses on which sums are bounded."""
LEBESGUE = 3.5
"""Bound of the norm of an interpolation from up to 50 Chebyshev points, 1 + (2 / pi) log(n + 1)."""
MOST = 50
DECAYS = np.log(ELLIPSES)[:, None] * np.arange(MOST)


class Aperture(NamedTuple):
    """What bounds of an array's sums depend on; as in `Arrays`."""

    shape: tuple[int, int]
    spacing: float
    highest: float


@lru_cache(maxsize=256)
def orders(
    middle: tuple[float, ...], half: tuple[float, ...], array: Aperture, error: float
) -> tuple[tuple[int, int, int], np.ndarray, int] | None:  # fmt: skip
    """Return nodes of each direction, which terms (A, B, C) may matter for an error, and how many; or None."""
    sizes = term_bounds(np.array(middle), np.array(half), array)
    counts = None if sizes is None else node_counts(sizes, error / 4)
    if sizes is None or counts is None:
        return None
    matters = _matter(sizes, counts, error / 4)
    return counts, matters, int(matters.sum())


def term_bounds(middle: np.ndarray, half: np.ndarray, array: "Arrays | Aperture") -> np.ndarray | None:
    """Return bounds (3, MOST) whose products bound the Chebyshev terms of the sums over the number of elements.

    None where the rates of change do not hold. A function below M on an ellipse has terms below 2 M rho^-k.
    """
    wide, high = (array.spacing * (count - 1) for count in array.shape)
    diagonal = float(np.hypot(wide, high))
    rates = (
        2 * np.pi * array.highest * np.array([0.5 * STRETCH * wide, 0.5 * STRETCH * high, DEPTH * diagonal**2]) * half
    )
    swollen = 0.5 * (ELLIPSES + 1.0 / ELLIPSES)
    result = np.empty((3, MOST))
    for axis, rate in enumerate(rates):
        if axis < 2:
            holds = abs(middle[axis]) + half[axis] * swollen <= WIDEST
        else:
            holds = diagonal * (middle[2] + half[2] * swollen) <= NEAR
        if not holds.any():
            return None
        # The amplitude of an element is at most LOUDER times the corner's.
        growth = 0.5 * rate * (ELLIPSES - 1.0 / ELLIPSES)[holds, None]
        result[axis] = 2.0 * LOUDER ** (axis == 0) * np.exp((growth - DECAYS[holds]).min(axis=0))
    return result


def node_counts(sizes: np.ndarray, error: float) -> tuple[int, int, int] | None:
    """Return how many Chebyshev points each direction needs for this error together; None where that is too many."""
    # Interpolation folds each term left out onto another one, so it errs twice by them; the axes follow each other.
    left = 2.0 * LEBESGUE**2 * np.cumsum(sizes[:, ::-1], axis=1)[:, ::-1]
    enough = left <= error / 3.0
    if not enough.any(axis=1).all():
        return None
    return tuple(np.maximum(enough.argmax(axis=1), 1).tolist())


def _matter(sizes: np.ndarray, counts: tuple[int, int, int], error: float) -> np.ndarray:
    """Which terms (A, B, C) may matter by their bounds: those left out sum to at most `error`."""
    across, up, near = (sizes[axis, :count] for axis, count in enumerate(counts))
    bound = across[:, None, None] * up[:, None] * near
    ordered = np.sort(bound, axis=None)
    dropped = int(np.searchsorted(np.cumsum(ordered), error))
    return bound >= ordered[dropped] if dropped < ordered.size else np.zeros(bound.shape, np.bool_)


def chosen(
    found: np.ndarray, matters: np.ndarray, allowed: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return pairs, terms, names and ends of `evaluated` for the terms found (Q, A, B, C), fewer than may matter.

    No Chebyshev polynomial exceeds 1, so terms that sum to at most `allowed` are left out.
    """
    orders, *_, high, deep = found.shape
    pairs, ends = np.empty((high * deep, 2), np.int64), np.empty(orders + 1, np.int64)
    most = orders * (matters.size + TOGETHER)
    terms, names, place = np.empty((most, 2)), np.empty((most, 2), np.int64), np.empty((high, deep), np.int64)
    used, last = listed(found, matters, allowed, np.empty(found.shape), place, pairs, terms, names, ends)
    return pairs[:used], terms, names, ends[: last + 1]
