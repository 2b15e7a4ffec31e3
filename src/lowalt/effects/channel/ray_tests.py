"""Whether rays meet the balls and triangles of a `surface_tree`: single rays, and all rays of a narrow cone."""

import math

import numpy as np

from lowalt.common.jit import INLINED, INNER


@INLINED
def met(tree, node, x, y, z, a, b, c, spread):
    """Whether a node's ball can be met by a ray from x, y, z whose direction is within `spread` (rad) of a, b, c.

    A ray that meets it after h is at most h spread off the middle ray, and h is at most the ball's far side's distance.
    """
    u, v, w = tree.centre[node, 0] - x, tree.centre[node, 1] - y, tree.centre[node, 2] - z
    along, square = u * a + v * b + w * c, u * u + v * v + w * w
    reach = tree.radius_m[node]
    reach += (math.sqrt(square) + reach) * spread
    return along >= -reach and square - along * along <= reach * reach


@INLINED
def crosses(tree, node, x, y, z, u, v, w):
    """Whether the ray from x, y, z along u, v, w can meet the box around a node's triangles, by separating axes."""
    a, b, c = tree.centre[node, 0] - x, tree.centre[node, 1] - y, tree.centre[node, 2] - z
    i, j, k = tree.half[node, 0], tree.half[node, 1], tree.half[node, 2]
    l, m, n = abs(u), abs(v), abs(w)  # noqa: E741
    return (
        abs(b * w - c * v) <= j * n + k * m and abs(c * u - a * w) <= k * l + i * n
        and abs(a * v - b * u) <= i * m + j * l and a * u + b * v + c * w >= -(i * l + j * m + k * n)
    )  # fmt: skip


@INLINED
def hit(tree, f, x, y, z, u, v, w):
    """Whether the ray from x, y, z along u, v, w meets triangle f before its end; Moeller & Trumbore 1997."""
    a0, a1, a2 = tree.edges[f, 0], tree.edges[f, 1], tree.edges[f, 2]
    d0, d1, d2 = tree.edges[f, 3], tree.edges[f, 4], tree.edges[f, 5]
    e0, e1, e2 = tree.edges[f, 6], tree.edges[f, 7], tree.edges[f, 8]
    h0, h1, h2 = v * e2 - w * e1, w * e0 - u * e2, u * e1 - v * e0
    size = d0 * h0 + d1 * h1 + d2 * h2
    # The side of the outward normal is turned to the station where `size` is negative.
    if size == 0.0 or (tree.closed[f] and size > 0.0):
        return False
    sign = 1.0 if size > 0.0 else -1.0
    size *= sign
    o0, o1, o2 = x - a0, y - a1, z - a2
    one = sign * (o0 * h0 + o1 * h1 + o2 * h2)
    q0, q1, q2 = o1 * d2 - o2 * d1, o2 * d0 - o0 * d2, o0 * d1 - o1 * d0
    other = sign * (u * q0 + v * q1 + w * q2)
    way = sign * (e0 * q0 + e1 * q1 + e2 * q2)
    return one >= 0.0 and other >= 0.0 and one + other <= size and way > 0.0 and way < size


@INNER
def hit_each(edge, closed, start, ways, first, past, free):
    """Set free (N,) to 0 where rays from `start` (3,) along ways (3, N), first to past - 1, meet a triangle, as `hit`.

    edge (9,) and closed: of `Tree`. Comparisons in place of branches, so that symbols pass in vector instructions.
    """
    d0, d1, d2, e0, e1, e2 = edge[3], edge[4], edge[5], edge[6], edge[7], edge[8]
    o0, o1, o2 = start[0] - edge[0], start[1] - edge[1], start[2] - edge[2]
    q0, q1, q2 = o1 * d2 - o2 * d1, o2 * d0 - o0 * d2, o0 * d1 - o1 * d0
    height = e0 * q0 + e1 * q1 + e2 * q2
    largest = 0.0 if closed else np.inf
    us, vs, ws, left = ways[0, first:past], ways[1, first:past], ways[2, first:past], free[first:past]
    for n in range(np.uint64(past - first)):
        u, v, w = us[n], vs[n], ws[n]
        h0, h1, h2 = v * e2 - w * e1, w * e0 - u * e2, u * e1 - v * e0
        turned = d0 * h0 + d1 * h1 + d2 * h2
        sign = 1.0 if turned > 0.0 else -1.0
        whole = sign * turned
        one = sign * (o0 * h0 + o1 * h1 + o2 * h2)
        other = sign * (u * q0 + v * q1 + w * q2)
        way = sign * height
        # `turned` is 0 where the ray lies in the plane, and then `way` is not between 0 and it.
        met = (
            (turned <= largest) & (one >= 0.0) & (other >= 0.0) & (one + other <= whole) & (way > 0.0) & (way < whole)
        )  # fmt: skip
        left[n] = 0.0 if met else left[n]


