"""Which points of a target a station cannot see: exact ray casting, as images on a screen before the station.

A straight line from the station through a point is a place on a screen. A triangle hides the point if its image holds
that place and it is nearer there, where one over the depth is linear on the screen. Points are sorted into a grid on
the screen, so each triangle meets only the points about it. A point is compared first with the triangle that hid it a
symbol ago, which in most cases still hides it; it then needs no other comparison. A part whose ball stands before no
open point is passed over. Rays in the parts' frames (`shadow_rays`) are faster where parts turn slowly.
"""

import math

import numpy as np

from lowalt.common.jit import INLINED, LEAN, kernel

RAYS = kernel(error_model="numpy")

GRID = 24
"""Cells of the screen along each side."""


@LEAN
def _screen(place, rotation, translation, part, points, right, up, ahead, out):
    """Fill out (K, 3) with screen places and inverse depths of body-frame points (K, 3); depth <= 0 gives inverse 0.

    Points of a part that follow each other pass through one loop, whose operations are done as written.
    """
    first, count = 0, len(points)
    while first < count:
        p, last = part[first], first
        while last < count and part[last] == p:
            last += 1
        r00, r01, r02 = rotation[p, 0, 0], rotation[p, 0, 1], rotation[p, 0, 2]
        r10, r11, r12 = rotation[p, 1, 0], rotation[p, 1, 1], rotation[p, 1, 2]
        r20, r21, r22 = rotation[p, 2, 0], rotation[p, 2, 1], rotation[p, 2, 2]
        t0, t1, t2 = translation[p, 0] - place[0], translation[p, 1] - place[1], translation[p, 2] - place[2]
        for k in range(first, last):
            x, y, z = points[k, 0], points[k, 1], points[k, 2]
            a, b, c = (
                r00 * x + r01 * y + r02 * z + t0,
                r10 * x + r11 * y + r12 * z + t1,
                r20 * x + r21 * y + r22 * z + t2,
            )
            d0, d1 = a * right[0] + b * right[1] + c * right[2], a * up[0] + b * up[1] + c * up[2]
            d2 = a * ahead[0] + b * ahead[1] + c * ahead[2]
            inverse = 1.0 / d2
            before = d2 > 0.0
            out[k, 0], out[k, 1] = d0 / d2 if before else 0.0, d1 / d2 if before else 0.0
            out[k, 2] = inverse if before else 0.0
        first = last


@INLINED
def _most(a, b, c):
    """The largest of three; chosen without a branch, which `max` is not."""
    larger = a if a > b else b
    return larger if larger > c else c


@INLINED
def _least(a, b, c):
    """The least of three, likewise."""
    smaller = a if a < b else b
    return smaller if smaller < c else c


@INLINED
def _covers(corner, p, q, r, dot, point, closed):
    """Whether the triangle p, q, r of images corner (V, 3) stands before the one with image dot[point]."""
    a0, a1, b0, b1, c0, c1 = corner[p, 0], corner[p, 1], corner[q, 0], corner[q, 1], corner[r, 0], corner[r, 1]
    a2, b2, c2 = corner[p, 2], corner[q, 2], corner[r, 2]
    area = (b0 - a0) * (c1 - a1) - (b1 - a1) * (c0 - a0)
    if (closed and area <= 0.0) or a2 == 0.0 or b2 == 0.0 or c2 == 0.0:
        return False
    sign = 1.0 if area > 0.0 else -1.0
    x, y, depth = dot[point, 0], dot[point, 1], dot[point, 2]
    u = sign * ((b0 - x) * (c1 - y) - (b1 - y) * (c0 - x))
    v = sign * ((c0 - x) * (a1 - y) - (c1 - y) * (a0 - x))
    w = sign * ((a0 - x) * (b1 - y) - (a1 - y) * (b0 - x))
    return u >= 0.0 and v >= 0.0 and w >= 0.0 and u * a2 + v * b2 + w * c2 > depth * (u + v + w)


