"""A part's triangles sorted by where a narrow cone of rays can meet them, for parts that turn slowly.

Take a plane through the part's middle, across the direction to the station. Seen from the station, every triangle has
an image on it. In the part's frame the station moves a little during some symbols, by up to d from the place from which
images are taken, R away. A ray to it that crosses the plane at q, less than twice the part's radius from the middle, is
at height h at most |h| d (1 + |q| / R) R / ((R - d) (R - |h|)) away from q, as seen from that place. Rays that cross
it farther out pass by the part. So the plane is divided into cells, each with the triangles whose images, widened by as
much, reach into it. A ray is compared with those of its cell.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.common.jit import INLINED, INNER, LEAN
from lowalt.effects.channel.ray_tests import cross, hit
from lowalt.effects.channel.surface_tree import Tree

SYMBOLS = 64
"""Symbols whose rays are asked together; a grid serves a multiple of them."""
SIDES = 16, 64
"""Fewest and most cells along each side."""
ROOM = 24
"""Entries of a grid for each triangle; where that is too few, rays are asked by the tree."""
NEAREST = 4.0
"""Least distance of the station for a grid, in the part's radius and the station's way together."""


class RayGrid(NamedTuple):
    """Grids of a part, one for every `symbols` symbols, a multiple of SYMBOLS.

    axes (K, 3, 3): to the station, and two across; middle (3,) and radius_m of the part; far (K,) m: the station's
    distance; way (K,) m: how far it moves, negative where the tree is to be asked; low (K, 2) m, wide (K, 2) 1/m: edges
    and cells a metre; cells: along each side; start (K, cells^2 + 1): where each begins in pool (K, ...), of
    triangles; top (K, F) m: how far each of the part's triangles reaches from the plane toward the station.
    """

    axes: np.ndarray
    middle: np.ndarray
    radius_m: float
    far: np.ndarray
    way: np.ndarray
    low: np.ndarray
    wide: np.ndarray
    cells: int
    symbols: int
    start: np.ndarray
    pool: np.ndarray
    top: np.ndarray


NONE = RayGrid(
    np.zeros((1, 3, 3)), np.zeros(3), 0.0, np.zeros(1), np.full(1, -1.0), np.zeros((1, 2)), np.zeros((1, 2)), 0, 1,
    np.zeros((1, 1), np.int64), np.zeros((1, 1), np.int64), np.zeros((1, 1)),
)  # fmt: skip
"""No grid at all."""


@INLINED
def _image(vertices, tree, f, axes, middle, radius_m, far, way, out):
    """Fill out (5,) with the edges of triangle f's widened image, low and high, and how far it reaches to the station.

    Return whether any ray can meet it.
    """
    i, j, k = tree.faces[f, 0], tree.faces[f, 1], tree.faces[f, 2]
    if tree.closed[f]:
        d0, d1, d2 = vertices[j, 0] - vertices[i, 0], vertices[j, 1] - vertices[i, 1], vertices[j, 2] - vertices[i, 2]
        e0, e1, e2 = vertices[k, 0] - vertices[i, 0], vertices[k, 1] - vertices[i, 1], vertices[k, 2] - vertices[i, 2]
        u, v, w = d1 * e2 - d2 * e1, d2 * e0 - d0 * e2, d0 * e1 - d1 * e0
        a, b, c = middle[0] - vertices[i, 0], middle[1] - vertices[i, 1], middle[2] - vertices[i, 2]
        facing = u * (a + far * axes[0, 0]) + v * (b + far * axes[0, 1]) + w * (c + far * axes[0, 2])
        # A closed surface hides nothing with the side turned away.
        if facing < 0.0 and facing * facing > (u * u + v * v + w * w) * (way + 1e-9 * far) ** 2:
            return False
    off = 0.0
    out[0], out[1], out[2], out[3], out[4] = np.inf, np.inf, -np.inf, -np.inf, -np.inf
    for corner in range(3):
        at = tree.faces[f, corner]
        x, y, z = vertices[at, 0] - middle[0], vertices[at, 1] - middle[1], vertices[at, 2] - middle[2]
        height = x * axes[0, 0] + y * axes[0, 1] + z * axes[0, 2]
        off, out[4] = max(off, abs(height)), max(out[4], height)
        larger = far / (far - height)
        for side in range(2):
            place = (x * axes[1 + side, 0] + y * axes[1 + side, 1] + z * axes[1 + side, 2]) * larger
            out[side], out[2 + side] = min(out[side], place), max(out[2 + side], place)
    room = off * way * (1.0 + 2.0 * radius_m / far) * far / ((far - way) * (far - off)) + 1e-9 * far
    out[0], out[1], out[2], out[3] = out[0] - room, out[1] - room, out[2] + room, out[3] + room
    return True


@INNER
def _filled(vertices, tree, p, axes, middle, radius_m, far, way, images, shown, low, wide, cells, start, pool, top):
    """Fill one grid of part p; images (F, 5) and shown (F,) are work. Return whether there is room for it."""
    first, count = tree.first[p], tree.count[p]
    low[:] = np.inf
    wide[:] = -np.inf
    for f in range(count):
        shown[f] = _image(vertices, tree, first + f, axes, middle, radius_m, far, way, images[f])
        top[first + f] = images[f, 4]
        if shown[f]:
            for side in range(2):
                low[side], wide[side] = min(low[side], images[f, side]), max(wide[side], images[f, 2 + side])
    for side in range(2):
        wide[side] = cells * (1.0 - 1e-9) / max(wide[side] - low[side], 1e-9)
    start[:] = 0
    # Count the entries of each cell, then place them.
    for turn in range(2):
        for f in range(count):
            if not shown[f]:
                continue
            i0, i1 = int((images[f, 0] - low[0]) * wide[0]), int((images[f, 2] - low[0]) * wide[0])
            j0, j1 = int((images[f, 1] - low[1]) * wide[1]), int((images[f, 3] - low[1]) * wide[1])
            for i in range(max(i0, 0), min(i1, cells - 1) + 1):
                for j in range(max(j0, 0), min(j1, cells - 1) + 1):
                    k = i * cells + j
                    if turn == 0:
                        start[k + 1] += 1
                    else:
                        pool[start[k]] = first + f
                        start[k] += 1
        if turn == 0:
            for k in range(cells * cells):
                start[k + 1] += start[k]
            if start[cells * cells] > len(pool):
                return False
    for k in range(cells * cells, 0, -1):
        start[k] = start[k - 1]
    start[0] = 0
    return True


@LEAN
def _fill(vertices, tree, p, grid, images, shown):
    """Fill every grid of part p."""
    for k in range(len(grid.way)):
        if grid.way[k] >= 0.0 and not _filled(
            vertices, tree, p, grid.axes[k], grid.middle, grid.radius_m, grid.far[k], grid.way[k], images, shown,
            grid.low[k], grid.wide[k], grid.cells, grid.start[k], grid.pool[k],
            grid.top[k],
        ):  # fmt: skip
            grid.way[k] = -1.0


@INLINED
def height_of(grid, k, x, y, z):
    """How far a place stands from the plane of grid k toward the station (m)."""
    axes, middle = grid.axes[k], grid.middle
    return (x - middle[0]) * axes[0, 0] + (y - middle[1]) * axes[0, 1] + (z - middle[2]) * axes[0, 2]


@INLINED
def in_cell(tree, grid, k, cell, x, y, z, u, v, w):
    """A triangle in a cell of grid k that the ray from x, y, z along u, v, w meets, -1 without one."""
    # Rays go toward the station. What reaches less far than their start is behind them; the room is for rounding.
    height = height_of(grid, k, x, y, z) - 1e-9
    for at in range(grid.start[k, cell], grid.start[k, cell + 1]):
        f = grid.pool[k, at]
        if grid.top[k, f] >= height and hit(tree, f, x, y, z, u, v, w):
            return f
    return -1


@INLINED
def cell_of(grid, k, x, y, z, u, v, w):
    """The cell of grid k that a ray from x, y, z along u, v, w crosses; -1 where it meets nothing, -2 for no answer."""
    axes, cells = grid.axes[k], grid.cells
    ahead = u * axes[0, 0] + v * axes[0, 1] + w * axes[0, 2]
    if grid.way[k] < 0.0 or ahead < 0.5 * grid.far[k]:
        return -2
    a, b, c = x - grid.middle[0], y - grid.middle[1], z - grid.middle[2]
    share = (a * axes[0, 0] + b * axes[0, 1] + c * axes[0, 2]) / ahead
    a, b, c = a - share * u, b - share * v, c - share * w
    right, up = a * axes[1, 0] + b * axes[1, 1] + c * axes[1, 2], a * axes[2, 0] + b * axes[2, 1] + c * axes[2, 2]
    if right * right + up * up >= 4.0 * grid.radius_m * grid.radius_m:
        return -1
    i, j = (right - grid.low[k, 0]) * grid.wide[k, 0], (up - grid.low[k, 1]) * grid.wide[k, 1]
    if i < 0.0 or j < 0.0 or i >= cells or j >= cells:
        return -1
    return int(i) * cells + int(j)


@LEAN
def farthest(places, middles, symbols, out):
    """Fill out (B,) with the largest distance (m) of places (N, 3) m from middles (B, 3), `symbols` places a middle."""
    for m in range(len(out)):
        out[m] = 0.0
        for n in range(m * symbols, min((m + 1) * symbols, len(places))):
            x, y, z = places[n, 0] - middles[m, 0], places[n, 1] - middles[m, 1], places[n, 2] - middles[m, 2]
            out[m] = max(out[m], math.sqrt(x * x + y * y + z * z))


def grids(station: np.ndarray, vertices: np.ndarray, tree: Tree, part: int) -> RayGrid:
    """Return the grids of a part; station (N, 3) m, in the part's frame; vertices (V, 3) m."""
    faces = int(tree.count[part])
    cells = int(np.clip(math.isqrt(faces), *SIDES))
    middle, radius_m = tree.centre[tree.root[part]].copy(), float(tree.radius_m[tree.root[part]])
    away, whole, reach = station - middle, len(station), np.empty(1)
    # As few grids as widen images by about half a cell at most.
    central = away[whole // 2]
    farthest(away, central[None], whole, reach)
    moved = reach[0] / math.sqrt((central * central).sum())
    symbols = SYMBOLS * math.ceil(whole / max(1.0, math.ceil(moved * cells)) / SYMBOLS)
    starts = range(0, whole, symbols)
    ends = np.array([away[(first + min(first + symbols, whole)) // 2] for first in starts])
    count, way, far = len(ends), np.empty(len(ends)), np.sqrt((ends * ends).sum(axis=1))
    farthest(away, ends, symbols, way)
    axes = np.empty((count, 3, 3))
    for k, ahead in enumerate(ends):
        right = cross(ahead, np.eye(3)[abs(ahead).argmin()])
        right /= math.sqrt((right * right).sum())
        axes[k] = ahead / far[k], right, cross(ahead / far[k], right)
    way[far < NEAREST * (radius_m + way)] = -1.0
    grid = RayGrid(
        axes, middle, radius_m, far, way, np.empty((count, 2)), np.empty((count, 2)), cells, symbols,
        np.empty((count, cells * cells + 1), np.int64), np.empty((count, ROOM * faces + cells * cells), np.int64),
        np.empty((count, len(tree.owner))),
    )  # fmt: skip
    _fill(vertices, tree, part, grid, np.empty((faces, 5)), np.empty(faces, np.bool_))
    return grid
