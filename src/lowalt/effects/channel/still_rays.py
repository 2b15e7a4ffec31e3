"""Points of a part that turns slowly, and what its own triangles do to all their rays of some symbols at once.

In the part's frame such a point stands still and the rays to the station fill a narrow cone. Either no triangle of the
part can meet any ray of the cone, or one of them meets all, or the few that can meet some are held against each ray.
"""

import math

import numpy as np

from lowalt.common.jit import INLINED, LEAN
from lowalt.effects.channel.ray_grid import SYMBOLS, RayGrid, farthest
from lowalt.effects.channel.ray_tests import hit_each, sides
from lowalt.effects.channel.surface_tree import Tree

FREE, HIDDEN, OPEN = 0, 1, 2
"""A triangle meets no ray of a cone; it meets all of them; it may meet some."""
UNKNOWN = -1
"""No answer: the part has no grid there, or the cone is too wide."""
LEAST = 1e-9
"""Least angle between a cone's middle ray and its rim (rad), far above rounding."""


@INLINED
def _met(vertices, tree, f, x, y, z, a, b, c, spread):
    """FREE, HIDDEN or OPEN: what triangle f does to the rays from x, y, z within `spread` (rad) of the unit a, b, c.

    A ray that passes all edges on the positive side leaves by the side of the outward normal.
    """
    i, j, k = tree.faces[f, 0], tree.faces[f, 1], tree.faces[f, 2]
    a0, a1, a2 = vertices[i, 0] - x, vertices[i, 1] - y, vertices[i, 2] - z
    b0, b1, b2 = vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z
    c0, c1, c2 = vertices[k, 0] - x, vertices[k, 1] - y, vertices[k, 2] - z
    least, most = sides(a0, a1, a2, b0, b1, b2, c0, c1, c2, a, b, c, spread)
    if (least < 0 and most > 0) or (tree.closed[f] and least < 0):
        return FREE
    if least == 0 and most == 0:
        return OPEN
    # The plane is ahead of all rays that cross it to one side, or behind all: the sides tell which way they cross it.
    d0, d1, d2, e0, e1, e2 = b0 - a0, b1 - a1, b2 - a2, c0 - a0, c1 - a1, c2 - a2
    height = (d1 * e2 - d2 * e1) * a0 + (d2 * e0 - d0 * e2) * a1 + (d0 * e1 - d1 * e0) * a2
    room = 1e-13 * (abs(d0) + abs(d1) + abs(d2)) * (abs(e0) + abs(e1) + abs(e2)) * (abs(a0) + abs(a1) + abs(a2))
    ahead = height if most > 0 else -height
    if ahead < -room:
        return FREE
    return HIDDEN if (least > 0 or most < 0) and ahead > room else OPEN


