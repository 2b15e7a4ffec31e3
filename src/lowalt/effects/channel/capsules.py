"""Which nodes of a recording a station cannot see: rays against capsules along the bones."""

import math

import numpy as np

from lowalt.common.jit import kernel

RAYS = kernel(error_model="numpy")


@RAYS
def _square_between(p, d, a, e, flat):
    """Squared distances of the segment a + t e from the point p, and from the ray p + s d, |d| = 1 and s >= 0."""
    w0, w1, w2 = a[0] - p[0], a[1] - p[1], a[2] - p[2]
    ee = e[0] * e[0] + e[1] * e[1] + e[2] * e[2]
    de = d[0] * e[0] + d[1] * e[1] + d[2] * e[2]
    dw = d[0] * w0 + d[1] * w1 + d[2] * w2
    ew = e[0] * w0 + e[1] * w1 + e[2] * w2
    ww = w0 * w0 + w1 * w1 + w2 * w2
    t = min(max(-ew / ee, 0.0), 1.0) if ee > 0.0 else 0.0
    own = ww + t * (2.0 * ew + t * ee)
    # With the best s for each t the distance is a convex function of t, so the best t is its minimum or an end.
    cross = ee - de * de
    t = min(max((de * dw - ew) / cross, 0.0), 1.0) if cross > flat * ee else t
    s = dw + t * de
    if s <= 0.0:
        return own, own
    return own, ww + t * (2.0 * ew + t * ee) - s * s


@RAYS
def capsules(place, nodes, bones, radius, hidden):
    """Set hidden (N, L) where a capsule round a bone stands between a node (N, L, 3) and the station.

    A node stands for the skin round it: a capsule does not hide the nodes that lie in it or end its bone.
    """
    d, e = np.empty(3), np.empty(3)
    for n in range(nodes.shape[0]):
        for l in range(nodes.shape[1]):  # noqa: E741
            p = nodes[n, l]
            length = math.sqrt((place[0] - p[0]) ** 2 + (place[1] - p[1]) ** 2 + (place[2] - p[2]) ** 2)
            for i in range(3):
                d[i] = (place[i] - p[i]) / length
            for b in range(len(bones)):
                if bones[b, 0] == l or bones[b, 1] == l:
                    continue
                a = nodes[n, bones[b, 0]]
                for i in range(3):
                    e[i] = nodes[n, bones[b, 1], i] - a[i]
                own, ray = _square_between(p, d, a, e, 1e-12)
                if own > radius[b] * radius[b] and ray <= radius[b] * radius[b]:
                    hidden[n, l] = True
                    break
