"""The compiled loops of `rays`: the rays of one point in many symbols, traced together.

They traverse a part's tree of boxes.

A bundle is the rays of one point in STRIP symbols. Boxes that none of its rays can meet are
skipped; leaves and triangles are tested against all its rays at once, in vector instructions.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.machine.jit import INNER_ORDERED, ORDERED

STRIP = 16
"""Symbols in a bundle of rays."""
ROOM_M = 1e-9
"""Margin of boxes for rounding (m)."""
SHORTEST = 1e-30
"""Least size of a way's coordinate that divides (m)."""
FLAT = 1e-12
"""Squared sine of the angle between a ray and a bone, below which they count as parallel."""


class Work(NamedTuple):
    """Work arrays of `cast`.

    poses: (strips, 15, STRIP), filled by `_relative`; ray: (9, STRIP) and bundle: (12,), filled by
    `_sent`; free: (STRIP,), 1 for rays that meet nothing.
    """

    poses: np.ndarray
    ray: np.ndarray
    bundle: np.ndarray
    free: np.ndarray


@INNER_ORDERED
def _relative(rotation, translation, place, symbols, pair, pose):
    """Fill pose (15, STRIP) for some symbols.

    They are turn and shift of part q as part p sees it, and the station there.
    """
    p, q = pair
    for k in range(STRIP):
        turn_p = rotation[symbols[k], p]
        turn_q = rotation[symbols[k], q]
        from_p = translation[symbols[k], p]
        from_q = translation[symbols[k], q]
        # A pose's matrix is a rotation: its inverse is its transpose.
        for i in range(3):
            a = turn_p[0, i]
            b = turn_p[1, i]
            c = turn_p[2, i]
            for j in range(3):
                pose[3 * i + j, k] = a * turn_q[0, j] + b * turn_q[1, j] + c * turn_q[2, j]
            pose[9 + i, k] = (
                a * (from_q[0] - from_p[0])
                + b * (from_q[1] - from_p[1])
                + c * (from_q[2] - from_p[2])
            )
            pose[12 + i, k] = (
                a * (place[0] - from_p[0]) + b * (place[1] - from_p[1]) + c * (place[2] - from_p[2])
            )


@INNER_ORDERED
def _span(values):
    """Return the middle of values and their largest distance from it, with the margin."""
    low = np.inf
    high = -np.inf
    for k in range(STRIP):
        low = min(low, values[k])
        high = max(high, values[k])
    return 0.5 * (low + high), 0.5 * (high - low) + ROOM_M


@INNER_ORDERED
def _sent(pose, point, toward, ray, bundle):
    """Fill ray (9, STRIP) and bundle (12,) of one point.

    The ray holds starts, ways to the station and their inverses; the bundle boxes around them.
    """
    for i in range(3):
        r0 = pose[3 * i]
        r1 = pose[3 * i + 1]
        r2 = pose[3 * i + 2]
        t = pose[9 + i]
        s = pose[12 + i]
        start = ray[i]
        way = ray[3 + i]
        over = ray[6 + i]
        for k in range(STRIP):
            at = r0[k] * point[0] + r1[k] * point[1] + r2[k] * point[2] + t[k]
            start[k] = at + toward * (s[k] - at)
            way[k] = s[k] - start[k]
            divisor = way[k]
            if abs(divisor) <= SHORTEST:
                divisor = SHORTEST
            over[k] = 1.0 / divisor
        bundle[i], bundle[6 + i] = _span(start)
        bundle[3 + i], bundle[9 + i] = _span(way)


@INNER_ORDERED
def can_meet(bundle, box):
    """Whether any ray of a bundle can meet a box (6,), its low and high corner.

    Then no axis across or along it separates them.

    Source: separating axes, Gottschalk, Lin & Manocha, OBBTree, SIGGRAPH 1996, widened by the
    spread of the rays.
    """
    u = bundle[3]
    v = bundle[4]
    w = bundle[5]
    f = bundle[9]
    g = bundle[10]
    h = bundle[11]
    i = 0.5 * (box[3] - box[0])
    j = 0.5 * (box[4] - box[1])
    k = 0.5 * (box[5] - box[2])
    a = box[0] + i - bundle[0]
    b = box[1] + j - bundle[1]
    c = box[2] + k - bundle[2]
    i = i + bundle[6]
    j = j + bundle[7]
    k = k + bundle[8]
    p = abs(u) + f
    q = abs(v) + g
    r = abs(w) + h
    x = abs(a)
    y = abs(b)
    z = abs(c)
    return (
        abs(b * w - c * v) <= j * r + k * q + y * h + z * g
        and abs(c * u - a * w) <= k * p + i * r + z * f + x * h
        and abs(a * v - b * u) <= i * q + j * p + x * g + y * f
        and a * u + b * v + c * w >= -(i * p + j * q + k * r + x * f + y * g + z * h)
    )


