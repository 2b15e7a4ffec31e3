"""Rays from all points against parts that move as seen from them, ray by ray, in strips of symbols.

Most rays pass by the ball and the box around a part's triangles; that is found for all symbols of a strip together, in
vector instructions. The others are held against the triangle that hid the point last, and then against those that the
part's grid (`ray_grid`), its kept lists (`ray_lists`) or its tree of boxes (`surface_tree`) names.
"""

import numpy as np

from lowalt.common.jit import INLINED, INNER, LEAN
from lowalt.effects.channel.ray_grid import SYMBOLS, cell_of, in_cell
from lowalt.effects.channel.ray_lists import kept
from lowalt.effects.channel.ray_tests import crosses, hit


@INLINED
def _through(tree, p, x, y, z, u, v, w):
    """A triangle of part p that the ray from x, y, z along u, v, w meets, -1 without one."""
    node, end = tree.root[p], tree.skip[tree.root[p]]
    while node < end:
        if not crosses(tree, node, x, y, z, u, v, w):
            node = tree.skip[node]
            continue
        f = tree.face[node]
        if f >= 0 and hit(tree, f, x, y, z, u, v, w):
            return f
        node += 1
    return -1


@INNER
def _own(pose, point, toward, size, own):
    """Fill own (6, SYMBOLS) with a point's start and its way to the station in its own part's frame."""
    for i in range(3):
        x, u, s, at = own[i], own[3 + i], pose[12 + i], point[i]
        for n in range(np.uint64(size)):
            x[n] = at + toward * (s[n] - at)
            u[n] = s[n] - x[n]


@INNER
def _started(place, pose, point, toward, size, ray):
    """Fill ray (7, SYMBOLS): a point's start and its way to the station in the global frame, and that way's square."""
    x, y, z = point[0], point[1], point[2]
    square = ray[6]
    for i in range(3):
        r0, r1, r2, t, g, d = pose[3 * i], pose[3 * i + 1], pose[3 * i + 2], pose[9 + i], ray[i], ray[3 + i]
        s0, s1, s2, end = pose[12], pose[13], pose[14], place[i]
        if toward == 0.0:
            for n in range(np.uint64(size)):
                g[n] = r0[n] * x + r1[n] * y + r2[n] * z + t[n]
                d[n] = end - g[n]
        else:
            for n in range(np.uint64(size)):
                a, b, c = x + toward * (s0[n] - x), y + toward * (s1[n] - y), z + toward * (s2[n] - z)
                g[n] = r0[n] * a + r1[n] * b + r2[n] * c + t[n]
                d[n] = end - g[n]
    d0, d1, d2 = ray[3], ray[4], ray[5]
    for n in range(np.uint64(size)):
        square[n] = d0[n] * d0[n] + d1[n] * d1[n] + d2[n] * d2[n]


@INNER
def _ball_ahead(ray, ball, radius_m, size, free, near):
    """Fill near (SYMBOLS,) with 1 where a free ray can meet a ball, else 0; return whether any can.

    ball (3, SYMBOLS): its middle, in the global frame.
    """
    g0, g1, g2, d0, d1, d2, square = ray[0], ray[1], ray[2], ray[3], ray[4], ray[5], ray[6]
    b0, b1, b2 = ball[0], ball[1], ball[2]
    count = 0
    for n in range(np.uint64(size)):
        u, v, w = b0[n] - g0[n], b1[n] - g1[n], b2[n] - g2[n]
        along, rest = u * d0[n] + v * d1[n] + w * d2[n], u * u + v * v + w * w - radius_m * radius_m
        met = (rest <= 0.0) | ((along >= 0.0) & (rest * square[n] <= along * along * (1.0 + 1e-9)))
        near[n] = free[n] if met else 0.0
        count += 1 if near[n] > 0.0 else 0
    return count > 0


@INNER
def _turned(pose, ray, size, own):
    """Fill own (6, SYMBOLS) with the starts and ways of rays of the global frame in a part's frame."""
    g0, g1, g2 = ray[0], ray[1], ray[2]
    t0, t1, t2 = pose[9], pose[10], pose[11]
    for i in range(3):
        r0, r1, r2, s, x, u = pose[i], pose[3 + i], pose[6 + i], pose[12 + i], own[i], own[3 + i]
        for n in range(np.uint64(size)):
            x[n] = r0[n] * (g0[n] - t0[n]) + r1[n] * (g1[n] - t1[n]) + r2[n] * (g2[n] - t2[n])
            u[n] = s[n] - x[n]


