"""Rays from the points of a rotor, wheel or wing against its own triangles, which turn about an axis.

In the part's frame the station runs around the axis at a slope that hardly changes. So for each point the triangles
that lie at such slopes are found, and each is compared with the rays that leave within its azimuths: rays are sorted by
the azimuth at which the part's middle sees the station, which is nearly that of every point. Azimuths are measured by a
number that grows with the angle, by 2 from a direction to the opposite one and by no more than the angle in radians.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.common.jit import INLINED, INNER, LEAN
from lowalt.effects.channel.ray_tests import cross, hit_each, turned_away
from lowalt.effects.channel.surface_tree import Tree

BINS = 512
"""Bins of azimuth."""
STEEPEST = 4.0
"""Largest slope of rays against the plane across the axis; points with steeper rays are asked by the tree."""
NEAREST = 2.0
"""Least distance of the station from the axis, in a point's distance across it from the part's middle."""


class Around(NamedTuple):
    """How the station runs around a part's axis, as the part's middle sees it.

    axes (3, 3): along the axis and twice across; middle (3,) m along and across; order (N,): symbols by azimuth; ends
    (3, N) m: the station then, in the part's frame; begin (BINS + 1,): where each bin's symbols begin in `order`;
    limits (3,): least and largest slope, and least distance across (m).
    """

    axes: np.ndarray
    middle: np.ndarray
    order: np.ndarray
    ends: np.ndarray
    begin: np.ndarray
    limits: np.ndarray


@INLINED
def _around(x, y):
    """A number from 0 to 4 that grows with the azimuth of x, y."""
    t = y / (abs(x) + abs(y) + 1e-300)
    return (4.0 + t if t < 0.0 else t) if x >= 0.0 else 2.0 - t


@INLINED
def _in_axes(axes, x, y, z):
    """Coordinates of a vector along the axis and twice across it."""
    return (
        axes[0, 0] * x + axes[0, 1] * y + axes[0, 2] * z, axes[1, 0] * x + axes[1, 1] * y + axes[1, 2] * z,
        axes[2, 0] * x + axes[2, 1] * y + axes[2, 2] * z,
    )  # fmt: skip


@LEAN
def _run_around(station, seen, bins):
    """Fill order, ends, begin and limits of `seen` for the station (3, N) m in the part's frame; bins (N,): work."""
    begin, limits = seen.begin, seen.limits
    begin[:] = 0
    limits[0], limits[1], limits[2] = np.inf, -np.inf, np.inf
    for n in range(len(bins)):
        along, across, up = _in_axes(seen.axes, station[0, n], station[1, n], station[2, n])
        along, across, up = along - seen.middle[0], across - seen.middle[1], up - seen.middle[2]
        far = math.sqrt(across * across + up * up)
        slope = along / max(far, 1e-300)
        limits[0], limits[1], limits[2] = min(limits[0], slope), max(limits[1], slope), min(limits[2], far)
        bins[n] = min(int(_around(across, up) * (0.25 * BINS)), BINS - 1)
        begin[bins[n] + 1] += 1
    for slot in range(BINS):
        begin[slot + 1] += begin[slot]
    for n in range(len(bins)):
        at = begin[bins[n]]
        begin[bins[n]] += 1
        seen.order[at] = n
        for i in range(3):
            seen.ends[i, at] = station[i, n]
    for slot in range(BINS, 0, -1):
        begin[slot] = begin[slot - 1]
    begin[0] = 0


@INNER
def _placed(tree, p, axes, corners):
    """Fill corners (9, F) with the corners of part p's triangles, each along the axis and twice across."""
    for f in range(tree.count[p]):
        edge = tree.edges[tree.first[p] + f]
        for corner in range(3):
            x, y, z = edge[0], edge[1], edge[2]
            if corner > 0:
                x, y, z = x + edge[3 * corner], y + edge[3 * corner + 1], z + edge[3 * corner + 2]
            at = 3 * corner
            corners[at, f], corners[at + 1, f], corners[at + 2, f] = _in_axes(axes, x, y, z)


@INLINED
def _least(a, b, c):
    """The least of three numbers, by selections that become vector instructions."""
    a = a if a < b else b
    return a if a < c else c


@INLINED
def _most(a, b, c):
    """The largest of three numbers."""
    a = a if a > b else b
    return a if a > c else c


@INNER
def _at_slopes(corners, along, across, up, low, high, count, marks):
    """Fill marks (F,) with 1 where a triangle reaches slopes from low to high as seen from a place, else with 0.

    Its least and largest distance from the axis's parallel through the place are bounded by a box and by its corners.
    """
    a0, a1, a2, b0, b1, b2 = corners[0], corners[1], corners[2], corners[3], corners[4], corners[5]
    c0, c1, c2 = corners[6], corners[7], corners[8]
    # z <= slope x distance for some distance in [near, reach], and z >= slope x distance for some.
    rising, falling = 1.0 if high > 0.0 else 0.0, 1.0 if low > 0.0 else 0.0
    for f in range(np.uint64(count)):
        p1, q1, r1, p2, q2, r2 = a1[f] - across, b1[f] - across, c1[f] - across, a2[f] - up, b2[f] - up, c2[f] - up
        gap, other = (
            _most(_least(p1, q1, r1), -_most(p1, q1, r1), 0.0),
            _most(_least(p2, q2, r2), -_most(p2, q2, r2), 0.0),
        )
        near = math.sqrt(gap * gap + other * other)
        reach = math.sqrt(_most(p1 * p1 + p2 * p2, q1 * q1 + q2 * q2, r1 * r1 + r2 * r2))
        above = high * (rising * reach + (1.0 - rising) * near)
        below = low * (falling * near + (1.0 - falling) * reach)
        least, most = _least(a0[f], b0[f], c0[f]) - along, _most(a0[f], b0[f], c0[f]) - along
        marks[f] = 1.0 if (least <= above + 1e-12) & (most >= below - 1e-12) else 0.0


