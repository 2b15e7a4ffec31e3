"""Which points of a target a station cannot see: exact ray casting in the frames of the target's own parts.

In a part's frame its triangles stand still, and the ray from a point to the station turns slowly, or along the same
circle turn by turn. The rays of all points that meet the body, whose frame turns slowly, find their few triangles in a
grid (`ray_grid`), and its own points are judged for many symbols at once (`still_rays`). Points of parts that turn,
swing or roll are held against their own part in the order of its azimuths (`turning_rays`). Where neither can be done,
directions are sorted into cells: the triangles of its own part that any ray of a cell can meet are found once for a
point, by a tree of balls (`surface_tree`), and kept. Rotors turn too far from symbol to symbol for that. All other
triangles are found by the tree ray by ray. A point is compared first with the triangle that hid it a symbol ago.
"""

import numpy as np

from lowalt.echo import Rigid
from lowalt.effects.channel import moving_rays, ray_grid, turning_rays
from lowalt.effects.channel.ray_grid import SYMBOLS, RayGrid
from lowalt.effects.channel.ray_lists import Lists
from lowalt.effects.channel.still_rays import judged
from lowalt.effects.channel.surface_tree import Tree

STEPS, FINEST, COARSEST = 3.0, 0.02, 0.15
"""Cells of direction along a part's way through them, and their least and largest size (rad)."""
SLOW = 8e-3
"""Largest mean turn of the direction to the station, from symbol to symbol (rad), at which a part gets a grid."""


def cast_rays(
    place_m: np.ndarray, motion: Rigid, toward: np.ndarray, vertices: np.ndarray, tree: Tree, rotors: list[int],
    asked: np.ndarray | None = None, known: np.ndarray | None = None, axes: np.ndarray | None = None,
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
    away = place_m - translation
    # The poses' matrices are rotations: their inverses are their transposes.
    station = sum((rotation[:, :, row, :] * away[:, :, row, None] for row in range(3)), np.zeros(away.shape))
    ahead = station / np.sqrt((station * station).sum(axis=2))[..., None]
    turned = np.sqrt((np.ptp(ahead, axis=0) ** 2).sum(axis=1))
    cells = np.ceil(2.0 / np.clip(turned / STEPS, FINEST, COARSEST)).astype(np.int64)
    order = np.flatnonzero(tree.root >= 0)
    order = order if asked is None else order[np.isin(order, asked)]
    listed = ~np.isin(np.arange(len(tree.root)), rotors)
    gridded, grid = _grid(ahead, station, vertices, tree, order[listed[order]])
    found = np.zeros((len(rotation), len(points)), np.bool_) if known is None else known.copy()
    turning = [int(p) for p in order if p != gridded and axes is not None and np.isfinite(axes[p]).all()]
    done = turning_rays.cast(station, axes, turning, points, part, toward, tree, found)
    own = np.ascontiguousarray(station[:, gridded])
    settled = judged(vertices, tree, gridded, grid, own, points, part, toward, found) | done
    parts = len(listed)
    poses = np.empty((parts, 15, len(rotation)))
    poses[:, :9] = rotation.reshape(-1, parts, 9).transpose(1, 2, 0)
    poses[:, 9:12], poses[:, 12:] = translation.transpose(1, 2, 0), station.transpose(1, 2, 0)
    work = [np.empty(shape) for shape in ((parts, 3, SYMBOLS), (7, SYMBOLS), (6, SYMBOLS), SYMBOLS, SYMBOLS)]
    moving_rays.cast(
        np.asarray(place_m, np.float64), poses, part, points, toward, vertices, tree, order, gridded, grid, listed,
        cells, Lists.empty(len(tree.skip)), np.full((len(points), parts), -1), *work, settled, found,
    )  # fmt: skip
    return found


def _grid(
    ahead: np.ndarray, station: np.ndarray, vertices: np.ndarray, tree: Tree, parts: np.ndarray
) -> tuple[int, RayGrid]:
    """The part of `parts` that gets a grid, and the grid: the one of most triangles that turns slowly; -1 for none.

    ahead (N, P, 3): directions to the station in each part's frame.
    """
    steps = np.sqrt((np.diff(ahead, axis=0) ** 2).sum(axis=2))
    slow = [int(p) for p in parts if len(steps) and steps[:, p].mean() <= SLOW]
    if not slow:
        return -1, ray_grid.NONE
    p = max(slow, key=lambda one: int(tree.count[one]))
    return p, ray_grid.grids(np.ascontiguousarray(station[:, p]), vertices, tree, p)