@INLINED
def _before_any(centre, radius_m, rotation, translation, place, right, up, ahead, p, dot, open_ones, left):
    """Whether the ball of part p stands before any of the open points, in front of a screen or through it."""
    a = rotation[p, 0, 0] * centre[p, 0] + rotation[p, 0, 1] * centre[p, 1] + rotation[p, 0, 2] * centre[p, 2]
    b = rotation[p, 1, 0] * centre[p, 0] + rotation[p, 1, 1] * centre[p, 1] + rotation[p, 1, 2] * centre[p, 2]
    c = rotation[p, 2, 0] * centre[p, 0] + rotation[p, 2, 1] * centre[p, 1] + rotation[p, 2, 2] * centre[p, 2]
    a, b, c = a + translation[p, 0] - place[0], b + translation[p, 1] - place[1], c + translation[p, 2] - place[2]
    d0, d1 = a * right[0] + b * right[1] + c * right[2], a * up[0] + b * up[1] + c * up[2]
    d2, radius = a * ahead[0] + b * ahead[1] + c * ahead[2], radius_m[p]
    if d2 <= radius:
        return True
    near, far = 1.0 / (d2 - radius), 1.0 / (d2 + radius)
    low0, high0, low1, high1 = d0 - radius, d0 + radius, d1 - radius, d1 + radius
    low0, high0 = low0 * (near if low0 < 0.0 else far), high0 * (near if high0 > 0.0 else far)
    low1, high1 = low1 * (near if low1 < 0.0 else far), high1 * (near if high1 > 0.0 else far)
    for number in range(left):
        k = open_ones[number]
        if dot[k, 2] < near and low0 <= dot[k, 0] <= high0 and low1 <= dot[k, 1] <= high1:
            return True
    return False


