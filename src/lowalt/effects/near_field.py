"""Array sums of spherical waves at many points, from sums at few nodes of the box of directions and ranges they fill.

A target fills a small box of direction cosines and inverse ranges while a few symbols last, and over it an array's sum
is a smooth function: a polynomial of a few dozen terms. Each element's path beyond that of the array's middle changes
by at most STRETCH times half the array's side per unit of direction cosine, and by at most DEPTH D^2 per unit of
inverse range, D being the array's diagonal. That holds for complex directions too, as long as cosines are below WIDEST
and D times the inverse range below NEAR: with a = -(x psi + y omega), b = x^2 + y^2 and u = 2 t a + t^2 b, a path is
(sqrt(1 + u) - 1) / t, and |u| < 0.104. These rates bound the sum on ellipses in the complex plane, and so the size of
its Chebyshev terms (Trefethen, Approximation Theory and Approximation Practice, 2013, theorems 8.1 and 8.2).
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lowalt.effects import interpolation, response_loops
from lowalt.effects.moment_loops import BLOCK
from lowalt.effects.near_field_loops import directions, evaluated

SYMBOLS = 100
"""Symbols that share a box."""
STRETCH, DEPTH, LOUDER = 1.23, 3.2, 1.06
WIDEST, NEAR = 1.2, 0.03
ELLIPSES = 1.0 + 2.0 ** np.arange(-3.0, 14.0)
"""Sums of the semi-axes of the ellipses on which sums are bounded."""
WIDER = 1.02
"""How much wider than needed a box is made that may serve again; a target moves by far less within an OFDM symbol."""
WORK = 2_000_000
"""Time of a box before any node or point is summed, in terms of one point."""
ELEMENT, ORDER = 14.0, 0.5
"""Time of an element and of an order of its series at one point, in terms of one point."""
LEBESGUE = 3.5
"""Bound of the norm of an interpolation from up to 50 Chebyshev points, 1 + (2 / pi) log(n + 1)."""
MOST = 50
DECAYS = np.log(ELLIPSES)[:, None] * np.arange(MOST)


GRID = 8
"""Steps of an octave to which a box's halves are rounded up, so that boxes share their numbers of nodes and terms."""


class Aperture(NamedTuple):
    """What bounds of an array's sums depend on; as in `Arrays`."""

    shape: tuple[int, int]
    spacing: float
    highest: float


class Arrays(NamedTuple):
    """One station's array as `response_loops.near_field` takes it, without places and results; and `highest`, turns a
    metre at the band's upper end."""

    station: np.ndarray
    axes: tuple[float, float]
    spacing: float
    wave: float
    beam: float
    aims: tuple[float, float]
    shape: tuple[int, int]
    series: np.ndarray
    rows: np.ndarray
    highest: float


class Box(NamedTuple):
    """A box of directions, middle and half (3,), with the polynomials of `evaluated` over it."""

    middle: np.ndarray
    half: np.ndarray
    terms: np.ndarray
    lengths: np.ndarray

    def holds(self, low: np.ndarray, high: np.ndarray) -> bool:
        """Return whether directions from low to high (3,) are in the box."""
        return bool((low >= self.middle - self.half).all() and (high <= self.middle + self.half).all())


def sums(
    places: np.ndarray, array: Arrays, error: float, out: np.ndarray, kept: dict[int, Box] | None = None
) -> None:  # fmt: skip
    """Fill out (Q, N, L) with the array's sums at places (N, L, 3) m, within `error` of the number of elements.

    kept: boxes of earlier calls with the same array and error, by their first symbol; they serve again while all
    directions stay inside, and new ones are made a little wider than needed and added.
    """
    at = np.empty((3, *places.shape[:2]))
    least, most = np.empty((2, 3, len(places)))
    directions(np.ascontiguousarray(places.swapaxes(1, 2)), array.station, array.axes, least, most, at)
    for first in range(0, len(places), SYMBOLS):
        rows = slice(first, first + SYMBOLS)
        points = places[rows].shape[0] * places.shape[1]
        low, high = least[:, rows].min(axis=1), most[:, rows].max(axis=1)
        box = None if kept is None else kept.get(first)
        if box is None or not box.holds(low, high):
            wider = WIDER if kept is not None else 1.0
            box = _box(low, high, wider, array, error, points, len(out))
        if box is None:
            _every_point(places[rows], array, out[:, rows])
            continue
        if kept is not None:
            kept[first] = box
        _, frequencies, *orders = box.terms.shape
        work = [np.empty((size, places.shape[1])) for size in (orders[2], orders[0], orders[1])]
        evaluated(
            np.ascontiguousarray(at[:, rows]), box.middle, box.half, box.terms, box.lengths, *work,
            np.empty(places.shape[1]), np.empty((frequencies, 2, places.shape[1])), out[:, rows],
        )  # fmt: skip


