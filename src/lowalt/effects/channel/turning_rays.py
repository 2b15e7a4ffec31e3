"""Rays from the points of a rotor, wheel or wing against its own triangles, which turn about an axis.

In the part's frame the station runs around the axis at a slope that hardly changes. So for each point the triangles
that lie at such slopes are sorted by azimuth, and a ray is compared with those of its azimuth. Azimuths are measured by
a number that grows with the angle, by 2 from a direction to the opposite one.
"""

import math

import numpy as np

from lowalt.common.jit import INLINED, INNER, LEAN
from lowalt.effects.channel.ray_tests import cross, first_hit
from lowalt.effects.channel.surface_tree import Tree

BINS = 96
"""Bins of azimuth."""
ROOM = 16
"""Places in a point's lists for each triangle; a point that needs more is asked by the tree."""
STEEPEST = 4.0
"""Largest slope of rays against the plane across the axis; points with steeper rays are asked by the tree."""


@INLINED
def _around(x, y):
    """A number from 0 to 4 that grows with the azimuth of x, y."""
    t = y / (abs(x) + abs(y) + 1e-300)
    return (4.0 + t if t < 0.0 else t) if x >= 0.0 else 2.0 - t


@INLINED
def _across(axes, i, j, k):
    """Coordinates of a vector across the axis and along it."""
    return (
        axes[1, 0] * i + axes[1, 1] * j + axes[1, 2] * k, axes[2, 0] * i + axes[2, 1] * j + axes[2, 2] * k,
        axes[0, 0] * i + axes[0, 1] * j + axes[0, 2] * k,
    )  # fmt: skip


@INLINED
def _at_slope(corners, low, high):
    """Whether a triangle reaches slopes from low to high; corners (3, 3) from the ray's start, across twice and along.

    Its least and largest distance from the axis's parallel through the start are bounded by a box and by its corners.
    """
    least, most, reach = min(corners[0, 2], min(corners[1, 2], corners[2, 2])), -np.inf, 0.0
    square = 0.0
    for axis in range(2):
        a, b, c = corners[0, axis], corners[1, axis], corners[2, axis]
        gap = max(min(a, min(b, c)), -max(a, max(b, c)))
        square += max(gap, 0.0) ** 2
    for corner in range(3):
        most = max(most, corners[corner, 2])
        reach = max(reach, math.sqrt(corners[corner, 0] ** 2 + corners[corner, 1] ** 2))
    near = math.sqrt(square)
    # z <= slope x distance for some distance in [near, reach], and z >= slope x distance for some.
    above = high * (reach if high > 0.0 else near)
    below = low * (near if low > 0.0 else reach)
    return least <= above + 1e-12 and most >= below - 1e-12


@INLINED
def _bins_of(corners, ends):
    """Fill ends (2,) with the first and last bin of a triangle's azimuths; all bins where they span half a turn."""
    ends[0], ends[1] = 0, BINS - 1
    for corner in range(3):
        # A corner on the axis's parallel has no azimuth.
        if abs(corners[corner, 0]) + abs(corners[corner, 1]) < 1e-6:
            return
    p, q, r = (
        _around(corners[0, 0], corners[0, 1]), _around(corners[1, 0], corners[1, 1]),
        _around(corners[2, 0], corners[2, 1]),
    )  # fmt: skip
    a, c = min(p, min(q, r)), max(p, max(q, r))
    b = p + q + r - a - c
    one, two, three = b - a, c - b, 4.0 + a - c
    low, high = a, c
    if one >= two and one >= three:
        low, high = b, a + 4.0
    elif two >= three:
        low, high = c, b + 4.0
    if high - low > 2.0 - 1e-6:
        return
    ends[0], ends[1] = math.floor((low - 1e-9) * (0.25 * BINS)), math.floor((high + 1e-9) * (0.25 * BINS))


