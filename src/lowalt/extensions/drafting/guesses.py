"""Guesses on what a mesh file does not state: unit, axes, and kinds of connected components."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial import cKDTree

from lowalt.targets.mesh_files import UNITS_M, Mesh, edges_of

USUAL_M = {"UAV": (0.08, 8.0), "Bird": (0.08, 2.5), "Vehicle": (2.5, 13.0)}
"""Usual range (m) of the largest extent of a whole target, by category."""

OTHER_SIZES_M = {"Vehicle": ((1.4, 2.7), (1.0, 4.0))}
"""Usual ranges (m) of the second largest and of the smallest extent, for categories that have them.
"""

UNUSUAL = 20
"""A target with its own table row may differ from USUAL_M by at most this factor."""

ALIKE = 0.1
"""Two pieces are alike if their extents differ by at most this share, as the four propellers of a
craft do.
"""

WIDE_ROTOR = 0.5
"""A rotor wider than this share of the craft is the main rotor of a helicopter, not the propeller
of a plane.
"""

FLAT = 0.35
"""Largest thickness of a propeller divided by its length."""

SMALLEST_ROTOR = 0.15
"""Least width of a rotor as a share of the craft's largest extent; screws and motor caps are
smaller.
"""

OFF_CENTRE = 0.3
"""Largest distance between the centroid of a rotor's surface and the centre of its bounding box, as
a share of its radius. A rotor of three blades has 0.25."""

SYMMETRIC = 0.02
"""A body is symmetric if the mean distance from its mirror image is at most this share of its size.
"""

ASYMMETRIC = 0.01
"""A body has no second mirror plane if its mean distance from its mirror image along the other
horizontal axis is at least this share of its size."""

IN_PLANE = 1e-3
AT_ZERO = 0.01
CUT = 0.05
OPEN_CUT = 0.15
"""A mesh may hold one half of a target, which ends in a plane. IN_PLANE is the largest distance of
its end points from that plane, AT_ZERO that of the plane from the origin of the file, both as
shares of the size. CUT and OPEN_CUT are the least area that the end spans, as a share of the
bounding box: CUT for a plane at the origin, OPEN_CUT for an open end anywhere."""

SLENDER = 0.35
RADIAL = 0.95
INWARD = 0.4
"""An arm, unlike a blade, is at most SLENDER times as wide as long (by spread). It points at the
middle of the craft with a cosine of at least RADIAL, and its inner end is at most INWARD times as
far from there as its centre."""

IN_LINE = 0.9
"""Least cosine of the angle between a blade and the line to the other blade of the same rotor."""

LONG = 0.75
"""Largest ratio of width to length of a blade's bounding box. A blade at 30 degrees to the axes has
0.6, a disc 1.
"""

TOUCH = 0.1
"""Two blades of a rotor are at most twice this share of the longer blade apart, since the hub lies
between them.
"""

ROUND = 0.12
"""The two extents of a wheel across its axis differ by at most this share."""

_ROTOR = (
    r"(?:(?<![a-z])|main|tail)(?:rotor(?!craft)|prop(?!ul|ert)|blade|fan(?![a-z])|puller|pusher)"
)
TURNING = {
    "rotor": re.compile(_ROTOR + r"(?!.*(?:guard|duct|mount|shroud))", re.I),
    "wheel": re.compile(r"wheel|tyre|tire(?!d)", re.I),
    "wing": re.compile(r"wing", re.I),
}
"""Words in the names of joints and links, and of pieces of meshes, that say what a part is."""

TAIL = re.compile(r"(?<![a-z])tail", re.I)
FIXED = re.compile(r"(?<![a-z])(motor|mount|arm(?![a-z])|leg|skid|land|frame|guard|duct)", re.I)
"""Words in the names of pieces that do not turn."""


@dataclass(frozen=True)
class Component:
    """A connected component of a mesh.

    low, high: (3,) m, corners of its bounding box along the file's axes; triangles: their number;
    closed: whether its surface is closed; piece: the names of the piece that it belongs to; guess:
    the kind of part that it may be (rotor, wheel, or an empty text); middle: (3,) m, centroid of
    its surface; area: m2; along: (3,) direction in which it is longest; slender: its spread across
    that direction over its spread along it.
    """

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


class Group(tuple[Component, ...]):
    """Components that may be one moving part, such as the blades of a rotor.

    Its properties are those of a component.
    """

    low = property(lambda self: np.min([part.low for part in self], axis=0))
    high = property(lambda self: np.max([part.high for part in self], axis=0))
    extent = property(lambda self: self.high - self.low)
    centre = property(lambda self: (self.low + self.high) / 2)
    triangles = property(lambda self: sum(part.triangles for part in self))
    area = property(lambda self: sum(part.area for part in self))
    middle = property(lambda self: sum(part.area * part.middle for part in self) / self.area)


def guessed_unit(extents: np.ndarray, category: str, wanted_m: float | None = None) -> str:
    """Return the unit of UNITS_M in which the extents (3,) of a file fit a target best.

    wanted_m: the target's largest extent, if it is known. Otherwise the best unit is the one in
    which the extents leave the usual ranges of the category least, by the sum of the logarithms of
    the factors. Of several such units, it is the one whose largest extent is nearest to the
    geometric mean of USUAL_M.
    """
    sizes = np.sort(extents)[::-1]
    usual = (USUAL_M[category], *OTHER_SIZES_M.get(category, ()))
    middle = wanted_m or float(np.sqrt(np.prod(USUAL_M[category])))

    def misfit(unit: str) -> tuple[float, float]:
        """How far the extents lie outside their ranges, and the largest one from the middle."""
        lengths = sizes * UNITS_M[unit]
        off_middle = abs(np.log(lengths[0] / middle))
        if wanted_m:
            return 0.0, off_middle
        outside = []
        for size, (low, high) in zip(lengths, usual, strict=False):
            outside.append(max(low / size, size / high, 1.0))
        return float(np.log(outside).sum().round(6)), off_middle

    return min(UNITS_M, key=misfit)


def off_mirror(points: np.ndarray) -> np.ndarray:
    """Return the mean distance (3,) of points (N, 3) from their mirror image along each axis.

    It is relative to their size.
    """
    tree = cKDTree(points)
    off = []
    for axis in range(3):
        mirrored = points.copy()
        mirrored[:, axis] = points[:, axis].min() + points[:, axis].max() - points[:, axis]
        off.append(float(np.mean(tree.query(mirrored)[0])))
    return np.array(off) / max(float(np.ptp(points, axis=0).max()), 1e-300)


def mirror_axis(points: np.ndarray) -> int | None:
    """Return the only axis along which a body of points (N, 3) is its own mirror image.

    Such are left and right of a bird.

    Return None if there is no such axis or more than one.
    """
    off = off_mirror(points)
    best, second = np.sort(off)[:2]
    if best < SYMMETRIC and best < second / 2:
        return int(np.argmin(off))
    return None


def cut_axis(mesh: Mesh, points: np.ndarray, axes: Sequence[int]) -> int | None:
    """Return the axis along which a target is cut in half, None if it seems whole.

    points: (N, 3) m on its surface. A half is not its own mirror image along that axis. It ends in
    a plane, where its surface is open or which passes through the origin of the file.
    """
    edges, _, uses = edges_of(mesh.faces)
    ends = mesh.vertices[edges]
    extent = np.ptp(mesh.vertices, axis=0)
    off = off_mirror(points)
    size = extent.max()
    for axis in axes:
        for limit in (mesh.vertices[:, axis].min(), mesh.vertices[:, axis].max()):
            there = (np.abs(ends[:, :, axis] - limit) < IN_PLANE * size).all(axis=1)
            if off[axis] < SYMMETRIC or not there.any():
                continue
            spread = np.ptp(ends[there].reshape(-1, 3), axis=0) / extent
            span = np.prod(np.delete(spread, axis))
            through_origin = span > CUT and abs(limit) < AT_ZERO * size
            is_open = span > OPEN_CUT and (uses[there] == 1).all()
            if through_origin or is_open:
                return axis
    return None


def guessed_axes(
    extent: np.ndarray, category: str, up: int | None = None, right: int | None = None
) -> tuple[str, str]:
    """Return the axes of the file that may point up and to the front, from the extents (3,) alone.

    They have no signs.
    The smallest extent points up. The largest points to the front of a vehicle, and across a bird
    with spread wings.
    up, right: numbers of axes that are already known.
    """
    order = [axis for axis in np.argsort(extent, kind="stable") if axis not in (up, right)]
    if up is not None:
        order = [up, *order]
    if right is not None:
        order = [*order, right]
        return "xyz"[order[0]], "xyz"[order[1]]
    lowest, middle, longest = order
    front = int(longest if category == "Vehicle" else middle)
    if category == "UAV" and abs(extent[middle] / extent[longest] - 1) < ALIKE:
        front = next(axis for axis in range(3) if axis != lowest)
    return "xyz"[order[0]], "xyz"[front]


def alike(first: Component | Group, second: Component | Group) -> bool:
    """Return whether two components are copies.

    Copies have the same three sizes in any order, to within ALIKE, or the same number of triangles
    and area, as propellers at different angles, whose boxes differ.
    """
    difference = abs(first.area - second.area)
    same_area = difference <= ALIKE * max(first.area, second.area)
    if first.triangles == second.triangles and same_area:
        return True
    sizes = np.sort(first.extent)
    other_sizes = np.sort(second.extent)
    largest = max(sizes[2], other_sizes[2])
    return bool((abs(sizes - other_sizes) <= ALIKE * largest).all())


def _one_hub(first: Component, second: Component, up: int, touching: bool) -> bool:
    """Return whether two components turn about one hub.

    One is centred on the other, as a spinner on a propeller, and they are not a pair of coaxial
    rotors.

    touching: whether long blades that touch, unlike discs, share a hub too.
    """
    away = np.abs(first.centre - second.centre)
    radius = max(first.extent.max(), second.extent.max()) / 2
    same = alike(first, second)
    if same and away[up] > 2 * max(first.extent[up], second.extent[up]):
        return False
    slack = TOUCH * 2 * radius
    latest_begin = np.maximum(first.low, second.low) - slack
    first_end = np.minimum(first.high, second.high) + slack
    near = bool((latest_begin <= first_end).all())
    long = all(np.sort(blade.extent)[1] < LONG * blade.extent.max() for blade in (first, second))
    # Two slender blades in one line, closer than their length, at any angle to the axes of the
    # file.
    between = second.centre - first.centre
    distance = float(np.linalg.norm(between))
    close = distance < float(np.linalg.norm(first.extent))
    in_line = abs(float(between @ first.along)) > IN_LINE * distance
    slender = max(first.slender, second.slender) < SLENDER
    if same and in_line and slender and close:
        return True
    away[up] = 0
    centred = float(np.linalg.norm(away)) <= radius / 2
    return near and (centred or (touching and same and long))


def clusters(parts: Sequence[Component], up: int, touching: bool = True) -> list[Group]:
    """Return the components grouped by hub (`_one_hub`), such as the two blades of a propeller."""
    groups: list[Group] = []
    for part in parts:
        members = [part]
        others = []
        for group in groups:
            if any(_one_hub(part, other, up, touching) for other in group):
                members += group
            else:
                others.append(group)
        groups = [*others, Group(members)]
    return groups


def _is_rotor(group: Group, axes: Sequence[int], whole: np.ndarray) -> bool:
    """Return whether a group is flat along one of the axes, wide enough, and lies about one hub."""
    # Groups named as rotors are tried along all axes and may be wider or smaller: a helicopter's
    # main rotor may be as wide as the craft, and its tail rotor is small.
    if len(axes) == 1:
        least = SMALLEST_ROTOR
        most = 0.7
    else:
        least = SMALLEST_ROTOR / 2
        most = 1.01
    for axis in axes:
        across = np.delete(group.extent, axis).max()
        off = np.linalg.norm(np.delete(group.middle - group.centre, axis))
        flat = group.extent[axis] < FLAT * across
        wide = least * whole.max() <= across < most * whole.max()
        if flat and wide and not off > OFF_CENTRE * across / 2:  # true for an unknown middle, NaN
            return True
    return False


def turning_axis(group: Group, up: int, low: np.ndarray, high: np.ndarray) -> int:
    """Return the axis along which a rotor or wheel is thinnest, and about which it turns.

    Two blades may be thinner along their chord than along their axis. A rotor wider than half the
    craft is therefore taken to turn about the axis `up`, and a tail rotor about the horizontal axis
    across the tail. low, high: (3,) m, corners of the craft.
    """
    order = np.argsort(group.extent, kind="stable")
    extent = high - low
    if up in order[:2] and group.extent.max() > WIDE_ROTOR * extent.max():
        return up
    if TAIL.search(group[0].piece):
        away = np.abs(group.centre - (low + high) / 2)
        level = [axis for axis in range(3) if axis != up]
        across = min(level, key=away.__getitem__)
        if across in order[:2]:
            return across
    return int(order[0])


def rotors(
    parts: Sequence[Component], ups: Sequence[int], whole: np.ndarray, count: int | None
) -> tuple[int, list[Group]]:
    """Return the axis that points up, and the groups of components that may be rotors.

    There are `count` groups, or none.

    Pieces named as rotors are tried first, whatever their axes. Without such names, rotors are a
    set of at least three alike flat groups, each around its own hub. Of several sets the one
    farthest out is taken, since motors stand at the ends of arms. ups: axes that may point up, the
    likeliest first.
    """
    named = [part for part in parts if TURNING["rotor"].search(part.piece)]
    for groups in _grouped(named, ups[0], count):
        good = [group for group in groups if _is_rotor(group, range(3), whole)]
        if good and (count is None or len(good) == count):
            return ups[0], good
    if count is not None and count <= 2:
        # Two alike pieces may be two blades, or skids.
        return ups[0], []
    several = len({part.piece for part in parts}) > 1
    able = [part for part in parts if not (several and FIXED.search(part.piece))]
    for up in ups:
        flat = []
        for part in able:
            width = np.delete(part.extent, up).max()
            if part.extent[up] < FLAT * width and width > 0.04 * whole.max():
                flat.append(part)
        choices = []
        for groups in _grouped(flat, up, count):
            choices.append([group for group in groups if _is_rotor(group, [up], whole)])
        best = _alike_set(choices, up, whole, count)
        if len(best) > 2:
            return up, best
    return ups[0], []


def _grouped(parts: Sequence[Component], up: int, count: int | None) -> list[list[Group]]:
    """Return possible groupings of components by hub.

    They are grouped by nearness and, where the number of rotors is known, also into `count` groups
    with the same number of alike blades each, clustered by their centres.
    """
    # If the number is known, propellers that touch stay apart; otherwise blades that touch are one
    # rotor.
    ways = [clusters(parts, up, touching=not count)]
    if not count:
        return ways
    for index, part in enumerate(parts):
        same = [other for other in parts if alike(part, other)]
        blades, odd = divmod(len(same), count)
        if odd or not 2 <= blades <= 6 or any(other is same[0] for other in parts[:index]):
            continue
        in_plan = np.delete(np.array([other.centre for other in same]), up, axis=1)
        label = fcluster(linkage(in_plan, "average"), count, "maxclust")
        groups = []
        for hub in np.unique(label):
            groups.append(Group(same[number] for number in np.flatnonzero(label == hub)))
        if [len(group) for group in groups] == [blades] * count:
            ways.append(groups)
    return ways


def _alike_set(
    choices: list[list[Group]], up: int, whole: np.ndarray, count: int | None
) -> list[Group]:
    """The set of alike groups, except arms, that is farthest out.

    It has `count` groups, or two or more at one height.
    """
    best: list[Group] = []
    farthest = 0.0
    for groups in choices:
        for group in groups:
            same = [other for other in groups if alike(group, other)]
            height = group.centre[up]
            level = [other for other in same if abs(other.centre[up] - height) < 0.1 * whole.max()]
            candidates = [level]
            if count:
                candidates.append(same)
            for able in candidates:
                enough = len(able) >= 2
                if count:
                    enough = len(able) == count
                in_plan = np.delete(np.array([member.centre for member in able]), up, axis=1)
                reach = np.linalg.norm(in_plan - in_plan.mean(axis=0), axis=1).mean()
                if enough and reach > farthest and not _are_arms(able, up):
                    best = able
                    farthest = float(reach)
    return best


def _are_arms(groups: list[Group], up: int) -> bool:
    """Whether all groups are slender pieces that point at the middle and reach near it."""
    centres = np.delete(np.array([group.centre for group in groups]), up, axis=1)
    extents = np.delete(np.array([group.extent for group in groups]), up, axis=1)
    away = centres - centres.mean(axis=0)
    reach = np.linalg.norm(away, axis=1)
    along = np.array([np.delete(group[0].along, up) for group in groups])
    radial = np.abs((along * away).sum(axis=1)) > RADIAL * reach
    slender = [len(group) == 1 and group[0].slender < SLENDER for group in groups]
    inner_end = reach - np.linalg.norm(extents, axis=1) / 2
    return bool((radial & slender & (inner_end < INWARD * reach)).all())


def wheels(parts: Sequence[Component], whole: np.ndarray) -> list[Group]:
    """Return the groups of components that may be wheels.

    These are those whose names say so, otherwise the largest set of at least two alike round ones.
    """
    named = []
    for part in parts:
        if TURNING["wheel"].search(part.piece) and not re.search("steer", part.piece, re.I):
            named.append(part)
    by_hub = clusters(named, int(whole.argmin()), touching=False)
    groups = [group for group in by_hub if _round(group.extent, whole)]
    if len(groups) >= 2:
        return groups
    able = [Group([part]) for part in parts if _round(part.extent, whole)]
    best: list[Group] = []
    for group in able:
        same = [other for other in able if alike(group, other)]
        if len(same) > len(best):
            best = same
    if len(best) < 2:
        return []
    return best


def _round(extent: np.ndarray, whole: np.ndarray) -> bool:
    """Whether extents (3,) are those of a wheel."""
    small, *large = np.sort(extent)
    return bool(
        large[0] > (1 - ROUND) * large[1]
        and small < 0.8 * large[0]
        and 0.08 < large[1] / whole.max() < 0.3
    )
