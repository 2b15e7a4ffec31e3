"""Candidates: the facets that may reflect a wave from a station to a target.

They are found before rays are traced.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.extensions.town.bundle_loops import between, bundled, dark, empty_bundle, empty_span
from lowalt.extensions.town.image_loops import ALLOCATING, height_over, mirror
from lowalt.machine.jit import INLINED, INNER, PLAIN


class BoxCorners(NamedTuple):
    """The corners of a box as a facet sees them.

    point: (8, 3) m, in binary order of the axes; height: (8,) m over the facet's plane; foot: (8,
    2) m, the corner's projection onto that plane.
    """

    point: np.ndarray
    height: np.ndarray
    foot: np.ndarray


@ALLOCATING
def empty_corners():
    """Return room for the corners of one box."""
    return BoxCorners(np.empty((8, 3)), np.empty(8), np.empty((8, 2)))


@INNER
def _reaches(facets, k, source, target, radius):
    """Whether facet k may reflect a ray from a source to any point within `radius` (m) of a target.

    a and b are coordinates in the rectangle around the facet.
    """
    here = height_over(facets, k, source)
    there = height_over(facets, k, target)
    inside = facets.outward[k] * here < 0.0
    if here < 0.0:
        here = -here
        there = -there
    if inside or here == 0.0 or there <= -radius:
        return False
    least = here + there - radius
    if facets.first[k] == facets.first[k + 1] or least <= 0.0:
        return True
    share = here / (here + there)
    across = facets.across[k]
    up = facets.up[k]
    a = 0.0
    b = 0.0
    way_a = 0.0
    way_b = 0.0
    for i in range(3):
        off = source[i] - facets.centre[k, i]
        way = target[i] - source[i]
        a = a + across[i] * off
        way_a = way_a + across[i] * way
        b = b + up[i] * off
        way_b = way_b + up[i] * way
    # By how much the point of reflection moves at most if the target moves by the radius.
    room = here * radius / least * (1.0 + math.sqrt(way_a * way_a + way_b * way_b) / (here + there))
    return (
        abs(a + share * way_a) <= facets.half[k, 0] + room
        and abs(b + share * way_b) <= facets.half[k, 1] + room
    )


@PLAIN
def ordered_pairs(facets, firsts, source, radii):
    """Return the pairs (P, 2) of facets such that the first may reflect a ray to the second.

    The ray comes from a source.

    firsts: (K,) bool, which may come first; radii: (K,) m, around the facets' centres, infinite for
    the ground.
    """
    size = 1024
    count = 0
    found = np.empty((size, 2), np.int64)
    image = np.empty(3)
    for first in range(len(radii)):
        if not firsts[first]:
            continue
        mirror(facets, first, source, image)
        for second in range(len(radii)):
            if facets.outward[second] * height_over(facets, second, image) < 0.0:
                continue
            if first == second or not _reaches(
                facets, first, source, facets.centre[second], radii[second]
            ):
                continue
            if count == size:
                size *= 2
                larger = np.empty((size, 2), np.int64)
                larger[:count] = found
                found = larger
            found[count, 0] = first
            found[count, 1] = second
            count += 1
    return found[:count].copy()


@INLINED
def _passes(facets, k, source, box):
    """Return whether all points of reflection lie on one side of a facet.

    They are those at facet k of all rays from a source to a box, by its corners' `point`.

    A projection keeps convex sets convex, so the corners of the piece of the box on the source's
    side bound them. a, b and x, y are coordinates in the rectangle around the facet: of the source,
    and of points of reflection.
    """
    here = height_over(facets, k, source)
    sign = 1.0 if here > 0.0 else -1.0
    across = facets.across[k]
    up = facets.up[k]
    here *= sign
    a = 0.0
    b = 0.0
    for i in range(3):
        off = source[i] - facets.centre[k, i]
        a = a + across[i] * off
        b = b + up[i] * off
    for corner in range(8):
        point = box.point[corner]
        x = 0.0
        y = 0.0
        for i in range(3):
            off = point[i] - facets.centre[k, i]
            x = x + across[i] * off
            y = y + up[i] * off
        box.height[corner] = sign * height_over(facets, k, point)
        box.foot[corner, 0] = x
        box.foot[corner, 1] = y
    least_a = np.inf
    most_a = -np.inf
    least_b = np.inf
    most_b = -np.inf
    for corner in range(8):
        there = box.height[corner]
        if there <= 0.0:
            continue
        # The corner itself, and the points where the box's edges from it end in the plane.
        for axis in range(4):
            x = box.foot[corner, 0]
            y = box.foot[corner, 1]
            if axis == 3:
                share = here / (here + there)
            else:
                other = corner ^ (1 << axis)
                beyond = box.height[other]
                if beyond > 0.0:
                    continue
                along = there / (there - beyond)
                x = x + along * (box.foot[other, 0] - x)
                y = y + along * (box.foot[other, 1] - y)
                share = 1.0
            x = a + share * (x - a)
            y = b + share * (y - b)
            least_a = min(least_a, x)
            most_a = max(most_a, x)
            least_b = min(least_b, y)
            most_b = max(most_b, y)
    half = facets.half[k]
    some = here > 0.0 and facets.outward[k] * sign >= 0.0 and most_a > -np.inf
    return not (
        some
        and least_a <= half[0]
        and most_a >= -half[0]
        and least_b <= half[1]
        and most_b >= -half[1]
    )


@INLINED
def misses(facets, route, station, low, high, source, box):
    """Return whether surely no ray from a station by the facets of a route ends in a box.

    The box lies between two corners (3,) m.

    False does not say that one does. source (3,), box: work space.
    """
    for i in range(3):
        source[i] = station[i]
    for k in range(len(route)):
        for corner in range(8):
            point = box.point[corner]
            for i in range(3):
                point[i] = high[i] if (corner >> i) & 1 else low[i]
            for later in range(len(route) - 1, k, -1):
                mirror(facets, route[later], point, point)
        if _passes(facets, route[k], source, box):
            return True
        mirror(facets, route[k], source, source)
    return False


@PLAIN
def fitting(facets, routes, station, low, high):
    """Return those of the routes (P, 1 or 2) by which rays from a station may end in a box.

    The box lies between two corners (3,) m.

    Spheres around the box sort out most of them, before `misses` holds the box itself to the
    facets.
    """
    target = 0.5 * (low + high)
    radius = 0.0
    for i in range(3):
        radius += (0.5 * (high[i] - low[i])) ** 2
    radius = math.sqrt(radius)
    images = np.empty((len(facets.offset), 3))
    for k in range(len(images)):
        mirror(facets, k, target, images[k])
    found = np.empty_like(routes)
    behind = np.empty(3)
    source = station.copy()
    box = empty_corners()
    count = 0
    latest = -1
    for p in range(len(routes)):
        first = routes[p, 0]
        last = routes[p, -1]
        if routes.shape[1] == 2:
            if not _reaches(facets, first, station, images[last], radius):
                continue
            if first != latest:
                mirror(facets, first, station, source)
                latest = first
        if not _reaches(facets, last, source, target, radius):
            continue
        if not misses(facets, routes[p], station, low, high, behind, box):
            found[count] = routes[p]
            count += 1
    return found[:count].copy()


@PLAIN
def hidden(facets, occluders, which, corners):
    """Return whether one convex surface hides all of a facet from a whole box, for each facet.

    which: (B,), the facets; corners: (8, 3) m, of the box.
    """
    result = np.zeros(len(which), np.bool_)
    bundle = empty_bundle()
    span = empty_span()
    held = np.empty(len(occluders.triangles), np.int64)
    # From each corner of the box to each corner of the rectangle around the facet.
    starts = np.empty((32, 3))
    ends = np.empty((32, 3))
    for b in range(len(which)):
        facet = which[b]
        if facets.first[facet] == facets.first[facet + 1]:
            continue
        for k in range(32):
            right = facets.half[facet, 0] * (1 - 2 * (k // 8 % 2))
            high = facets.half[facet, 1] * (1 - 2 * (k // 16))
            for i in range(3):
                starts[k, i] = corners[k % 8, i]
                ends[k, i] = (
                    facets.centre[facet, i]
                    + right * facets.across[facet, i]
                    + high * facets.up[facet, i]
                )
        bundled(starts, ends, span, bundle)
        kept = 0
        for f in range(between(occluders, bundle, held)):
            if occluders.facet[held[f]] != facet:
                held[kept] = held[f]
                kept += 1
        result[b] = dark(facets, occluders, starts, ends, held[:kept])
    return result
