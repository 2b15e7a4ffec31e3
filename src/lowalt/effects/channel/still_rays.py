"""Points of a part that turns slowly, and what its own triangles do to all their rays of some symbols at once.

In the part's frame such a point stands still and the rays to the station fill a narrow cone. Either no triangle of the
part can meet any ray of the cone, or one of them meets all, or the rays are asked one by one.
"""

import math

import numpy as np

from lowalt.common.jit import INLINED, LEAN
from lowalt.effects.channel.ray_grid import RayGrid
from lowalt.effects.channel.ray_tests import sides

SYMBOLS = 64
"""Symbols whose rays are judged together."""
FREE, HIDDEN, OPEN = 0, 1, 2
"""No ray is hidden by the part's own triangles; all rays are hidden by them; rays are asked one by one."""
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
def _judged(vertices, tree, grid, k, x, y, z, s0, s1, s2, way):
    """What the part of grid k does to the rays from x, y, z to within `way` (m) of the place s0, s1, s2."""
    axes, cells = grid.axes[k], grid.cells
    a, b, c = s0 - x, s1 - y, s2 - z
    far = math.sqrt(a * a + b * b + c * c)
    a, b, c = a / far, b / far, c / far
    ahead = a * axes[0, 0] + b * axes[0, 1] + c * axes[0, 2]
    if grid.way[k] < 0.0 or ahead < 0.9 or way > 0.1 * far:
        return OPEN
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
    found = FREE
    for m in range(max(int(i0), 0), min(int(i1), cells - 1) + 1):
        for n in range(max(int(j0), 0), min(int(j1), cells - 1) + 1):
            for at in range(grid.start[k, m * cells + n], grid.start[k, m * cells + n + 1]):
                one = _met(vertices, tree, grid.pool[k, at], x, y, z, a, b, c, spread)
                if one == HIDDEN:
                    return HIDDEN
                found = max(found, one)
    return found


@LEAN
def _judge(vertices, tree, p, grid, station, ways, points, part, toward, result):
    """Fill result (B, L) with what part p does to the rays of its own points; station (B, 3) m and ways (B,) m."""
    for m in range(len(ways)):
        k = m * SYMBOLS // grid.symbols
        for l in range(len(points)):  # noqa: E741
            result[m, l] = OPEN
            if part[l] == p and toward[l] == 0.0:
                result[m, l] = _judged(
                    vertices, tree, grid, k, points[l, 0], points[l, 1], points[l, 2], station[m, 0], station[m, 1],
                    station[m, 2], ways[m],
                )  # fmt: skip


def judged(vertices, tree, p: int, grid: RayGrid, station: np.ndarray, points, part, toward) -> np.ndarray:
    """Return FREE, HIDDEN or OPEN (B, L) int8 for every SYMBOLS symbols and point, OPEN for points of other parts.

    p: the grid's part, -1 for none; station (N, 3) m: the station in its frame; others: as in `shadow_rays.cast`.
    """
    blocks = -(-len(station) // SYMBOLS)
    result = np.full((blocks, len(points)), OPEN, np.int8)
    if p >= 0:
        some = [station[m * SYMBOLS : (m + 1) * SYMBOLS] for m in range(blocks)]
        middle = np.array([one[len(one) // 2] for one in some])
        ways = np.array([np.linalg.norm(one - at, axis=1).max() for one, at in zip(some, middle, strict=True)])
        _judge(vertices, tree, p, grid, middle, ways, points, part, toward, result)
    return result
