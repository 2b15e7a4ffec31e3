"""Guesses on a mesh that the file does not state: its unit, its axes, and what its connected components may be."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial import cKDTree

from lowalt.targets.mesh_files import UNITS_M, Mesh, edges_of

USUAL_M = {"UAV": (0.08, 8.0), "Bird": (0.08, 2.5), "Vehicle": (2.5, 13.0)}
"""Usual range (m) of the largest extent of a whole target, by category."""

UNUSUAL = 20
"""A target of a row of its own is at most so many times smaller or larger than that."""


ALIKE = 0.1
"""Pieces whose extents differ by at most this share are of one kind, such as the four propellers of a craft."""


FLAT = 0.35
"""Largest thickness of a propeller divided by its length."""

SMALLEST_ROTOR = 0.15
"""A rotor is at least so wide across, in parts of the craft's largest extent: screws and motor caps are not."""

OFF_CENTRE = 0.3
"""A rotor's surface lies about its hub: its middle is at most this share of its radius from that of its box; three
blades have a quarter."""

SYMMETRIC = 0.02
"""Mean distance of a mirrored body from itself, in parts of its size, up to which it is symmetric."""

IN_PLANE, AT_ZERO, CUT, OPEN_CUT = 1e-3, 0.01, 0.05, 0.15
"""A half ends in a plane: distances from it and from the file's zero in parts of the size (at most), and the rectangle
that its edges there span in parts of that of the extents (at least), in the file's zero and where all are open."""

SLENDER, RADIAL, INWARD = 0.35, 0.95, 0.4
"""An arm's spread across by that along (at most), the cosine of its angle to the line from the craft's middle (at
least), and where its inner end lies on that line, by where its own middle lies (at most)."""

LONG = 0.75
"""Width of a blade by its length, as its box has them; a blade at 30 degrees to the axes has 0.6, a disc 1."""

TOUCH = 0.1
"""Boxes nearer than twice this share of the larger one's length belong together: the hub lies between two blades."""


ROUND = 0.12
"""The two extents of a wheel across its axis differ by at most this share."""


_ROTOR = r"(?:(?<![a-z])|main|tail)(?:rotor(?!craft)|prop(?!ul|ert)|blade|fan(?![a-z])|puller|pusher)"
TURNING = {
    "rotor": re.compile(_ROTOR + r"(?!.*(?:guard|duct|mount|shroud))", re.I),
    "wheel": re.compile(r"wheel|tyre|tire(?!d)", re.I),
    "wing": re.compile(r"wing", re.I),
}
"""Words in the names of joints and links, and of pieces of meshes, that say what a part is."""

FIXED = re.compile(r"(?<![a-z])(motor|mount|arm(?![a-z])|leg|skid|land|frame|guard|duct)", re.I)
"""Words in the names of pieces that do not turn."""


@dataclass(frozen=True)
class Component:
    """A connected component: `low` and `high` (3,) m along the file's axes, its triangles, whether it is closed, the
    names of the piece it belongs to, the kind of part that it may be (rotor, wheel, or an empty text), the `middle`
    (3,) of its surface and its `area` (m2); `along` (3,) the direction in which it is longest, `slender` its spread
    across by that along."""

    number: int
    low: np.ndarray
    high: np.ndarray
    triangles: int
    closed: bool
    piece: str
    guess: str = ""
    middle: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    area: float = 1.0
    along: np.ndarray = field(default_factory=lambda: np.full(3, np.nan))
    slender: float = 1.0

    @property
    def extent(self) -> np.ndarray:
        """Size (3,) in m along the file's axes."""
        return self.high - self.low

    @property
    def centre(self) -> np.ndarray:
        """Middle (3,) in m of the extents."""
        return (self.low + self.high) / 2