def _box(
    low: np.ndarray, high: np.ndarray, wider: float, array: Arrays, error: float, points: int, frequencies: int
) -> Box | None:  # fmt: skip
    """The polynomials over the directions from low to high (3,), None where summing every point costs less."""
    each = float(np.prod(array.shape)) * (ELEMENT + ORDER * array.series.shape[1])
    if points * each < WORK:
        return None
    middle = 0.5 * (low + high)
    half = wider * np.maximum(0.5 * (high - low), 1e-9 * np.array([1.0, 1.0, high[2]]))
    half = 2.0 ** (np.ceil(GRID * np.log2(half)) / GRID)
    found = _orders(*_rounded(middle, half), Aperture(array.shape, array.spacing, array.highest), error)
    nodes = None if found is None else _nodes(found[0], middle, half, array)
    if found is None or nodes is None:
        return None
    counts, lengths = found
    if WORK + points * frequencies * lengths.sum() + nodes.shape[1] * each > points * each:
        return None
    return Box(middle, half, _terms(nodes, counts, array, frequencies), lengths)


def _every_point(places: np.ndarray, array: Arrays, out: np.ndarray) -> None:
    """Fill out (Q, N, L) with the sums at places (N, L, 3) m, element by element."""
    response_loops.near_field(np.ascontiguousarray(places), *array[:-1], out)


def _rounded(middle: np.ndarray, half: np.ndarray) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """A box's middle with each number's size rounded up, which its bounds may do, and its half, as keys of a table."""
    cosines = np.ceil(64.0 * abs(middle[:2])) / 64.0
    return (*cosines.tolist(), float(2.0 ** (np.ceil(GRID * np.log2(middle[2])) / GRID))), tuple(half.tolist())


@lru_cache(maxsize=256)
def _orders(
    middle: tuple[float, ...], half: tuple[float, ...], array: Aperture, error: float
) -> tuple[tuple[int, int, int], np.ndarray] | None:  # fmt: skip
    """Nodes of each direction and terms (B, C) that keep a box's sums to an error, None where there are none."""
    sizes = term_bounds(np.array(middle), np.array(half), array)
    counts = None if sizes is None else node_counts(sizes, error / 4)
    return None if sizes is None or counts is None else (counts, _lengths(sizes, counts, error / 4))


def term_bounds(middle: np.ndarray, half: np.ndarray, array: Arrays | Aperture) -> np.ndarray | None:
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


def _nodes(counts: tuple[int, int, int], middle: np.ndarray, half: np.ndarray, array: Arrays) -> np.ndarray | None:
    """The places (1, K, 3) m of all nodes, None where a node is no direction."""
    grid = (m + h * interpolation.points(count) for count, m, h in zip(counts, middle, half, strict=True))
    across, up, inverse = grid
    across, up = across[:, None, None], up[:, None]
    ahead = 1.0 - across**2 - up**2
    if not (ahead > 0).all() or inverse.min() <= 0.0:
        return None
    (sine, cosine), front, places = array.axes, np.sqrt(ahead), np.empty((*counts, 3))
    # The sums depend on the direction along the array alone, so its front stands for its back.
    for axis, way in enumerate((front * cosine - across * sine, front * sine + across * cosine, up)):
        np.divide(way, inverse, out=places[..., axis])
    places += array.station
    return places.reshape(1, -1, 3)


def _terms(nodes: np.ndarray, counts: tuple[int, int, int], array: Arrays, frequencies: int) -> np.ndarray:
    """Chebyshev coefficients (2, Q, B, C, A) of the sums, real and imaginary, A rounded up to a multiple of BLOCK."""
    values = np.empty((frequencies, 1, nodes.shape[1]), np.complex128)
    _every_point(nodes, array, values)
    across, up, near = (interpolation.coefficients(count) for count in counts)
    found = values.reshape(frequencies, *counts) @ near.T
    found = np.tensordot(up @ found, across, ([1], [1]))
    padded = np.zeros((2, *found.shape[:3], -(-counts[0] // BLOCK) * BLOCK))
    padded[0, ..., : counts[0]], padded[1, ..., : counts[0]] = found.real, found.imag
    return padded


def _lengths(sizes: np.ndarray, counts: tuple[int, int, int], error: float) -> np.ndarray:
    """How many terms of each row (B, C) matter: those left out sum to at most `error`. Multiples of BLOCK."""
    across, up, near = (sizes[axis, :count] for axis, count in enumerate(counts))
    bound = up[:, None, None] * near[:, None] * across
    ordered = np.sort(bound, axis=None)
    dropped = int(np.searchsorted(np.cumsum(ordered), error))
    matters = bound >= ordered[dropped] if dropped < ordered.size else np.zeros(bound.shape, np.bool_)
    lengths = np.where(matters.any(axis=2), counts[0] - matters[:, :, ::-1].argmax(axis=2), 0)
    return -(-lengths // BLOCK) * BLOCK
