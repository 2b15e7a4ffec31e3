"""The image method for one ray: mirror images in facets, and the points at which a ray meets them.

A reflected ray is a straight line from the station's image to the point, or from the station to the
point's image.
"""

from typing import NamedTuple

import numpy as np

from lowalt.machine.jit import INLINED, INNER, PLAIN, kernel

ROOM = 1e-9
"""Share of a ray next to its ends in which no triangle blocks it."""
ALLOCATING = kernel(inner=True)
"""For functions that only kernels call and that make arrays."""
MOST_POINTS = 4
"""Corners of a ray with two reflections: the station, both reflections and the target."""

REACHED = 0
NOT_BETWEEN = 1
WRONG_SIDE = 5
OUTSIDE = 9
"""What `trace_ray` returns: there is a ray; else the first condition that fails.

To NOT_BETWEEN and WRONG_SIDE it adds the facet's index in the route.
"""


class RayPoints(NamedTuple):
    """A ray by up to two facets, and work space of `trace_ray`.

    points (4, 3) m: the station, a reflection for each facet, and the target; behind (3,) m: the
    station's image in the facets met so far; ahead (3,) m: the target's image in those to come.
    """

    points: np.ndarray
    behind: np.ndarray
    ahead: np.ndarray


@INNER
def height_over(facets, k, point):
    """Return the height (m) of a point (3,) over the plane of facet k."""
    normal = facets.normal[k]
    return normal[0] * point[0] + normal[1] * point[1] + normal[2] * point[2] - facets.offset[k]


@INNER
def mirror(facets, k, point, image):
    """Set image (3,) to the mirror image of a point in the plane of facet k."""
    height = height_over(facets, k, point)
    normal = facets.normal[k]
    for i in range(3):
        image[i] = point[i] - 2.0 * height * normal[i]


@PLAIN
def mirrored(facets, k, point):
    """Replace a point (3,) by its mirror image in the plane of facet k."""
    mirror(facets, k, point, point)


@INNER
def _inside(facets, k, point):
    """Whether a point in the plane of facet k lies in one of its triangles; the ground has no end.

    The point is the triangle's corner + u e + v f, where e and f are its edges.
    """
    first = facets.first[k]
    last = facets.first[k + 1]
    if first == last:
        return True
    for row in range(first, last):
        t = facets.triangles[row]
        e0 = t[3]
        e1 = t[4]
        e2 = t[5]
        f0 = t[6]
        f1 = t[7]
        f2 = t[8]
        x = point[0] - t[0]
        y = point[1] - t[1]
        z = point[2] - t[2]
        ee = e0 * e0 + e1 * e1 + e2 * e2
        ff = f0 * f0 + f1 * f1 + f2 * f2
        ef = e0 * f0 + e1 * f1 + e2 * f2
        pe = x * e0 + y * e1 + z * e2
        pf = x * f0 + y * f1 + z * f2
        whole = ee * ff - ef * ef
        u = pe * ff - pf * ef
        v = pf * ee - pe * ef
        if u >= 0.0 and v >= 0.0 and u + v <= whole:
            return True
    return False


@INNER
def crosses(t, start, end):
    """Return whether a triangle t (9,) lies between two points (3,).

    e and f are the triangle's edges, d the ray's way, o its start as seen from the triangle's
    corner, p = d x f and q = o x e; all are multiplied by the determinant, `whole`, instead of
    divided by it. Source: Moeller & Trumbore, Fast, minimum storage ray/triangle intersection,
    Journal of Graphics Tools 2, 1997.
    """
    e0 = t[3]
    e1 = t[4]
    e2 = t[5]
    f0 = t[6]
    f1 = t[7]
    f2 = t[8]
    d0 = end[0] - start[0]
    d1 = end[1] - start[1]
    d2 = end[2] - start[2]
    o0 = start[0] - t[0]
    o1 = start[1] - t[1]
    o2 = start[2] - t[2]
    p0 = d1 * f2 - d2 * f1
    p1 = d2 * f0 - d0 * f2
    p2 = d0 * f1 - d1 * f0
    q0 = o1 * e2 - o2 * e1
    q1 = o2 * e0 - o0 * e2
    q2 = o0 * e1 - o1 * e0
    determinant = e0 * p0 + e1 * p1 + e2 * p2
    sign = 1.0 if determinant > 0.0 else -1.0
    whole = sign * determinant
    u = sign * (o0 * p0 + o1 * p1 + o2 * p2)
    v = sign * (d0 * q0 + d1 * q1 + d2 * q2)
    way = sign * (f0 * q0 + f1 * q1 + f2 * q2)
    met = u >= 0.0 and v >= 0.0 and u + v <= whole
    return met and way > ROOM * whole and way < (1.0 - ROOM) * whole


@INLINED
def trace_ray(facets, route, station, target, ray, clip):
    """Fill `ray` with the points of the ray from a station to a target (3,) by a route.

    route: (0 to 2,), its facets.

    clip: whether the ray must meet the facets, not their planes alone. Returns REACHED where there
    is such a ray, else the condition that fails; for each condition, the targets that fail by it
    alone form a convex set.
    """
    count = len(route)
    points = ray.points
    behind = ray.behind
    ahead = ray.ahead
    for i in range(3):
        points[0, i] = station[i]
        points[count + 1, i] = target[i]
        behind[i] = station[i]
    # From the station on, each facet in turn: the ray goes straight from the station's image to
    # what it meets next.
    for k in range(count):
        for i in range(3):
            ahead[i] = target[i]
        for later in range(count - 1, k, -1):
            mirror(facets, route[later], ahead, ahead)
        here = height_over(facets, route[k], behind)
        there = height_over(facets, route[k], ahead)
        if here * there <= 0.0:
            return NOT_BETWEEN + k
        share = here / (here + there)
        mirror(facets, route[k], ahead, ahead)
        for i in range(3):
            points[k + 1, i] = behind[i] + share * (ahead[i] - behind[i])
        if clip and not _inside(facets, route[k], points[k + 1]):
            return OUTSIDE
        mirror(facets, route[k], behind, behind)
    # Each reflection must be reached from the side on which the ray goes on.
    for k in range(count):
        before = height_over(facets, route[k], points[k])
        after = height_over(facets, route[k], points[k + 2])
        if before * after <= 0.0:
            return WRONG_SIDE + k
    return REACHED