@INLINED
def _band(station, axes, x, y, z, found, l):  # noqa: E741
    """Least and largest slope of the rays from x, y, z that are not found yet; an empty band where all are."""
    low, high = np.inf, -np.inf
    for n in range(len(station)):
        if not found[n, l]:
            across, up, along = _across(axes, station[n, 0] - x, station[n, 1] - y, station[n, 2] - z)
            slope = along / math.sqrt(across * across + up * up + 1e-300)
            low, high = min(low, slope), max(high, slope)
    return low, high


@INNER
def _sorted(vertices, tree, p, axes, x, y, z, low, high, start, pool, ends, corners):
    """Fill start (BINS + 1,) and pool with the triangles of part p by azimuth; return whether there is room."""
    first, count = tree.first[p], tree.count[p]
    start[:] = 0
    for f in range(count):
        for corner in range(3):
            at = tree.faces[first + f, corner]
            corners[corner, 0], corners[corner, 1], corners[corner, 2] = _across(
                axes, vertices[at, 0] - x, vertices[at, 1] - y, vertices[at, 2] - z
            )
        ends[f, 1] = -1
        ends[f, 0] = 0
        if _at_slope(corners, low, high):
            _bins_of(corners, ends[f])
        for slot in range(ends[f, 0], ends[f, 1] + 1):
            start[(slot + BINS) % BINS + 1] += 1
    for slot in range(BINS):
        start[slot + 1] += start[slot]
    if start[BINS] > len(pool):
        return False
    for f in range(count):
        for slot in range(ends[f, 0], ends[f, 1] + 1):
            at = (slot + BINS) % BINS
            pool[start[at]] = first + f
            start[at] += 1
    for slot in range(BINS, 0, -1):
        start[slot] = start[slot - 1]
    start[0] = 0
    return True


@LEAN
def _cast(station, axes, p, points, part, toward, vertices, tree, start, pool, ends, corners, done, found):
    """Do part p's work of `cast`; station (N, 3) m in its frame, axes (3, 3): along its axis and across."""
    for l in range(len(points)):  # noqa: E741
        if part[l] != p or toward[l] != 0.0:
            continue
        x, y, z = points[l, 0], points[l, 1], points[l, 2]
        low, high = _band(station, axes, x, y, z, found, l)
        if low > high:
            done[l] = True
            continue
        if low < -STEEPEST or high > STEEPEST:
            continue
        room = 1e-9
        done[l] = _sorted(vertices, tree, p, axes, x, y, z, low - room, high + room, start, pool, ends, corners)
        if not done[l]:
            continue
        for n in range(len(station)):
            if found[n, l]:
                continue
            u, v, w = station[n, 0] - x, station[n, 1] - y, station[n, 2] - z
            across, up, _ = _across(axes, u, v, w)
            slot = min(int(_around(across, up) * (0.25 * BINS)), BINS - 1)
            if first_hit(tree, pool, start[slot], start[slot + 1], x, y, z, u, v, w) >= 0:
                found[n, l] = True


def cast(
    station: np.ndarray, axes: np.ndarray, parts: list[int], points: np.ndarray, part: np.ndarray, toward: np.ndarray,
    vertices: np.ndarray, tree: Tree, found: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Set found (N, L) where one of `parts` hides a point of its own; return the points (L,) that were asked.

    axes (P, 3): unit vectors in the parts' frames; others: as in `shadow_rays.cast`.
    """
    done = np.zeros(len(points), np.bool_)
    for p in parts:
        along = axes[p] / np.linalg.norm(axes[p])
        right = cross(along, np.eye(3)[abs(along).argmin()])
        right /= np.linalg.norm(right)
        count = int(tree.count[p])
        _cast(
            np.ascontiguousarray(station[:, p]), np.stack([along, right, cross(along, right)]), p, points, part,
            toward, vertices, tree, np.empty(BINS + 1, np.int64), np.empty(ROOM * count + BINS, np.int64),
            np.empty((count, 2), np.int64), np.empty((3, 3)), done, found,
        )  # fmt: skip
    return done
