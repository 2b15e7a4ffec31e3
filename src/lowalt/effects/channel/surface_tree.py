"""A target's triangles in groups of groups, each inside a ball, so that whole groups can be passed over at once.

Triangles of a part are sorted along a space-filling curve; FAN of them that follow each other are a node, FAN nodes the
next, up to one node a part. Nodes stand in depth-first order: a node's contents follow it, and `skip` is the first node
after them. Source: Morton, A Computer Oriented Geodetic Data Base, IBM 1966, for the curve.
"""

from typing import NamedTuple

import numpy as np

from lowalt.common.jit import kernel
from lowalt.effects.kept_by_arrays import KeptByArrays

LOOPS = kernel(error_model="numpy")

FAN = 4
BITS = 10
"""Bits of each coordinate on the curve."""


class Tree(NamedTuple):
    """Triangles and their nodes (K,).

    faces (F, 3): corners, in the tree's order; closed (F,): whether each is of a closed surface; centre (K, 3) m and
    radius_m (K,) of the balls, in their parts' frames; skip (K,): next node after a node's contents; face (K,): a
    leaf's triangle, -1 for other nodes; root (P,): each part's first node, -1 without triangles; owner (F,): parts;
    half (K, 3) m: half the sides of boxes about the same centres; first, count (P,): each part's triangles; edges
    (F, 9) m: a triangle's first corner, then the ways to its other two, together in memory.
    """

    faces: np.ndarray
    closed: np.ndarray
    centre: np.ndarray
    radius_m: np.ndarray
    skip: np.ndarray
    face: np.ndarray
    root: np.ndarray
    owner: np.ndarray
    half: np.ndarray
    first: np.ndarray
    count: np.ndarray
    edges: np.ndarray


def curve(place: np.ndarray) -> np.ndarray:
    """Return the place (K,) int64 on a space-filling curve of positions (K, 3) that run from 0 to 1 in each axis."""
    whole = np.minimum((place * 2**BITS).astype(np.int64), 2**BITS - 1)
    result = np.zeros(len(place), np.int64)
    for bit in range(BITS):
        for axis in range(3):
            result |= ((whole[:, axis] >> bit) & 1) << (3 * bit + axis)
    return result


@LOOPS
def fill(low, high, begin, end, node, centre, half, radius_m, skip, face):
    """Fill the nodes of one part, from `node` on, with triangles begin to end - 1; return the next free node.

    low, high: (F, 3) m, the triangles' boxes.
    """
    leaves = end - begin
    height, span = 0, 1
    while span < leaves:
        height, span = height + 1, span * FAN
    # Nodes that begin with each leaf, the widest first.
    start = np.empty(leaves + 1, np.int64)
    start[0] = node
    for leaf in range(leaves):
        wide, count = FAN, 1
        while count <= height and leaf % wide == 0:
            wide, count = wide * FAN, count + 1
        start[leaf + 1] = start[leaf] + count
    for leaf in range(leaves):
        wide = 1
        for at in range(start[leaf + 1] - 1, start[leaf] - 1, -1):
            square = 0.0
            for i in range(3):
                least, most = np.inf, -np.inf
                for f in range(begin + leaf, min(begin + leaf + wide, end)):
                    least, most = min(least, low[f, i]), max(most, high[f, i])
                centre[at, i] = 0.5 * (least + most)
                half[at, i] = 0.5 * (most - least) * (1.0 + 1e-6) + 1e-9
                square += 0.25 * (most - least) ** 2
            # A little room for rounding where rays are compared with the ball, as with the box.
            radius_m[at] = np.sqrt(square) * (1.0 + 1e-6) + 1e-9
            skip[at] = start[min(leaf + wide, leaves)]
            face[at] = begin + leaf if wide == 1 else -1
            wide *= FAN
    return start[leaves]


_TREES = KeptByArrays()
"""Trees of all triangles of a target."""


def whole_tree(surfaces: dict) -> Tree:
    """Return the tree of all triangles of a target's surfaces, made once as long as their arrays live."""
    arrays = [surfaces[name] for name in ("vertices", "vertex_part", "faces", "closed")]
    return _TREES.of(arrays, lambda: tree(surfaces, surfaces["faces"]))


def tree(surfaces: dict, faces: np.ndarray) -> Tree:
    """Return the tree of triangles `faces` (F, 3) of a target's surfaces (`lowalt.targets.occluders`)."""
    closed, owner = surfaces["closed"], np.asarray(surfaces["vertex_part"], np.int64)[faces[:, 0]]
    corners = np.asarray(surfaces["vertices"], np.float64)[faces]
    low, high = corners.min(axis=1), corners.max(axis=1)
    edges = np.concatenate([corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]], axis=1)
    place = np.zeros(low.shape)
    for part in np.unique(owner):
        mine = owner == part
        middle = 0.5 * (low[mine] + high[mine])
        place[mine] = (middle - middle.min(axis=0)) / max(float(np.ptp(middle, axis=0).max()), 1e-300)
    order = np.argsort((owner << (3 * BITS)) | curve(place), kind="stable")
    faces, owner, low, high = np.ascontiguousarray(faces[order], np.int64), owner[order], low[order], high[order]
    room = 2 * len(faces) + len(closed)
    centre, radius_m, half = np.empty((room, 3)), np.empty(room), np.empty((room, 3))
    skip, face, root = np.empty(room, np.int64), np.empty(room, np.int64), np.full(len(closed), -1)
    node = 0
    for part in np.unique(owner):
        begin, end = np.searchsorted(owner, [part, part + 1])
        root[part] = node
        node = fill(low, high, begin, end, node, centre, half, radius_m, skip, face)
    sides = np.asarray(closed, np.bool_)[owner]
    first = np.searchsorted(owner, np.arange(len(closed)))
    count = np.bincount(owner, minlength=len(closed))
    return Tree(
        faces, sides, centre[:node], radius_m[:node], skip[:node], face[:node], root, owner, half[:node], first, count,
        np.ascontiguousarray(edges[order]),
    )  # fmt: skip
