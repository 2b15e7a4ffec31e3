"""Array sums of spherical waves at some instants of a symbol, which give those at all its other instants.

A response's phase turns with every path, so a symbol needs several instants. An array sum follows the direction to a
point and its range, which hardly change in a symbol: a polynomial in time through two or three instants gives the rest.
"""

from typing import NamedTuple

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.effects import interpolation, near_field
from lowalt.effects.elements import farthest_m
from lowalt.effects.view import View

ONE = np.ones(1)
"""The weights of sums that are their own."""


class Instant(NamedTuple):
    """How an instant of a symbol gets its array sums: slot: its place among the kept ones, None where it has none.

    weights: (K,) those of the kept sums, of which there are K.
    """

    slot: int | None
    weights: np.ndarray


class Kept:
    """What the instants of the same symbols share of one array over one path: polynomials and sums, as they come."""

    def __init__(self):
        self.boxes: dict[int, near_field.Box] = {}
        self.gains: np.ndarray | None = None

    def sums(
        self, places: np.ndarray, array: near_field.Arrays, error: float, count: int, instant: Instant | None
    ) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
        """Return array sums (K, Q, N, L) and weights (K,) that add up to those at places (N, L, 3) m, count = Q."""
        if instant is None:
            gains = np.empty((1, count, *places.shape[:2]), np.complex128)
            near_field.sums(places, array, error, gains[0], self.boxes)
            return gains, ONE
        if self.gains is None:
            self.gains = np.empty((len(instant.weights), count, *places.shape[:2]), np.complex128)
        if instant.slot is None:
            return self.gains, instant.weights
        near_field.sums(places, array, error, self.gains[instant.slot], self.boxes)
        return self.gains[instant.slot : instant.slot + 1], ONE


def order(view: View, motion: tuple | None, count: int, error: float) -> list[tuple[int, Instant | None]]:
    """Return the numbers of a symbol's `count` Chebyshev points, those whose array sums are kept first.

    motion: as `symbol_motion.complex_motion` bounds it; error: of the sums that follow from them, relative to the
    number of elements.
    """
    at = interpolation.points(count)
    for points in range(2, count):
        slots = np.rint(np.linspace(0, count - 1, points)).astype(int)
        weights = _lagrange(at[slots], at)
        if (1.0 + abs(weights).sum(axis=1).max()) * best(view, motion, points) <= error:
            others = np.setdiff1d(np.arange(count), slots)
            kept = [(int(one), Instant(slot, weights[one])) for slot, one in enumerate(slots)]
            return kept + [(int(one), Instant(None, weights[one])) for one in others]
    return [(number, None) for number in range(count)]


def best(view: View, motion: tuple | None, points: int) -> float:
    """Return a bound of how far array sums are from a polynomial of degree points - 1 in time, over the elements.

    A sum that differs by up to B from its value at the middle on an ellipse of semi-axes' sum rho has coefficients of
    at most 2 B rho^-k beyond the first. Its phases are those of paths beyond the path of the array's middle. A path's
    gradient is a direction, and the directions to an element and to the middle differ by at most 2.5 times their
    distance over the range, for complex times too as long as positions move as little as in `symbol_motion.count`.
    """
    if motion is None or points < 2:
        return np.inf
    rho, near, moved, _ = motion
    radio, farthest = radar(view.network, view.station), farthest_m(view.network)
    wave = 2 * np.pi * (radio.centre_hz + radio.bandwidth_hz) / SPEED_OF_LIGHT
    differ, way = 2.5 * 0.5 * farthest / (near - moved), moved - farthest
    # The amplitude is the corner's range over the element's; its logarithm's gradient is below 3.5 `differ` / range.
    change = np.expm1(np.minimum((wave + 3.5 / (near - moved)) * differ * way, 700.0)).max(axis=1)
    return float((2.0 * 1.5 * change * rho ** (1.0 - points) / (rho - 1.0)).min())


def _lagrange(nodes: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The weights (T, K) that turn values at `nodes` (K,) into those at `at` (T,) of the polynomial through them."""
    away, apart = at[:, None] - nodes, nodes[:, None] - nodes
    return np.stack(
        [
            np.prod(np.delete(away, k, 1), axis=1) / np.prod(np.delete(apart[k], k))
            for k in range(len(nodes))
        ],
        axis=1,
    )  # fmt: skip