@INNER_ORDERED
def _meets(ray, free, box):
    """Whether a free ray meets a box (6,) between its start and the station.

    A ray meets it where it is in all three slabs at once.
    """
    x = ray[0]
    y = ray[1]
    z = ray[2]
    u = ray[6]
    v = ray[7]
    w = ray[8]
    a = box[0]
    b = box[1]
    c = box[2]
    d = box[3]
    e = box[4]
    f = box[5]
    most = 0.0
    for k in range(STRIP):
        a0 = (a - x[k]) * u[k]
        a1 = (d - x[k]) * u[k]
        b0 = (b - y[k]) * v[k]
        b1 = (e - y[k]) * v[k]
        c0 = (c - z[k]) * w[k]
        c1 = (f - z[k]) * w[k]
        enters = max(max(min(a0, a1), min(b0, b1)), max(min(c0, c1), 0.0))
        leaves = min(min(max(a0, a1), max(b0, b1)), min(max(c0, c1), 1.0))
        met = free[k] if enters <= leaves else 0.0
        most = max(most, met)
    return most > 0.0


@INNER_ORDERED
def _shadow(triangle, closed, ray, free):
    """Set free (STRIP,) to 0 where rays meet a triangle (9,), a corner and both edges.

    Source: Moeller & Trumbore 1997.

    Of a closed surface with outward normals, only faces turned to the station hide anything.
    """
    a0 = triangle[0]
    a1 = triangle[1]
    a2 = triangle[2]
    d0 = triangle[3]
    d1 = triangle[4]
    d2 = triangle[5]
    e0 = triangle[6]
    e1 = triangle[7]
    e2 = triangle[8]
    largest = np.inf
    if closed:
        largest = 0.0
    x = ray[0]
    y = ray[1]
    z = ray[2]
    us = ray[3]
    vs = ray[4]
    ws = ray[5]
    for k in range(STRIP):
        u = us[k]
        v = vs[k]
        w = ws[k]
        o0 = x[k] - a0
        o1 = y[k] - a1
        o2 = z[k] - a2
        h0 = v * e2 - w * e1
        h1 = w * e0 - u * e2
        h2 = u * e1 - v * e0
        q0 = o1 * d2 - o2 * d1
        q1 = o2 * d0 - o0 * d2
        q2 = o0 * d1 - o1 * d0
        turned = d0 * h0 + d1 * h1 + d2 * h2
        sign = 1.0 if turned > 0.0 else -1.0
        whole = sign * turned
        first = sign * (o0 * h0 + o1 * h1 + o2 * h2)
        second = sign * (u * q0 + v * q1 + w * q2)
        way = sign * (e0 * q0 + e1 * q1 + e2 * q2)
        # A ray in the triangle's plane has turned = 0, and then `way` is not between 0 and it.
        met = (turned <= largest) & (first >= 0.0) & (second >= 0.0) & (first + second <= whole)
        free[k] = 0.0 if met & (way > 0.0) & (way < whole) else free[k]


@INNER_ORDERED
def _left(triangles, first, count, closed, ray, free):
    """Test rays against `count` triangles (`_shadow`); return whether any ray is still free."""
    for f in range(first, first + count):
        _shadow(triangles[f], closed, ray, free)
    most = 0.0
    for k in range(STRIP):
        most = max(most, free[k])
    return most > 0.0


@INNER_ORDERED
def _walk(boxes, triangles, closed, ray, bundle, free, last):
    """Set free (STRIP,) to 0 where rays meet a part's triangles.

    Returns the leaf that hid the last one, 0 for none.

    boxes (2 B, 6): node k holds nodes 2 k and 2 k + 1, the root is node 1, and nodes from B on are
    the leaves, whose triangles (F, 9) follow each other. last: the leaf to begin with, 0 for none.
    """
    leaves = len(boxes) // 2
    size = len(triangles) // leaves
    node = 1
    if last > 0 and not _left(triangles, (last - leaves) * size, size, closed, ray, free):
        return last
    while True:
        if can_meet(bundle, boxes[node]):
            if node < leaves:
                node *= 2
                continue
            if _meets(ray, free, boxes[node]) and not _left(
                triangles, (node - leaves) * size, size, closed, ray, free
            ):
                return node
        # The next node that is not inside this one.
        node += 1
        while node % 2 == 0:
            node //= 2
        if node == 1:
            return 0