@INLINED
def turned_away(tree, f, x, y, z):
    """Whether no ray from x, y, z meets triangle f, whatever its direction, as it is of a closed surface's far side."""
    a0, a1, a2 = tree.edges[f, 0], tree.edges[f, 1], tree.edges[f, 2]
    d0, d1, d2 = tree.edges[f, 3], tree.edges[f, 4], tree.edges[f, 5]
    o0, o1, o2 = x - a0, y - a1, z - a2
    q0, q1, q2 = o1 * d2 - o2 * d1, o2 * d0 - o0 * d2, o0 * d1 - o1 * d0
    # The number `way` of `hit` before its sign, which is -1 wherever a closed surface is met.
    return tree.closed[f] and tree.edges[f, 6] * q0 + tree.edges[f, 7] * q1 + tree.edges[f, 8] * q2 >= 0.0


@INLINED
def first_hit(tree, pool, first, past, x, y, z, u, v, w):
    """The first of the triangles pool[first] to pool[past - 1] that the ray of `hit` meets, -1 without one."""
    for at in range(first, past):
        if hit(tree, pool[at], x, y, z, u, v, w):
            return pool[at]
    return -1


@INLINED
def side(i, j, k, p, q, r, a, b, c, spread):
    """-1 or 1 where rays pass the edge between two corners on one side alone, else 0; corners from the rays' start.

    The side is the sign of the corners' product with the ray's direction a, b, c. The product changes by at most its
    length times `spread` with the direction.
    """
    u, v, w = j * r - k * q, k * p - i * r, i * q - j * p
    edge = math.sqrt((p - i) ** 2 + (q - j) ** 2 + (r - k) ** 2)
    room = math.sqrt(u * u + v * v + w * w) * spread + 1e-12 * edge
    along = u * a + v * b + w * c
    return 1 if along > room else (-1 if along < -room else 0)


@INLINED
def sides(a0, a1, a2, b0, b1, b2, c0, c1, c2, a, b, c, spread):
    """The least and the largest `side` of a triangle's three edges for rays in the direction a, b, c.

    a0, a1, a2, then b0 to c2: its corners from the rays' start. No ray meets it where they are -1 and 1.
    """
    one = side(a0, a1, a2, b0, b1, b2, a, b, c, spread)
    two = side(b0, b1, b2, c0, c1, c2, a, b, c, spread)
    three = side(c0, c1, c2, a0, a1, a2, a, b, c, spread)
    return min(one, min(two, three)), max(one, max(two, three))


@INLINED
def reached(vertices, tree, f, x, y, z, a, b, c, spread):
    """Whether any of the rays of `met` can meet triangle f: they pass no two edges on different sides."""
    i, j, k = tree.faces[f, 0], tree.faces[f, 1], tree.faces[f, 2]
    a0, a1, a2 = vertices[i, 0] - x, vertices[i, 1] - y, vertices[i, 2] - z
    b0, b1, b2 = vertices[j, 0] - x, vertices[j, 1] - y, vertices[j, 2] - z
    c0, c1, c2 = vertices[k, 0] - x, vertices[k, 1] - y, vertices[k, 2] - z
    least, most = sides(a0, a1, a2, b0, b1, b2, c0, c1, c2, a, b, c, spread)
    return least >= 0 or most <= 0


def cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the cross product of two vectors (3,), as np.cross does, in a tenth of its time."""
    (i, j, k), (u, v, w) = a.tolist(), b.tolist()
    return np.array([j * w - k * v, k * u - i * w, i * v - j * u])