@RAYS
def triangles(
    place, rotation, translation, part, points, toward, vertices, vertex_part, faces, closed, balls, grid, hidden
):
    """Set hidden (N, L) where a triangle stands between the point and the station at `place` (3,).

    rotation (N, P, 3, 3), translation (N, P, 3): poses; points (L, 3): off their own surface, body frame; toward (L,):
    relative depth by which a point is moved to the station instead, where it has no normal; closed (F,): whether the
    triangle is of a closed surface with outward normals, whose side turned to the station alone then hides all; balls:
    centre (P, 3) and radius (P,) (m) of a ball around each part's triangles. Points that are hidden already are not
    asked.
    """
    count = len(points)
    hider, open_ones = np.full(count, -1), np.empty(count, np.int64)
    corner, dot, at = np.empty((len(vertices), 3)), np.empty((count, 3)), np.empty((count, 3))
    start, order, cell = np.empty(grid * grid + 1, np.int64), np.empty(count, np.int64), np.empty(count, np.int64)
    ahead, right, up = np.empty(3), np.empty(3), np.empty(3)
    for n in range(rotation.shape[0]):
        for i in range(3):
            ahead[i] = translation[n, 0, i] - place[i]
        ahead /= math.sqrt(ahead[0] ** 2 + ahead[1] ** 2 + ahead[2] ** 2)
        least = np.argmin(np.abs(ahead))
        right[:] = 0.0
        right[least] = 1.0
        right -= ahead[least] * ahead
        right /= math.sqrt(right[0] ** 2 + right[1] ** 2 + right[2] ** 2)
        up[0] = right[1] * ahead[2] - right[2] * ahead[1]
        up[1] = right[2] * ahead[0] - right[0] * ahead[2]
        up[2] = right[0] * ahead[1] - right[1] * ahead[0]
        _screen(place, rotation[n], translation[n], vertex_part, vertices, right, up, ahead, corner)
        _screen(place, rotation[n], translation[n], part, points, right, up, ahead, dot)
        left = 0
        low0, low1, high0, high1 = np.inf, np.inf, -np.inf, -np.inf
        for l in range(count):  # noqa: E741
            if hidden[n, l]:
                continue
            dot[l, 2] *= 1.0 + toward[l]
            f = hider[l]
            if f >= 0 and _covers(corner, faces[f, 0], faces[f, 1], faces[f, 2], dot, l, closed[f]):
                hidden[n, l] = True
                continue
            hider[l] = -1
            open_ones[left] = l
            left += 1
            low0, low1 = min(low0, dot[l, 0]), min(low1, dot[l, 1])
            high0, high1 = max(high0, dot[l, 0]), max(high1, dot[l, 1])
        wide0 = grid / max((high0 - low0) * (1 + 1e-9), 1e-300)
        wide1 = grid / max((high1 - low1) * (1 + 1e-9), 1e-300)
        start[:] = 0
        for number in range(left):
            l = open_ones[number]  # noqa: E741
            column = min(int((dot[l, 0] - low0) * wide0), grid - 1)
            cell[l] = column * grid + min(int((dot[l, 1] - low1) * wide1), grid - 1)
            start[cell[l] + 1] += 1
        for k in range(grid * grid):
            start[k + 1] += start[k]
        for number in range(left):
            l = open_ones[number]  # noqa: E741
            k = start[cell[l]]
            order[k] = l
            at[k, 0], at[k, 1], at[k, 2] = dot[l, 0], dot[l, 1], dot[l, 2]
            start[cell[l]] += 1
        for k in range(grid * grid, 0, -1):
            start[k] = start[k - 1]
        start[0] = 0
        last, met = -1, False
        for f in range(len(faces) if left > 0 else 0):
            p, q, r = faces[f, 0], faces[f, 1], faces[f, 2]
            if vertex_part[p] != last:
                last = vertex_part[p]
                met = _before_any(
                    balls[0], balls[1], rotation[n], translation[n], place, right, up, ahead, last, dot, open_ones, left
                )  # fmt: skip
            if not met:
                continue
            a0, a1, b0, b1, c0, c1 = corner[p, 0], corner[p, 1], corner[q, 0], corner[q, 1], corner[r, 0], corner[r, 1]
            area = (b0 - a0) * (c1 - a1) - (b1 - a1) * (c0 - a0)
            if closed[f] and area <= 0.0:
                continue
            sign = 1.0 if area > 0.0 else -1.0
            last0, last1 = (_most(a0, b0, c0) - low0) * wide0, (_most(a1, b1, c1) - low1) * wide1
            first0, first1 = (_least(a0, b0, c0) - low0) * wide0, (_least(a1, b1, c1) - low1) * wide1
            if last0 < 0.0 or last1 < 0.0 or first0 >= grid or first1 >= grid:
                continue
            a2, b2, c2 = corner[p, 2], corner[q, 2], corner[r, 2]
            if a2 == 0.0 or b2 == 0.0 or c2 == 0.0:
                continue
            nearest = _most(a2, b2, c2)
            j0, j1 = int(max(first1, 0.0)), int(min(last1, grid - 1.0))
            for i in range(int(max(first0, 0.0)), int(min(last0, grid - 1.0)) + 1):
                for k in range(start[i * grid + j0], start[i * grid + j1 + 1]):
                    if nearest <= at[k, 2]:
                        continue
                    x, y = at[k, 0], at[k, 1]
                    u = sign * ((b0 - x) * (c1 - y) - (b1 - y) * (c0 - x))
                    if u < 0.0:
                        continue
                    v = sign * ((c0 - x) * (a1 - y) - (c1 - y) * (a0 - x))
                    if v < 0.0:
                        continue
                    w = sign * ((a0 - x) * (b1 - y) - (a1 - y) * (b0 - x))
                    if w >= 0.0 and u * a2 + v * b2 + w * c2 > at[k, 2] * (u + v + w):
                        hidden[n, order[k]] = True
                        hider[order[k]] = f
                        # Nearer than every triangle: not asked again.
                        at[k, 2] = np.inf


def balls_of(vertices: np.ndarray, vertex_part: np.ndarray, parts: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the centre (P, 3) and the radius (P,) of a ball around each part's vertices (V, 3) (m), in its frame."""
    centre, radius = np.zeros((parts, 3)), np.zeros(parts)
    for part in range(parts):
        mine = vertices[vertex_part == part]
        if len(mine):
            centre[part] = 0.5 * (mine.min(axis=0) + mine.max(axis=0))
            radius[part] = np.sqrt(((mine - centre[part]) ** 2).sum(axis=1).max()) * (1.0 + 1e-6) + 1e-9
    return centre, radius
