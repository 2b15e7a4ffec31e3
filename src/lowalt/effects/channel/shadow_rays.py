"""Which points of a target a station cannot see: exact ray casting in the frames of the target's own parts.

In a part's frame its triangles stand still, and the ray from a point to the station turns slowly, or along the same
circle turn by turn. So directions are sorted into cells: the triangles of its own part that any ray of a cell can meet
are found once for a point, by a tree of balls (`surface_tree`), and kept; each ray is then compared with these few.
Other parts' triangles are found by their tree ray by ray. A point is compared first with the triangle that hid it a
symbol ago.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.common.jit import INLINED, LEAN
from lowalt.echo import Rigid
from lowalt.effects.channel.ray_tests import hit, met, reached
from lowalt.effects.channel.surface_tree import Tree

SLOTS = 1 << 14
"""Lists of triangles that are kept at a time; a power of two."""
POOL = 1 << 18
"""Triangles in all kept lists together."""
STEPS, FINEST, COARSEST = 3.0, 0.02, 0.15
"""Cells of direction along a part's way through them, and their least and largest size (rad)."""
CODES = 1 << 19
"""Larger than the number of any cell of direction."""


class Lists(NamedTuple):
    """Kept lists: key (SLOTS,), -1 where free; begin, size (SLOTS,) in `pool`; used: (2,) lists and triangles."""

    key: np.ndarray
    begin: np.ndarray
    size: np.ndarray
    pool: np.ndarray
    used: np.ndarray

    @classmethod
    def empty(cls, nodes: int) -> "Lists":
        """Return room for the lists, all free, of triangles in a tree of so many nodes."""
        whole = (np.empty(SLOTS, np.int64) for _ in range(2))
        return cls(np.full(SLOTS, -1), *whole, np.empty(POOL + nodes, np.int64), np.zeros(2, np.int64))


@INLINED
def _cell(a, b, c, cells):
    """The cell of a direction on a cube's faces, `cells` along each side, and the direction of its middle."""
    p, q, r = abs(a), abs(b), abs(c)
    side, main, i, j = 0, a, b, c
    if q >= p and q >= r:
        side, main, i, j = 1, b, c, a
    elif r >= p and r >= q:
        side, main, i, j = 2, c, a, b
    length = abs(main)
    step = 2.0 / cells
    m, n = min(int((i / length + 1.0) / step), cells - 1), min(int((j / length + 1.0) / step), cells - 1)
    i, j, main = (m + 0.5) * step - 1.0, (n + 0.5) * step - 1.0, 1.0 if main > 0.0 else -1.0
    a, b, c = (main, i, j) if side == 0 else ((j, main, i) if side == 1 else (i, j, main))
    size = 1.0 / math.sqrt(1.0 + i * i + j * j)
    code = ((2 * side + (main > 0.0)) * cells + m) * cells + n
    return code, a * size, b * size, c * size


@INLINED
def _slot(keys, key):
    """The slot of the list `key`, or a free one where it is not kept."""
    mask = len(keys) - 1
    slot = np.int64(np.uint64(key) * np.uint64(0x9E3779B97F4A7C15) >> np.uint64(40)) & mask
    while keys[slot] != -1 and keys[slot] != key:
        slot = (slot + 1) & mask
    return slot


@LEAN
def _listed(vertices, tree, lists, p, key, slot, x, y, z, a, b, c, spread):
    """Fill the free slot of the list `key` with the triangles of part p that the rays of `met` can meet; return it."""
    mask = len(lists.key) - 1
    end = tree.skip[tree.root[p]]
    # A list has at most the part's triangles; without room for them, all lists are dropped.
    if 2 * lists.used[0] > mask or lists.used[1] + end - tree.root[p] > len(lists.pool):
        lists.key[:] = -1
        lists.used[:] = 0
        slot = _slot(lists.key, key)
    first = lists.used[1]
    past, node = first, tree.root[p]
    while node < end:
        if not met(tree, node, x, y, z, a, b, c, spread):
            node = tree.skip[node]
            continue
        f = tree.face[node]
        if f >= 0 and reached(vertices, tree, f, x, y, z, a, b, c, spread):
            lists.pool[past] = f
            past += 1
        node += 1
    lists.key[slot], lists.begin[slot], lists.size[slot] = key, first, past - first
    lists.used[0] += 1
    lists.used[1] = past
    return slot


@INLINED
def _first_of(vertices, tree, lists, first, past, x, y, z, u, v, w):
    """The first triangle of a list that the ray from x, y, z along u, v, w meets, -1 without one."""
    for at in range(first, past):
        if hit(vertices, tree, lists.pool[at], x, y, z, u, v, w):
            return lists.pool[at]
    return -1


@INLINED
def _through(vertices, tree, p, x, y, z, u, v, w, size):
    """A triangle of part p that the ray from x, y, z along u, v, w meets, -1 without one; size: 1 / its length."""
    node, end = tree.root[p] + 1, tree.skip[tree.root[p]]
    a, b, c = u * size, v * size, w * size
    if tree.face[node - 1] >= 0:
        node -= 1
    while node < end:
        if not met(tree, node, x, y, z, a, b, c, 0.0):
            node = tree.skip[node]
            continue
        f = tree.face[node]
        if f >= 0 and hit(vertices, tree, f, x, y, z, u, v, w):
            return f
        node += 1
    return -1


