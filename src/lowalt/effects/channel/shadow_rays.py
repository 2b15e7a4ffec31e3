"""Which points of a target a station cannot see: exact ray casting in the frames of the target's own parts.

In a part's frame its triangles stand still, and the ray from a point to the station turns slowly, or along the same
circle turn by turn. The rays of all points that meet the body, whose frame turns slowly, find their few triangles in a
grid (`ray_grid`), and its own points are judged for many symbols at once (`still_rays`). Points of parts that turn,
swing or roll are held against their own part in the order of its azimuths (`turning_rays`). Where neither can be done,
directions are sorted into cells: the triangles of its own part that any ray of a cell can meet are found once for a
point, by a tree of balls (`surface_tree`), and kept. Rotors turn too far from symbol to symbol for that. All other
triangles are found by the tree ray by ray. A point is compared first with the triangle that hid it a symbol ago.
"""

import math
from collections.abc import Collection

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.echo import Rigid
from lowalt.effects.channel import moving_rays, ray_grid, turning_rays
from lowalt.effects.channel.ray_grid import SYMBOLS
from lowalt.effects.channel.ray_lists import Lists
from lowalt.effects.channel.still_rays import judged
from lowalt.effects.channel.surface_tree import Tree

STEPS, FINEST, COARSEST = 3.0, 0.02, 0.15
"""Cells of direction along a part's way through them, and their least and largest size (rad)."""
SLOW = 8e-3
"""Largest mean turn of the direction to the station, from symbol to symbol (rad), at which a part gets a grid."""


@LEAN
def _seen_by_parts(place, rotation, translation, poses, station, turned, steps):
    """Fill poses (B, P, 15, SYMBOLS) of `moving_rays.cast`, and where the station is in each part's frame.

    station (P, 3, N) m: its place there; turned (P,): the diagonal of the box that holds all directions to it, as unit
    vectors; steps (P,): their mean way to the next symbol.
    """
    symbols = len(rotation)
    for p in range(len(turned)):
        least0, least1, least2, most0, most1, most2 = np.inf, np.inf, np.inf, -np.inf, -np.inf, -np.inf
        last0, last1, last2, total = 0.0, 0.0, 0.0, 0.0
        for n in range(symbols):
            turn, shift, pose, k = rotation[n, p], translation[n, p], poses[n // SYMBOLS, p], n % SYMBOLS
            a, b, c = place[0] - shift[0], place[1] - shift[1], place[2] - shift[2]
            # The poses' matrices are rotations: their inverses are their transposes.
            x = turn[0, 0] * a + turn[1, 0] * b + turn[2, 0] * c
            y = turn[0, 1] * a + turn[1, 1] * b + turn[2, 1] * c
            z = turn[0, 2] * a + turn[1, 2] * b + turn[2, 2] * c
            for i in range(3):
                for j in range(3):
                    pose[3 * i + j, k] = turn[i, j]
                pose[9 + i, k] = shift[i]
            pose[12, k], pose[13, k], pose[14, k] = x, y, z
            station[p, 0, n], station[p, 1, n], station[p, 2, n] = x, y, z
            far = math.sqrt(x * x + y * y + z * z)
            x, y, z = x / far, y / far, z / far
            least0, least1, least2 = min(least0, x), min(least1, y), min(least2, z)
            most0, most1, most2 = max(most0, x), max(most1, y), max(most2, z)
            if n > 0:
                total += math.sqrt((x - last0) ** 2 + (y - last1) ** 2 + (z - last2) ** 2)
            last0, last1, last2 = x, y, z
        turned[p] = math.sqrt((most0 - least0) ** 2 + (most1 - least1) ** 2 + (most2 - least2) ** 2)
        steps[p] = total / max(symbols - 1, 1)


def cast_rays(
    place_m: np.ndarray, motion: Rigid, toward: np.ndarray, vertices: np.ndarray, tree: Tree, rotors: list[int],
    asked: Collection[int] | None = None, known: np.ndarray | None = None, axes: np.ndarray | None = None,
) -> np.ndarray:  # fmt: skip
    """Return whether a triangle hides each point from the station at `place_m` (3,), (N, L) bool.

    motion: poses, and points off their own surface (L, 3), each in its part's frame (m); toward (L,): share of the way
    to the station by which a point is moved instead, where it has no normal; vertices (V, 3) m; rotors: parts that turn
    far from symbol to symbol; asked: parts whose triangles count, None for all; known: points (N, L) bool that are
    hidden already; axes (P, 3): what turning parts turn about, in their frames, NaN for others. Of a closed surface
    with outward normals, the side turned to the station alone hides all.
    """
    rotation, translation, points, part = motion
    rotation, translation = np.ascontiguousarray(rotation), np.ascontiguousarray(translation)
    points, vertices, part = np.ascontiguousarray(points), np.ascontiguousarray(vertices), np.asarray(part, np.int64)
    place, parts = np.asarray(place_m, np.float64), len(tree.root)
    blocks, station = -(-len(rotation) // SYMBOLS), np.empty((parts, 3, len(rotation)))
    poses, turned, steps = np.empty((blocks, parts, 15, SYMBOLS)), np.empty(parts), np.empty(parts)
    _seen_by_parts(place, rotation, translation, poses, station, turned, steps)
    cells = np.ceil(2.0 / np.clip(turned / STEPS, FINEST, COARSEST)).astype(np.int64)
    order = [p for p in range(parts) if tree.root[p] >= 0 and (asked is None or p in asked)]
    slow = [p for p in order if p not in rotors and len(rotation) > 1 and steps[p] <= SLOW]
    # The part of most triangles that turns slowly gets a grid.
    gridded = max(slow, key=lambda one: int(tree.count[one]), default=-1)
    own = np.ascontiguousarray(station[gridded].T)
    grid = ray_grid.grids(own, vertices, tree, gridded) if gridded >= 0 else ray_grid.NONE
    found = np.zeros((len(rotation), len(points)), np.bool_) if known is None else known.copy()
    turns = np.zeros(parts, np.bool_) if axes is None else np.isfinite(axes).all(axis=1)
    turning = [p for p in order if p != gridded and turns[p]]
    done = turning_rays.cast(station, axes, turning, points, part, toward, tree, found)
    settled = judged(vertices, tree, gridded, grid, own, points, part, toward, found) | done
    listed = np.ones(parts, np.bool_)
    listed[rotors] = False
    work = [np.empty(shape) for shape in ((parts, 3, SYMBOLS), (7, SYMBOLS), (6, SYMBOLS), SYMBOLS, SYMBOLS)]
    moving_rays.cast(
        place, poses, part, points, toward, vertices, tree, np.array(order, np.int64), gridded, grid, listed, cells,
        Lists.empty(len(tree.skip)), np.full((len(points), parts), -1), *work, settled, found,
    )  # fmt: skip
    return found
