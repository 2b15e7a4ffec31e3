"""Which points of a target a station cannot see: straight rays against moving triangles.

Rays go from a point to the station, the triangles are the target's.

In a part's own frame its triangles stand still, in a tree of boxes that is made once. The rays of a
point in successive symbols differ little, so they traverse the tree together (`rays_loops`). Seen
from a rotating part, the station circles the part's axis, so symbols are sorted by its azimuth
first.
"""

from collections.abc import Collection
from functools import lru_cache
from itertools import product
from typing import NamedTuple

import numpy as np

from lowalt.echo import Rigid
from lowalt.numerics import portable
from lowalt.scene import rays_loops

LEAF = 4
"""Largest number of triangles in a leaf."""


class Tree(NamedTuple):
    """A part's triangles in a tree of boxes, as `rays_loops` walks it.

    boxes: (2 B, 6); triangles: (F, 9), a corner and both edges; closed: whether the surface is.
    """

    boxes: np.ndarray
    triangles: np.ndarray
    closed: bool


class _Same(NamedTuple):
    """A target's surfaces as a key of the cache: only the same object is equal."""

    surfaces: dict

    def __hash__(self) -> int:
        return id(self.surfaces)

    def __eq__(self, other) -> bool:
        return self.surfaces is other.surfaces


def tree(corners: np.ndarray, closed: bool) -> Tree:
    """Return the tree of triangles with `corners` (F, 3, 3) m.

    Each node is split in halves along its longest side.
    """
    leaves = 1
    while leaves * LEAF < len(corners):
        leaves *= 2
    # Incomplete leaves repeat the last triangle.
    whole = leaves * -(-len(corners) // leaves)
    order = np.minimum(np.arange(whole), len(corners) - 1)[None]
    middles = corners.mean(axis=1)
    while len(order) < leaves:
        held = middles[order]
        side = np.ptp(held, axis=1).argmax(axis=1)[:, None, None]
        along = np.take_along_axis(held, side, axis=2)[..., 0]
        order = np.take_along_axis(order, along.argsort(axis=1), axis=1).reshape(2 * len(order), -1)
    corners = corners[order]
    low = corners.min(axis=(1, 2)) - rays_loops.ROOM_M
    high = corners.max(axis=(1, 2)) + rays_loops.ROOM_M
    boxes = np.empty((2 * leaves, 6))
    # Level by level from the leaves, nodes B to 2 B - 1, up to the root, node 1.
    while leaves:
        boxes[leaves : 2 * leaves, :3] = low
        boxes[leaves : 2 * leaves, 3:] = high
        low = np.minimum(low[::2], low[1::2])
        high = np.maximum(high[::2], high[1::2])
        leaves = leaves // 2
    first, second, third = corners.reshape(-1, 3, 3).swapaxes(0, 1)
    return Tree(boxes, np.concatenate([first, second - first, third - first], axis=1), closed)


@lru_cache(maxsize=64)
def _trees(same: _Same) -> dict[int, Tree]:
    """The tree of each part that has triangles."""
    surfaces = same.surfaces
    corners = np.asarray(surfaces["vertices"], np.float64)[surfaces["faces"]]
    owner = surfaces["vertex_part"][surfaces["faces"][:, 0]]
    return {
        int(part): tree(corners[owner == part], bool(surfaces["closed"][part]))
        for part in np.unique(owner)
    }


def _around(axis: np.ndarray, rotation: np.ndarray, toward: np.ndarray) -> np.ndarray:
    """Return the symbols (N,), sorted by the azimuth of the station around a part's axis (3,).

    toward: (N, 3), direction of the station.
    """
    seen = portable.applied(rotation.swapaxes(1, 2), toward)
    right = np.cross(axis, np.eye(3)[abs(axis).argmin()])
    right /= portable.norm(right)
    along = portable.dot(seen, right)
    across = portable.dot(seen, np.cross(axis, right))
    return portable.arctan2(across, along).argsort(kind="stable")


def hidden_by(
    surfaces: dict,
    place_m: np.ndarray,
    motion: Rigid,
    axes: np.ndarray,
    toward: np.ndarray,
    casts: Collection[int],
    hidden: np.ndarray,
) -> None:
    """Set hidden (N, L) where a triangle stands between a point and the station at place_m (3,).

    casts: the parts whose triangles are asked.

    motion: poses, and points (L, 3) moved off their own surface, in their parts' frames (m); axes
    (P, 3): rotation axes in the parts' frames, NaN for parts that do not rotate; toward (L,): the
    share of the way to the station by which a point without a normal is moved instead. Points that
    are already hidden are skipped. The normals of a closed surface point outward, and only its
    faces turned to the station hide anything.
    """
    rotation, translation, points, part = map(np.ascontiguousarray, motion)
    moved = (rotation, translation, points, part.astype(np.int64))
    strip = rays_loops.STRIP
    turns = np.isfinite(axes).all(axis=1)
    strips = []
    for p in range(len(axes)):
        order = np.arange(len(rotation))
        if turns[p]:
            order = _around(axes[p], rotation[:, p], place_m - translation[:, p])
        # The last strip is padded with its last symbol.
        padded = np.pad(order, (0, -len(order) % strip), "edge")
        strips.append(padded.reshape(-1, strip))
    result = np.ascontiguousarray(hidden.T)
    work = rays_loops.Work(
        poses=np.empty((len(strips[0]), 15, strip)),
        ray=np.empty((9, strip)),
        bundle=np.empty(12),
        free=np.empty(strip),
    )
    trees = {p: held for p, held in _trees(_Same(surfaces)).items() if p in casts}
    # A point's own part, which hides it most often, comes first.
    pairs = sorted(product(trees, range(len(axes))), key=lambda pair: pair[0] != pair[1])
    for p, q in pairs:
        in_strips = strips[p] if turns[p] else strips[q]
        rays_loops.cast(trees[p], moved, place_m, in_strips, (p, q), toward, work, result)
    hidden[:] = result.T


def hidden_by_bones(
    surfaces: dict, place_m: np.ndarray, nodes: np.ndarray, hidden: np.ndarray
) -> None:
    """Set hidden (N, L) where a capsule around a bone stands between a node and the station.

    nodes: (N, L, 3) m.

    place_m: the station's position (3,). A capsule hides neither nodes inside it nor the ends of
    its bone.
    """
    result = np.ascontiguousarray(hidden.T)
    apart = np.ascontiguousarray(nodes.transpose(1, 2, 0))
    rays_loops.capsules(place_m, apart, surfaces["bones"], surfaces["radius_m"], result)
    hidden[:] = result.T
