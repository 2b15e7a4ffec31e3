"""Guesses on a mesh that the file does not state: its unit, its axes, and what its connected components may be."""

from dataclasses import dataclass

import numpy as np

from lowalt.targets.mesh_files import UNITS_M

USUAL_M = {"UAV": (0.08, 8.0), "Bird": (0.08, 2.5), "Vehicle": (2.5, 13.0)}
"""Usual range (m) of the largest extent of a whole target, by category."""


ALIKE = 0.1
"""Pieces whose extents differ by at most this share are of one kind, such as the four propellers of a craft."""


FLAT = 0.35
"""Largest thickness of a propeller divided by its length."""


ROUND = 0.12
"""The two extents of a wheel across its axis differ by at most this share."""


@dataclass(frozen=True)
class Component:
    """A connected component: `low` and `high` (3,) m along the file's axes, its triangles, whether it is closed, the
    named piece it belongs to, and the kind of part that it may be (rotor, wheel, or an empty text)."""

    number: int
    low: np.ndarray
    high: np.ndarray
    triangles: int
    closed: bool
    piece: str
    guess: str = ""

    @property
    def extent(self) -> np.ndarray:
        """Size (3,) in m along the file's axes."""
        return self.high - self.low

    @property
    def centre(self) -> np.ndarray:
        """Middle (3,) in m of the extents."""
        return (self.low + self.high) / 2


def guessed_unit(size: float, category: str) -> str:
    """Return the unit of UNITS_M in which a largest extent of `size` (file units) is most usual for the category.

    This is the unit u with the least |log(size u / m)|, where m is the geometric mean of the category's USUAL_M.
    """
    usual = float(np.sqrt(np.prod(USUAL_M[category])))
    return min(UNITS_M, key=lambda name: abs(np.log(size * UNITS_M[name] / usual)))


def guessed_axes(extent: np.ndarray, category: str) -> tuple[str, str]:
    """Return the axes of the file that may point up and to the front. Only the extents (3,) are known, so no signs are.

    A car is longest to the front and lowest upwards; a craft is lowest upwards; a bird with spread wings is widest
    across.
    """
    order = np.argsort(extent, kind="stable")
    up = int(order[0])
    front = int(order[2] if category == "Vehicle" else order[1])
    if category == "UAV" and abs(extent[order[1]] / extent[order[2]] - 1) < ALIKE:
        front = next(axis for axis in range(3) if axis != up)
    return "xyz"[up], "xyz"[front]


def _alike(one: Component, other: Component) -> bool:
    """Return whether two components have the same three sizes in any order, to within ALIKE."""
    a, b = np.sort(one.extent), np.sort(other.extent)
    return bool((abs(a - b) <= ALIKE * max(a[2], b[2])).all())


def _may_be(component: Component, up: int, whole: np.ndarray, category: str) -> str:
    """Return the kind of part that one component may be, by its shape and size."""
    extent = component.extent
    if category == "UAV":
        across = np.delete(extent, up).max()
        if extent[up] < FLAT * across and 0.04 * whole.max() < across < 0.7 * whole.max():
            return "rotor"
    if category == "Vehicle":
        small, *large = np.sort(extent)
        if large[0] > (1 - ROUND) * large[1] and small < 0.8 * large[0] and 0.08 < large[1] / whole.max() < 0.3:
            return "wheel"
    return ""


def candidates(components: list[Component], up: int, whole: np.ndarray, category: str) -> dict[int, str]:
    """Return the kinds of parts that components may be, by number of the component.

    Only the largest set of at least two alike components at one height is taken to be moving parts.

    `up` the index of the axis that points up, `whole` (3,) the extents of the target in metres.
    """
    able = [(part, _may_be(part, up, whole, category)) for part in components]
    able = [(part, kind) for part, kind in able if kind]
    best: list[tuple[Component, str]] = []
    for part, kind in able:
        same = [
            (other, kind)
            for other, its in able
            if its == kind and _alike(part, other) and abs(other.centre[up] - part.centre[up]) < 0.1 * whole.max()
        ]
        larger = len(same) > len(best) or (len(same) == len(best) and part.extent.max() > best[0][0].extent.max())
        if len(same) >= 2 and larger:
            best = same
    return {part.number: kind for part, kind in best}