@INNER
def _box_ahead(centre, half, own, size, near):
    """Set near (SYMBOLS,) to 0 where a ray cannot meet a box, of a middle and half sides (3,); tell whether any can."""
    a0, a1, a2, h0, h1, h2 = centre[0], centre[1], centre[2], half[0], half[1], half[2]
    count = 0
    x, y, z, us, vs, ws = own[0], own[1], own[2], own[3], own[4], own[5]
    for n in range(np.uint64(size)):
        a, b, c, u, v, w = a0 - x[n], a1 - y[n], a2 - z[n], us[n], vs[n], ws[n]
        p, q, r = abs(u), abs(v), abs(w)
        met = (
            (abs(b * w - c * v) <= h1 * r + h2 * q) & (abs(c * u - a * w) <= h2 * p + h0 * r)
            & (abs(a * v - b * u) <= h0 * q + h1 * p) & (a * u + b * v + c * w >= -(h0 * p + h1 * q + h2 * r))
        )  # fmt: skip
        near[n] = near[n] if met else 0.0
        count += 1 if near[n] > 0.0 else 0
    return count > 0


@INLINED
def _ask(vertices, tree, p, own, size, near, k, grid, listed, cells, lists, l, work, free):  # noqa: E741
    """Set free (SYMBOLS,) to 0 where part p hides point l; rays own (6, SYMBOLS) in its frame, those with near > 0.

    k: the number of the part's grid, -1 where it has none; work (L, P): a triangle that hid the point lately, or -1.
    """
    for n in range(size):
        if near[n] == 0.0:
            continue
        x, y, z, u, v, w = own[0, n], own[1, n], own[2, n], own[3, n], own[4, n], own[5, n]
        if work[l, p] >= 0 and hit(tree, work[l, p], x, y, z, u, v, w):
            free[n] = 0.0
            continue
        cell = cell_of(grid, k, x, y, z, u, v, w) if k >= 0 else -2
        if cell == -1 or (cell == -2 and not crosses(tree, tree.root[p], x, y, z, u, v, w)):
            continue
        if cell >= 0:
            f = in_cell(tree, grid, k, cell, x, y, z, u, v, w)
        elif listed:
            f = kept(vertices, tree, lists, p, l, cells, x, y, z, u, v, w)
        else:
            f = _through(tree, p, x, y, z, u, v, w)
        if f >= 0:
            free[n] = 0.0
            work[l, p] = f


@INNER
def _balls(poses, tree, order, size, balls):
    """Fill balls (P, 3, SYMBOLS) with the middles of the balls around the triangles of the parts `order`, globally."""
    for turn in range(len(order)):
        p = order[turn]
        x, y, z = tree.centre[tree.root[p], 0], tree.centre[tree.root[p], 1], tree.centre[tree.root[p], 2]
        for i in range(3):
            r0, r1, r2, t = poses[p, 3 * i], poses[p, 3 * i + 1], poses[p, 3 * i + 2], poses[p, 9 + i]
            row = balls[p, i]
            for n in range(np.uint64(size)):
                row[n] = r0[n] * x + r1[n] * y + r2[n] * z + t[n]


@LEAN
def cast(
    place, poses, part, points, toward, vertices, tree, order, gridded, grid, listed, cells, lists, work, balls, ray,
    own, free, near, settled, found,
):  # fmt: skip
    """Set found (N, L) where one of the parts `order` hides the point; points found already are not asked.

    place (3,) m: the station; poses (B, P, 15, SYMBOLS): each part's rotation and translation (m), and the station in
    its frame (m); points (L, 3) m, in their part's frame; toward (L,): share of the way to the station by which a point
    is moved; gridded: the part of `grid`; listed (P,): whether a part's lists are kept for its own points; cells (P,):
    cells of direction along a cube's side; settled (B, L): points whose own part has been asked, by SYMBOLS. Work:
    work (L, P) int64, filled with -1, balls (P, 3, SYMBOLS), ray (7, SYMBOLS), own (6, SYMBOLS), free, near (SYMBOLS,).
    """
    for m in range(len(settled)):
        first, past = m * SYMBOLS, min((m + 1) * SYMBOLS, len(found))
        size, at = past - first, poses[m]
        _balls(at, tree, order, size, balls)
        for l in range(len(points)):  # noqa: E741
            left = 0
            for n in range(size):
                free[n] = 0.0 if found[first + n, l] else 1.0
                left += 0 if found[first + n, l] else 1
            if left == 0 or (settled[m, l] and len(order) == 1 and order[0] == part[l]):
                continue
            _started(place, at[part[l]], points[l], toward[l], size, ray)
            for turn in range(len(order)):
                p = order[turn]
                k = first // grid.symbols if p == gridded else -1
                if p == part[l]:
                    if not settled[m, l]:
                        _own(at[p], points[l], toward[l], size, own)
                        _ask(vertices, tree, p, own, size, free, k, grid, listed[p], cells[p], lists, l, work, free)
                elif _ball_ahead(ray, balls[p], tree.radius_m[tree.root[p]], size, free, near):
                    _turned(at[p], ray, size, own)
                    if k >= 0 or _box_ahead(tree.centre[tree.root[p]], tree.half[tree.root[p]], own, size, near):
                        _ask(vertices, tree, p, own, size, near, k, grid, False, cells[p], lists, l, work, free)
            for n in range(size):
                found[first + n, l] = free[n] == 0.0
