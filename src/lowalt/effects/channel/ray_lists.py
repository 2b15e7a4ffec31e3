"""Lists of a part's triangles that the rays from its own points can meet, kept by point and cell of direction.

Directions are sorted into cells on a cube's faces; what any ray of a cell can meet is found once, by a tree of balls.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.common.jit import INLINED, INNER
from lowalt.effects.channel.ray_tests import first_hit, met, reached

SLOTS = 1 << 14
"""Lists of triangles that are kept at a time; a power of two."""
POOL = 1 << 18
"""Triangles in all kept lists together."""
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


@INNER
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
def kept(vertices, tree, lists, p, point, cells, x, y, z, u, v, w):
    """A triangle of the point's own part p that its ray meets, found in the kept list of its direction; -1 for none."""
    code, a, b, c = _cell(u, v, w, cells)
    key = point * CODES + code
    slot = _slot(lists.key, key)
    if lists.key[slot] == -1:
        slot = _listed(vertices, tree, lists, p, key, slot, x, y, z, a, b, c, 1.4143 / cells)
    first = lists.begin[slot]
    return first_hit(tree, lists.pool, first, first + lists.size[slot], x, y, z, u, v, w)
