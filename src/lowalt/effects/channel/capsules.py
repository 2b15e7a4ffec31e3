"""Which nodes of a recording a station cannot see: rays against capsules along the bones."""

import math

import numpy as np

from lowalt.common.jit import INNER, LEAN

STRIP = 128
"""Symbols that pass through the loops together: what a node and a bone need of them stays in the nearest cache."""
FLAT = 1e-12
"""Squared sine of the angle between a ray and a bone, below which they count as parallel."""


@INNER
def _along_bones(nodes, bones, first, size, along):
    """Fill along (B, 7, STRIP): each bone's first end, the way to its other end and that way's square."""
    for b in range(len(bones)):
        one, other, row = bones[b, 0], bones[b, 1], along[b]
        for n in range(size):
            total = 0.0
            for i in range(3):
                a = nodes[first + n, one, i]
                e = nodes[first + n, other, i] - a
                row[i, n], row[3 + i, n] = a, e
                total += e * e
            row[6, n] = total


@INNER
def _toward(place, nodes, first, size, l, ray):  # noqa: E741
    """Fill ray (6, STRIP) with the places of node l and its directions to the station."""
    for n in range(size):
        p = nodes[first + n, l]
        x, y, z = place[0] - p[0], place[1] - p[1], place[2] - p[2]
        length = math.sqrt(x * x + y * y + z * z)
        ray[0, n], ray[1, n], ray[2, n] = p[0], p[1], p[2]
        ray[3, n], ray[4, n], ray[5, n] = x / length, y / length, z / length


@INNER
def _stands_between(ray, bone, square, size, free):
    """Set free (STRIP,) to 0 where a capsule is met: the ray p + s d, s >= 0, comes near the segment a + t e, not p.

    square: m^2 of the capsule's radius. Selections in place of branches, so that symbols pass in vector instructions.
    """
    p0, p1, p2, d0, d1, d2 = ray[0], ray[1], ray[2], ray[3], ray[4], ray[5]
    a0, a1, a2, e0, e1, e2, length = bone[0], bone[1], bone[2], bone[3], bone[4], bone[5], bone[6]
    for n in range(np.uint64(size)):
        w0, w1, w2 = a0[n] - p0[n], a1[n] - p1[n], a2[n] - p2[n]
        ee = length[n]
        de = d0[n] * e0[n] + d1[n] * e1[n] + d2[n] * e2[n]
        dw = d0[n] * w0 + d1[n] * w1 + d2[n] * w2
        ew = e0[n] * w0 + e1[n] * w1 + e2[n] * w2
        ww = w0 * w0 + w1 * w1 + w2 * w2
        near = -ew / ee
        near = near if near > 0.0 else 0.0
        near = near if near < 1.0 else 1.0
        near = near if ee > 0.0 else 0.0
        own = ww + near * (2.0 * ew + near * ee)
        # With the best s for each t the distance is a convex function of t, so the best t is its minimum or an end.
        cross = ee - de * de
        t = (de * dw - ew) / cross
        t = t if t > 0.0 else 0.0
        t = t if t < 1.0 else 1.0
        t = t if cross > FLAT * ee else near
        s = dw + t * de
        away = ww + t * (2.0 * ew + t * ee) - s * s
        blocked = (s > 0.0) & (own > square) & (away <= square)
        free[n] = 0.0 if blocked else free[n]


@LEAN
def _cast(place, nodes, bones, radius_m, ray, along, free, hidden):
    """Do the work of `capsules`; ray (6, STRIP), along (B, 7, STRIP) and free (STRIP,) are work."""
    for first in range(0, nodes.shape[0], STRIP):
        size = min(STRIP, nodes.shape[0] - first)
        _along_bones(nodes, bones, first, size, along)
        for l in range(nodes.shape[1]):  # noqa: E741
            _toward(place, nodes, first, size, l, ray)
            free[:] = 1.0
            for b in range(len(bones)):
                if bones[b, 0] != l and bones[b, 1] != l:
                    _stands_between(ray, along[b], radius_m[b] * radius_m[b], size, free)
            for n in range(size):
                if free[n] == 0.0:
                    hidden[first + n, l] = True


def capsules(
    place_m: np.ndarray, nodes: np.ndarray, bones: np.ndarray, radius_m: np.ndarray, hidden: np.ndarray
) -> None:
    """Set hidden (N, L) where a capsule round a bone stands between a node (N, L, 3) m and the station at place_m (3,).

    bones (B, 2): nodes at the ends of each; radius_m (B,). A node stands for the skin round it: a capsule does not hide
    the nodes that lie in it or end its bone.
    """
    work = np.empty((6, STRIP)), np.empty((len(bones), 7, STRIP)), np.empty(STRIP)
    _cast(place_m, nodes, bones, radius_m, *work, hidden)