@LEAN
def cast(station, rotation, translation, part, points, toward, vertices, tree, order, cells, lists, work, found):
    """Set found (N, L) where one of the parts `order` hides the point.

    station (N, P, 3) m, in each part's frame; rotation (N, P, 3, 3), translation (N, P, 3); points (L, 3) m, in their
    part's frame; toward (L,): share of the way to the station by which a point is moved; cells (P,): cells of direction
    along a cube's side; work: (L,) int64, filled with -1.
    """
    for n in range(rotation.shape[0]):
        for l in range(len(points)):  # noqa: E741
            own, f = part[l], work[l]
            x, y, z = points[l, 0], points[l, 1], points[l, 2]
            x += toward[l] * (station[n, own, 0] - x)
            y += toward[l] * (station[n, own, 1] - y)
            z += toward[l] * (station[n, own, 2] - z)
            g0 = rotation[n, own, 0, 0] * x + rotation[n, own, 0, 1] * y + rotation[n, own, 0, 2] * z
            g1 = rotation[n, own, 1, 0] * x + rotation[n, own, 1, 1] * y + rotation[n, own, 1, 2] * z
            g2 = rotation[n, own, 2, 0] * x + rotation[n, own, 2, 1] * y + rotation[n, own, 2, 2] * z
            g0, g1, g2 = g0 + translation[n, own, 0], g1 + translation[n, own, 1], g2 + translation[n, own, 2]
            for turn in range(-1, len(order)):
                if turn < 0 and f < 0:
                    continue
                p = tree.owner[f] if turn < 0 else order[turn]
                i, j, k = x, y, z
                if p != own:
                    t0, t1, t2 = g0 - translation[n, p, 0], g1 - translation[n, p, 1], g2 - translation[n, p, 2]
                    i = rotation[n, p, 0, 0] * t0 + rotation[n, p, 1, 0] * t1 + rotation[n, p, 2, 0] * t2
                    j = rotation[n, p, 0, 1] * t0 + rotation[n, p, 1, 1] * t1 + rotation[n, p, 2, 1] * t2
                    k = rotation[n, p, 0, 2] * t0 + rotation[n, p, 1, 2] * t1 + rotation[n, p, 2, 2] * t2
                u, v, w = station[n, p, 0] - i, station[n, p, 1] - j, station[n, p, 2] - k
                if turn < 0:
                    if hit(vertices, tree, f, i, j, k, u, v, w):
                        found[n, l] = True
                        break
                    continue
                size = 1.0 / math.sqrt(u * u + v * v + w * w)
                if not met(tree, tree.root[p], i, j, k, u * size, v * size, w * size, 0.0):
                    continue
                if p == own:
                    code, a, b, c = _cell(u, v, w, cells[p])
                    key = l * CODES + code
                    slot = _slot(lists.key, key)
                    if lists.key[slot] == -1:
                        slot = _listed(vertices, tree, lists, p, key, slot, i, j, k, a, b, c, 1.4143 / cells[p])
                    first = lists.begin[slot]
                    f = _first_of(vertices, tree, lists, first, first + lists.size[slot], i, j, k, u, v, w)
                else:
                    f = _through(vertices, tree, p, i, j, k, u, v, w, size)
                if f >= 0:
                    found[n, l] = True
                    work[l] = f
                    break


def cast_rays(
    place_m: np.ndarray, motion: Rigid, toward: np.ndarray, vertices: np.ndarray, tree: Tree
) -> np.ndarray:  # fmt: skip
    """Return whether a triangle hides each point from the station at `place_m` (3,), (N, L) bool.

    motion: poses, and points off their own surface (L, 3), each in its part's frame (m); toward (L,): share of the way
    to the station by which a point is moved instead, where it has no normal; vertices (V, 3) m. Of a closed surface
    with outward normals, the side turned to the station alone hides all.
    """
    rotation, translation, points, part = motion
    away = place_m - translation
    # The poses' matrices are rotations: their inverses are their transposes.
    station = sum((rotation[:, :, row, :] * away[:, :, row, None] for row in range(3)), np.zeros(away.shape))
    ahead = station / np.sqrt((station * station).sum(axis=2))[..., None]
    turned = np.sqrt((np.ptp(ahead, axis=0) ** 2).sum(axis=1))
    cells = np.ceil(2.0 / np.clip(turned / STEPS, FINEST, COARSEST)).astype(np.int64)
    found = np.zeros((len(rotation), len(points)), np.bool_)
    cast(
        station, np.ascontiguousarray(rotation), np.ascontiguousarray(translation), np.asarray(part, np.int64),
        np.ascontiguousarray(points), toward, np.ascontiguousarray(vertices), tree, np.flatnonzero(tree.root >= 0),
        cells, Lists.empty(len(tree.skip)), np.full(len(points), -1), found,
    )  # fmt: skip
    return found
