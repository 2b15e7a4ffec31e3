"""Array sums of spherical waves at many points, from sums at few nodes of the box of directions and ranges they fill.

A target fills a small box of direction cosines and inverse ranges while a few symbols last, and over it an array's sum
is a smooth function: a polynomial of a few dozen terms (`near_field_terms`).
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from lowalt.common.memory import aligned
from lowalt.effects import interpolation, near_field_loops, response_loops
from lowalt.effects.near_field_loops import directions, evaluated, held
from lowalt.effects.near_field_terms import MOST, Aperture, chosen, orders

SYMBOLS = 200
"""Symbols that share a box."""
POINTS = 192
"""Points whose polynomials are evaluated together, so that these stay in the nearest cache; whole vectors."""
WIDER = 1.02
"""How much wider than needed a box is made that may serve again; a target moves by far less within an OFDM symbol."""
WORK = 2_000_000
"""Time of a box before any node or point is summed, in terms of one point."""
ELEMENT, ORDER = 14.0, 0.5
"""Time of an element and of an order of its series at one point, in terms of one point."""
NOWHERE = np.full(3, np.nan), np.zeros(3)
"""Middle and half of a box that holds no direction."""
GRID = 8
"""Steps of an octave to which a box's halves are rounded up, so that boxes share their numbers of nodes and terms."""


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
    """A box of directions, middle and half (3,), with its polynomials as `evaluated` takes them.

    counts: of the polynomials of each direction.
    """

    middle: np.ndarray
    half: np.ndarray
    counts: tuple[int, int, int]
    pairs: np.ndarray
    terms: np.ndarray
    names: np.ndarray
    ends: np.ndarray
    mix: np.ndarray


def sums(
    places: np.ndarray, array: Arrays, error: float, out: np.ndarray, kept: dict[int, Box] | None = None
) -> None:  # fmt: skip
    """Fill out (Q, N, L) with the array's sums at places (N, L, 3) m, within `error` of the number of elements.

    kept: boxes of earlier calls with the same array and error, by their first symbol; they serve again while all
    directions stay inside, and new ones are made a little wider than needed and added.
    """
    at, (symbols, count) = np.empty((3, *places.shape[:2])), places.shape[:2]
    least, most = np.empty((2, 3, symbols))
    directions(np.ascontiguousarray(places.swapaxes(1, 2)), array.station, array.axes, least, most, at)
    for first in range(0, symbols, SYMBOLS):
        rows = slice(first, min(first + SYMBOLS, symbols))
        points = (rows.stop - first) * count
        box = None if kept is None else kept.get(first)
        low, high = np.empty((2, 3))
        inside = held(least, most, rows.start, rows.stop, *(NOWHERE if box is None else box[:2]), low, high)
        if not inside:
            wider = WIDER if kept is not None else 1.0
            box = _box(low, high, wider, array, error, points, len(out))
        if box is None:
            _every_point(places[rows], array, out[:, rows])
            continue
        if kept is not None:
            kept[first] = box
        work = [aligned(height, POINTS) for height in (2, sum(box.counts) + len(box.pairs), 2 * box.mix.shape[1])]
        evaluated(
            at.reshape(3, -1), first * count, rows.stop * count, *box, *work[:2], work[2].reshape(-1, 2, POINTS),
            out.reshape(len(out), -1),
        )  # fmt: skip


def _box(
    low: np.ndarray, high: np.ndarray, wider: float, array: Arrays, error: float, points: int, frequencies: int
) -> Box | None:  # fmt: skip
    """The polynomials over the directions from low to high (3,), None where summing every point costs less."""
    each = math.prod(array.shape) * (ELEMENT + ORDER * array.series.shape[1])
    if points * each < WORK:
        return None
    middle = 0.5 * (low + high)
    half = wider * np.maximum(0.5 * (high - low), 1e-9 * np.array([1.0, 1.0, high[2]]))
    half = 2.0 ** (np.ceil(GRID * np.log2(half)) / GRID)
    found = orders(*_rounded(middle, half), Aperture(array.shape, array.spacing, array.highest), error)
    if found is None:
        return None
    counts, matters, most = found
    if WORK + points * frequencies * most + math.prod(counts) * each > points * each:
        return None
    nodes = _nodes(counts, middle, half, array)
    if nodes is None:
        return None
    found = _terms(nodes, counts, array, frequencies)
    terms = chosen(found, matters, error / 4 * math.prod(array.shape))
    return Box(middle, half, counts, *terms, _mix(frequencies)[:, : len(terms[-1]) - 1])


def _every_point(places: np.ndarray, array: Arrays, out: np.ndarray) -> None:
    """Fill out (Q, N, L) with the sums at places (N, L, 3) m, element by element."""
    response_loops.near_field(np.ascontiguousarray(places), *array[:-1], out)


def _rounded(middle: np.ndarray, half: np.ndarray) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """A box's middle with each number's size rounded up, which its bounds may do, and its half, as keys of a table."""
    cosines = np.ceil(64.0 * abs(middle[:2])) / 64.0
    return (*cosines.tolist(), float(2.0 ** (np.ceil(GRID * np.log2(middle[2])) / GRID))), tuple(half.tolist())


def _nodes(counts: tuple[int, int, int], middle: np.ndarray, half: np.ndarray, array: Arrays) -> np.ndarray | None:
    """The places (1, K, 3) m of all nodes, None where a node is no direction."""
    grid = [m + h * _points(count) for count, m, h in zip(counts, middle, half, strict=True)]
    places = np.empty((*counts, 3))
    return places.reshape(1, -1, 3) if near_field_loops.nodes(*grid, array.station, array.axes, places) else None


@lru_cache(maxsize=MOST)
def _points(count: int) -> np.ndarray:
    """Kept `interpolation.points`, which must not be changed."""
    return interpolation.points(count)


@lru_cache(maxsize=MOST)
def _mix(frequencies: int) -> np.ndarray:
    """The values (Q, Q) at the frequencies of the orders that `_terms` has of them."""
    return np.ascontiguousarray(interpolation.polynomials(frequencies, interpolation.points(frequencies)).T)


def _terms(nodes: np.ndarray, counts: tuple[int, int, int], array: Arrays, frequencies: int) -> np.ndarray:
    """Chebyshev coefficients (Q, A, B, C) complex of the sums: Q orders over the frequencies, A across, B up, C near.

    The frequencies are taken for Chebyshev points, as they are; their orders have the same values there in any case.
    """
    values = np.empty((frequencies, 1, nodes.shape[1]), np.complex128)
    _every_point(nodes, array, values)
    across, up, near = (interpolation.coefficients(count) for count in counts)
    found = values.reshape(-1, counts[2]) @ near.T
    found = up @ found.reshape(-1, *counts[1:])
    found = across @ found.reshape(frequencies, counts[0], -1)
    if frequencies > 1:
        found = interpolation.coefficients(frequencies) @ found.reshape(frequencies, -1)
    return found.reshape(frequencies, *counts)