@ORDERED
def cast(tree, motion, place, order, pair, toward, work, hidden):
    """Set hidden (L, N) where triangles of part p stand between points of part q and the station.

    place: (3,), the station's position.

    tree: `rays.Tree` of p; motion: as in `rays.hidden_by`; order (strips, STRIP): symbols of each
    bundle, where one may come twice; pair: (p, q); toward (L,): as in `rays.hidden_by`.
    """
    boxes, triangles, closed = tree
    rotation, translation, points, part = motion
    poses, ray, bundle, free = work
    for strip in range(len(order)):
        _relative(rotation, translation, place, order[strip], pair, poses[strip])
    for l in range(len(points)):  # noqa: E741
        if part[l] != pair[1]:
            continue
        last = 0
        for strip in range(len(order)):
            symbols = order[strip]
            left = 0.0
            for k in range(STRIP):
                free[k] = 0.0 if hidden[l, symbols[k]] else 1.0
                left += free[k]
            if left == 0.0:
                continue
            _sent(poses[strip], points[l], toward[l], ray, bundle)
            last = _walk(boxes, triangles, closed, ray, bundle, free, last)
            for k in range(STRIP):
                hidden[l, symbols[k]] = free[k] == 0.0


@INNER_ORDERED
def _capsule(node, first, second, place, square, hidden):
    """Set hidden (N,) where rays come within a capsule round a bone, a + t e.

    The rays p + s d, s > 0, begin at nodes (3, N).

    first, second (3, N): the bone's ends; square (m^2): of its radius. A node inside the capsule is
    not hidden by it.
    """
    p0 = node[0]
    p1 = node[1]
    p2 = node[2]
    a0 = first[0]
    a1 = first[1]
    a2 = first[2]
    for n in range(np.uint64(len(hidden))):
        d0 = place[0] - p0[n]
        d1 = place[1] - p1[n]
        d2 = place[2] - p2[n]
        length = math.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        d0 = d0 / length
        d1 = d1 / length
        d2 = d2 / length
        e0 = second[0, n] - a0[n]
        e1 = second[1, n] - a1[n]
        e2 = second[2, n] - a2[n]
        w0 = a0[n] - p0[n]
        w1 = a1[n] - p1[n]
        w2 = a2[n] - p2[n]
        ee = e0 * e0 + e1 * e1 + e2 * e2
        ww = w0 * w0 + w1 * w1 + w2 * w2
        de = d0 * e0 + d1 * e1 + d2 * e2
        dw = d0 * w0 + d1 * w1 + d2 * w2
        ew = e0 * w0 + e1 * w1 + e2 * w2
        near = min(max(-ew / ee, 0.0), 1.0) if ee > 0.0 else 0.0
        inside = ww + near * (2.0 * ew + near * ee) <= square
        # With the best s for each t the distance is a convex function of t, so the best t is its
        # minimum or an end.
        across = ee - de * de
        t = min(max((de * dw - ew) / across, 0.0), 1.0) if across > FLAT * ee else near
        s = dw + t * de
        away = ww + t * (2.0 * ew + t * ee) - s * s
        hidden[n] |= (s > 0.0) & (not inside) & (away <= square)


@ORDERED
def capsules(place, nodes, bones, radius_m, hidden):
    """Set hidden (L, N) where a capsule round a bone stands between a node and the station.

    nodes: (L, 3, N) m.

    bones (B, 2): nodes at the ends of each; radius_m (B,). A node stands for the skin around it: a
    capsule hides neither nodes inside it nor the ends of its bone.
    """
    for l in range(len(nodes)):  # noqa: E741
        for b in range(len(bones)):
            first = bones[b, 0]
            second = bones[b, 1]
            if l not in (first, second):
                square = radius_m[b] * radius_m[b]
                _capsule(nodes[l], nodes[first], nodes[second], place, square, hidden[l])