@INLINED
def _judged(vertices, tree, grid, k, start, aim, way, stamp, stamps, some):
    """Fill `some` with the triangles of grid k that may meet some rays from `start` (3,) to within `way` (m) of `aim`.

    Return their number and FREE; or HIDDEN where one triangle meets all rays, UNKNOWN without an answer. stamps (F,):
    work, less than `stamp` at first; a triangle of several cells is asked once.
    """
    axes, cells = grid.axes[k], grid.cells
    x, y, z = start[0], start[1], start[2]
    a, b, c = aim[0] - x, aim[1] - y, aim[2] - z
    far = math.sqrt(a * a + b * b + c * c)
    a, b, c = a / far, b / far, c / far
    ahead = a * axes[0, 0] + b * axes[0, 1] + c * axes[0, 2]
    if grid.way[k] < 0.0 or ahead < 0.9 or way > 0.1 * far:
        return 0, UNKNOWN
    spread = 1.1 * way / far + LEAST
    i, j, h = x - grid.middle[0], y - grid.middle[1], z - grid.middle[2]
    height = i * axes[0, 0] + j * axes[0, 1] + h * axes[0, 2]
    share = height / ahead
    i, j, h = i - share * a, j - share * b, h - share * c
    right, up = i * axes[1, 0] + j * axes[1, 1] + h * axes[1, 2], i * axes[2, 0] + j * axes[2, 1] + h * axes[2, 2]
    # A ray within `spread` crosses the plane at most this far away: ahead > 0.9 and the spread is below 0.11 rad.
    room = 1.6 * abs(height) * spread + 1e-9
    low, wide = grid.low[k], grid.wide[k]
    i0, i1 = math.floor((right - room - low[0]) * wide[0]), math.floor((right + room - low[0]) * wide[0])
    j0, j1 = math.floor((up - room - low[1]) * wide[1]), math.floor((up + room - low[1]) * wide[1])
    count = 0
    for m in range(max(int(i0), 0), min(int(i1), cells - 1) + 1):
        for n in range(max(int(j0), 0), min(int(j1), cells - 1) + 1):
            for at in range(grid.start[k, m * cells + n], grid.start[k, m * cells + n + 1]):
                f = grid.pool[k, at]
                # All rays go toward the station, and what reaches less far than their start is behind them.
                if stamps[f] == stamp or grid.top[k, f] < height - 1e-9:
                    continue
                stamps[f] = stamp
                one = _met(vertices, tree, f, x, y, z, a, b, c, spread)
                if one == HIDDEN:
                    return 0, HIDDEN
                if one == OPEN:
                    some[count] = f
                    count += 1
    return count, FREE


@INLINED
def _block(tree, some, count, start, station, ways, free, found):
    """Set found (n,) of one point where one of the triangles some[:count] hides it; station (n, 3) m."""
    size = len(station)
    for n in range(size):
        for i in range(3):
            ways[i, n] = station[n, i] - start[i]
        free[n] = 1.0
    for at in range(count):
        hit_each(tree.edges[some[at]], tree.closed[some[at]], start, ways, 0, size, free)
    for n in range(size):
        if free[n] == 0.0:
            found[n] = True


@LEAN
def _judge(vertices, tree, p, grid, station, middle, way, points, part, toward, stamps, some, ways, free, asked, found):
    """Do the work of `judged`; middle (B, 3) m and way (B,) m: place and radius of each block's rays' ends."""
    for m in range(len(way)):
        k = m * SYMBOLS // grid.symbols
        first, past = m * SYMBOLS, min((m + 1) * SYMBOLS, len(station))
        for l in range(len(points)):  # noqa: E741
            if part[l] != p or toward[l] != 0.0:
                continue
            rest = False
            for n in range(first, past):
                rest = rest or not found[n, l]
            asked[m, l] = True
            if not rest:
                continue
            stamp = m * len(points) + l
            count, verdict = _judged(
                vertices, tree, grid, k, points[l], middle[m], way[m], stamp, stamps, some
            )  # fmt: skip
            asked[m, l] = verdict != UNKNOWN
            if verdict == HIDDEN:
                found[first:past, l] = True
            elif count > 0:
                _block(tree, some, count, points[l], station[first:past], ways, free, found[first:past, l])


def judged(
    vertices: np.ndarray, tree: Tree, p: int, grid: RayGrid, station: np.ndarray, points: np.ndarray, part: np.ndarray,
    toward: np.ndarray, found: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """Set found (N, L) where part p hides a point of its own; return who was asked, (B, L) bool by SYMBOLS symbols.

    p: the grid's part, -1 for none; station (N, 3) m: the station in its frame; others: as in `moving_rays.cast`.
    """
    starts = range(0, len(station), SYMBOLS)
    asked = np.zeros((len(starts), len(points)), np.bool_)
    if p >= 0:
        middle = np.array([station[(first + min(first + SYMBOLS, len(station))) // 2] for first in starts])
        way = np.empty(len(middle))
        farthest(station, middle, SYMBOLS, way)
        work = (
            np.full(len(tree.owner), -1),
            np.empty(tree.count[p], np.int64),
            np.empty((3, SYMBOLS)),
            np.empty(SYMBOLS),
        )
        _judge(vertices, tree, p, grid, station, middle, way, points, part, toward, *work, asked, found)
    return asked