@INLINED
def _bins_of(corners, f, across, up, room):
    """The first and last bin of triangle f's azimuths and `room` more; all bins where they span half a turn.

    The first may be below 0, and the last beyond the last bin.
    """
    p1, p2 = corners[1, f] - across, corners[2, f] - up
    q1, q2 = corners[4, f] - across, corners[5, f] - up
    r1, r2 = corners[7, f] - across, corners[8, f] - up
    # A corner on the axis's parallel has no azimuth.
    if min(abs(p1) + abs(p2), min(abs(q1) + abs(q2), abs(r1) + abs(r2))) < 1e-6:
        return 0, BINS - 1
    p, q, r = _around(p1, p2), _around(q1, q2), _around(r1, r2)
    a, c = min(p, min(q, r)), max(p, max(q, r))
    b = p + q + r - a - c
    one, two, three = b - a, c - b, 4.0 + a - c
    low, high = a, c
    if one >= two and one >= three:
        low, high = b, a + 4.0
    elif two >= three:
        low, high = c, b + 4.0
    if high - low > 2.0 - 1e-6:
        return 0, BINS - 1
    return math.floor((low - room) * (0.25 * BINS)), math.floor((high + room) * (0.25 * BINS))


@INNER
def _ask(edge, closed, begin, first, last, start, ways, free):
    """Set free (N,) to 0 where the rays of the bins from first to last meet a triangle."""
    if last - first >= BINS - 1:
        hit_each(edge, closed, start, ways, 0, len(free), free)
        return
    if first < 0:
        first, last = first + BINS, last + BINS
    # Bins beyond the last one are the first again.
    hit_each(edge, closed, start, ways, begin[first], begin[min(last, BINS - 1) + 1], free)
    if last >= BINS:
        hit_each(edge, closed, start, ways, 0, begin[last - BINS + 1], free)


@INLINED
def _is_open(found, l):  # noqa: E741
    """Whether any of a point's rays is not hidden yet."""
    n = 0
    while n < len(found) and found[n, l]:
        n += 1
    return n < len(found)


@LEAN
def _cast(seen, p, points, part, toward, tree, corners, marks, ways, free, done, found):
    """Do part p's work of `cast`; corners (9, F), marks (F,), ways (3, N) and free (N,) are work."""
    _placed(tree, p, seen.axes, corners)
    low, high, far = seen.limits[0], seen.limits[1], seen.limits[2]
    for l in range(len(points)):  # noqa: E741
        if part[l] != p or toward[l] != 0.0:
            continue
        x, y, z = points[l, 0], points[l, 1], points[l, 2]
        along, across, up = _in_axes(seen.axes, x, y, z)
        off = math.sqrt((across - seen.middle[1]) ** 2 + (up - seen.middle[2]) ** 2)
        # By how much slopes differ from those that the part's middle sees, at most.
        steepest = max(abs(low), abs(high))
        room = (abs(along - seen.middle[0]) + steepest * off) / max(far - off, 1e-9) + 1e-9
        if far < NEAREST * off or low - room < -STEEPEST or high + room > STEEPEST:
            continue
        done[l] = True
        if not _is_open(found, l):
            continue
        _at_slopes(corners, along, across, up, low - room, high + room, tree.count[p], marks)
        for i in range(3):
            for n in range(np.uint64(len(free))):
                ways[i, n] = seen.ends[i, n] - points[l, i]
        free[:] = 1.0
        for f in range(tree.count[p]):
            g = tree.first[p] + f
            if marks[f] > 0.0 and not turned_away(tree, g, x, y, z):
                # Azimuths differ by at most the angle between the ways from the point and from the part's middle.
                first, last = _bins_of(corners, f, across, up, 1.58 * off / far + 1e-9)
                _ask(tree.edges[g], tree.closed[g], seen.begin, first, last, points[l], ways, free)
        for n in range(len(free)):
            if free[n] == 0.0:
                found[seen.order[n], l] = True


def _seen(station: np.ndarray, axis: np.ndarray, middle: np.ndarray) -> Around:
    """How the station (3, N) m runs around a part's axis (3,) through its middle (3,) m, all in the part's frame."""
    along = axis / np.sqrt((axis * axis).sum())
    right = cross(along, np.eye(3)[abs(along).argmin()])
    right /= np.sqrt((right * right).sum())
    axes, count = np.array([along, right, cross(along, right)]), station.shape[1]
    middle = (axes * middle).sum(axis=1)
    order, begin = np.empty(count, np.int64), np.empty(BINS + 1, np.int64)
    seen = Around(axes, middle, order, np.empty((3, count)), begin, np.empty(3))
    _run_around(station, seen, np.empty(count, np.int64))
    return seen


def cast(
    station: np.ndarray, axes: np.ndarray | None, parts: list[int], points: np.ndarray, part: np.ndarray,
    toward: np.ndarray, tree: Tree, found: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Set found (N, L) where one of `parts` hides a point of its own; return the points (L,) that were asked.

    station (P, 3, N) m: in each part's frame; axes (P, 3): unit vectors there, None where no part is asked; others: as
    in `moving_rays.cast`.
    """
    done = np.zeros(len(points), np.bool_)
    for p in parts:
        seen = _seen(station[p], axes[p], tree.centre[tree.root[p]])
        count, symbols = int(tree.count[p]), len(found)
        work = np.empty((9, count)), np.empty(count), np.empty((3, symbols)), np.empty(symbols)
        _cast(seen, p, points, part, toward, tree, *work, done, found)
    return done