def guessed_unit(size: float, category: str, wanted_m: float | None = None) -> str:
    """Return the unit of UNITS_M in which a largest extent of `size` (file units) is nearest to the target's.

    wanted_m: the target's largest extent where it is known; by default the geometric mean of the category's USUAL_M.
    The nearest unit u has the least |log(size u / m)|.
    """
    usual = wanted_m or float(np.sqrt(np.prod(USUAL_M[category])))
    return min(UNITS_M, key=lambda name: abs(np.log(size * UNITS_M[name] / usual)))


def _off_mirror(points: np.ndarray) -> np.ndarray:
    """Mean distance (3,) of a body of points (N, 3) from its mirror image along each axis, in parts of its size."""
    tree, off = cKDTree(points), []
    for axis in range(3):
        mirrored = points.copy()
        mirrored[:, axis] = points[:, axis].min() + points[:, axis].max() - points[:, axis]
        off.append(float(np.mean(tree.query(mirrored)[0])))
    return np.array(off) / max(float(np.ptp(points, axis=0).max()), 1e-300)


def mirror_axis(points: np.ndarray) -> int | None:
    """Return the axis along which a body of points (N, 3) is its own mirror image and along no other, None where that
    cannot be seen: left and right of a bird."""
    off = _off_mirror(points)
    best, second = np.sort(off)[:2]
    return int(np.argmin(off)) if best < SYMMETRIC and best < second / 2 else None


def cut_axis(mesh: Mesh, points: np.ndarray, axes: Sequence[int]) -> int | None:
    """Return which of the axes a half of a target is cut along, None where it seems whole.

    points: (N, 3) m on its surface. A half ends flat in one plane, open or in the file's zero, and is not its own
    mirror image along that axis.
    """
    edges, _, uses = edges_of(mesh.faces)
    ends, extent = mesh.vertices[edges], np.ptp(mesh.vertices, axis=0)
    off, size = _off_mirror(points), extent.max()
    for axis in axes:
        for limit in (mesh.vertices[:, axis].min(), mesh.vertices[:, axis].max()):
            there = (np.abs(ends[:, :, axis] - limit) < IN_PLANE * size).all(axis=1)
            if off[axis] < SYMMETRIC or not there.any():
                continue
            span = np.prod(np.delete(np.ptp(ends[there].reshape(-1, 3), axis=0) / extent, axis))
            if (span > CUT and abs(limit) < AT_ZERO * size) or (span > OPEN_CUT and (uses[there] == 1).all()):
                return axis
    return None


def guessed_axes(extent: np.ndarray, category: str, up: int | None = None, right: int | None = None) -> tuple[str, str]:
    """Return the axes of the file that may point up and to the front. Only the extents (3,) are known, so no signs are.

    A car is longest to the front and lowest upwards; a craft is lowest upwards; a bird with spread wings is widest
    across. `up` and `right` are the numbers of axes that something else tells.
    """
    order = [axis for axis in np.argsort(extent, kind="stable") if axis not in (up, right)]
    order = order if up is None else [up, *order]
    if right is not None:
        order = [*order, right]
        return "xyz"[order[0]], "xyz"[order[1]]
    front = int(order[2] if category == "Vehicle" else order[1])
    if category == "UAV" and abs(extent[order[1]] / extent[order[2]] - 1) < ALIKE:
        front = next(axis for axis in range(3) if axis != order[0])
    return "xyz"[order[0]], "xyz"[front]


def box_of(group: Sequence[Component]) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest corners (3,) of a group of components."""
    return np.min([part.low for part in group], axis=0), np.max([part.high for part in group], axis=0)


def _size(group: Sequence[Component]) -> np.ndarray:
    """Extents (3,) of a group."""
    return np.subtract(*box_of(group)[::-1])


def _alike(one: Sequence[Component], other: Sequence[Component]) -> bool:
    """Return whether two groups have the same three sizes in any order, to within ALIKE, or as many triangles and as
    large a surface: propellers at other angles have other boxes."""
    a, b = np.sort(_size(one)), np.sort(_size(other))
    counts, areas = ([sum(getattr(part, name) for part in group) for group in (one, other)]
                     for name in ("triangles", "area"))  # fmt: skip
    copies = counts[0] == counts[1] and abs(areas[0] - areas[1]) <= ALIKE * max(areas)
    return copies or bool((abs(a - b) <= ALIKE * max(a[2], b[2])).all())


def _one_hub(one: Component, other: Component, up: int, touching: bool) -> bool:
    """Return whether two components turn about one hub: one lies about the middle of the other, as a spinner does, and
    they are no pair of coaxial rotors. `touching`: whether long blades that touch, not discs, are of one rotor too."""
    away, radius = np.abs(one.centre - other.centre), max(one.extent.max(), other.extent.max()) / 2
    same = _alike([one], [other])
    if same and away[up] > 2 * max(one.extent[up], other.extent[up]):
        return False
    slack = TOUCH * 2 * radius
    near = bool((one.low - slack <= other.high + slack).all() and (other.low - slack <= one.high + slack).all())
    long = all(np.sort(part.extent)[1] < LONG * part.extent.max() for part in (one, other))
    away[up] = 0
    return near and (float(np.linalg.norm(away)) <= radius / 2 or (touching and same and long))


def clusters(parts: Sequence[Component], up: int, touching: bool = True) -> list[list[Component]]:
    """Return components about one hub as one group each, such as the two blades of a propeller (`_one_hub`)."""
    groups: list[list[Component]] = []
    for part in parts:
        near = [group for group in groups if any(_one_hub(part, other, up, touching) for other in group)]
        groups = [group for group in groups if group not in near] + [[part, *(one for group in near for one in group)]]
    return groups


def _is_rotor(group: Sequence[Component], axes: Sequence[int], whole: np.ndarray) -> bool:
    """Whether a group is flat along one of the axes, wide enough, and lies about one hub."""
    extent, (low, high) = _size(group), box_of(group)
    area = np.array([part.area for part in group])
    middle = (np.array([part.middle for part in group]) * area[:, None]).sum(axis=0) / area.sum()
    # By their names a helicopter's main rotor may be as wide as all of it, and its tail rotor small.
    least, most = (SMALLEST_ROTOR, 0.7) if len(axes) == 1 else (SMALLEST_ROTOR / 2, 1.01)
    for axis in axes:
        across = np.delete(extent, axis).max()
        off = np.linalg.norm(np.delete(middle - (low + high) / 2, axis))
        flat, wide = extent[axis] < FLAT * across, least * whole.max() <= across < most * whole.max()
        if flat and wide and not off > OFF_CENTRE * across / 2:  # a middle that is not known is no fault
            return True
    return False


def rotors(
    parts: Sequence[Component], ups: Sequence[int], whole: np.ndarray, count: int | None
) -> tuple[int, list[list[Component]]]:
    """Return the axis upwards and the groups of components that may be rotors: `count` of them, or none.

    Pieces that their names call rotors come first, whatever their axes, then sets of alike flat groups that lie about
    a hub each, of which the set farthest out is taken: motors stand at the ends of arms. `ups` are the axes that may
    point up, the likeliest first; at least three alike groups are needed where no name tells.
    """
    named = [part for part in parts if TURNING["rotor"].search(part.piece)]
    # Where the number is known, whole propellers that touch stay apart; else blades that touch are taken together.
    alone = [clusters(named, ups[0], touching=False), *(_bladed(named, ups[0], count) if count else [])]
    for groups in alone if count else [clusters(named, ups[0])]:
        good = [group for group in groups if _is_rotor(group, range(3), whole)]
        if good and (count is None or len(good) == count):
            return ups[0], good
    for up in ups if count is None or count > 2 else ():  # two alike pieces may be two blades, or skids
        flat = [part for part in parts if part.extent[up] < FLAT * np.delete(part.extent, up).max()]
        flat = [part for part in flat if np.delete(part.extent, up).max() > 0.04 * whole.max()]
        flat = (
            [part for part in flat if not FIXED.search(part.piece)] if len({part.piece for part in parts}) > 1 else flat
        )
        sets = [clusters(flat, up, touching=not count), *(_bladed(flat, up, count) if count else [])]
        sets = [[group for group in groups if _is_rotor(group, [up], whole)] for groups in sets]
        found = _alike_set(sets, up, whole, count)
        if len(found) > 2:
            return up, found
    return ups[0], []


def _bladed(parts: Sequence[Component], up: int, count: int) -> list[list[list[Component]]]:
    """Sets of `count` groups of as many alike blades each, those whose middles are nearest to one another."""
    sets = []
    for index, part in enumerate(parts):
        same = [other for other in parts if _alike([part], [other])]
        blades, rest = divmod(len(same), count)
        if rest or not 2 <= blades <= 6 or any(other is same[0] for other in parts[:index]):
            continue
        places = np.delete(np.array([other.centre for other in same]), up, axis=1)
        label = fcluster(linkage(places, "average"), count, "maxclust")
        groups = [[other for other, its in zip(same, label, strict=True) if its == one] for one in np.unique(label)]
        if [len(group) for group in groups] == [blades] * count:
            sets.append(groups)
    return sets


def _alike_set(
    choices: list[list[list[Component]]], up: int, whole: np.ndarray, count: int | None
) -> list[list[Component]]:
    """The set of alike groups at one height that is farthest out, of `count` groups or of several; slender pieces
    that all point at the middle and reach near it are arms."""
    found: list[tuple[float, list[list[Component]]]] = []
    for groups in choices:
        for group in groups:
            height = np.mean(box_of(group), axis=0)[up]
            same = [other for other in groups if _alike(group, other)]
            level = [other for other in same if abs(np.mean(box_of(other), axis=0)[up] - height) < 0.1 * whole.max()]
            for one in (level, same):
                if len(one) == count if count else one is level and len(one) >= 2:
                    hubs = np.delete(np.array([np.mean(box_of(member), axis=0) for member in one]), up, axis=1)
                    away = hubs - hubs.mean(axis=0)
                    reach = np.linalg.norm(away, axis=1)
                    along = np.array([np.delete(member[0].along, up) for member in one])
                    radial = np.abs((along * away).sum(axis=1)) > RADIAL * reach
                    slender = [len(member) == 1 and member[0].slender < SLENDER for member in one]
                    inward = (
                        reach - np.array([np.linalg.norm(np.delete(_size(member), up)) / 2 for member in one])
                        < INWARD * reach
                    )
                    if not (radial & slender & inward).all():
                        found.append((float(reach.mean()), one))
    return max(found, key=lambda item: item[0], default=(0.0, []))[1]


def wheels(parts: Sequence[Component], whole: np.ndarray) -> list[list[Component]]:
    """Return the groups of components that may be wheels: those that their names call so, else the largest set of at
    least two alike round ones."""
    named = [part for part in parts if TURNING["wheel"].search(part.piece) and not re.search("steer", part.piece, re.I)]
    groups = [group for group in clusters(named, int(whole.argmin()), False) if _round(_size(group), whole)]
    if len(groups) >= 2:
        return groups
    able = [[part] for part in parts if _round(part.extent, whole)]
    sets = [[other for other in able if _alike(one, other)] for one in able]
    best = max(sets, key=len, default=[])
    return best if len(best) >= 2 else []


def _round(extent: np.ndarray, whole: np.ndarray) -> bool:
    """Whether extents (3,) are those of a wheel."""
    small, *large = np.sort(extent)
    return bool(large[0] > (1 - ROUND) * large[1] and small < 0.8 * large[0] and 0.08 < large[1] / whole.max() < 0.3)
