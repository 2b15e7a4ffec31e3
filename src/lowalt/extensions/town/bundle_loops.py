"""Bundles of rays, and the triangles of a town that may be in the way of one.

A bundle is a box around the rays' starts and a box around their ways.
"""

from typing import NamedTuple

import numpy as np

from lowalt.extensions.town.image_loops import ALLOCATING, crosses
from lowalt.machine.jit import INNER, PLAIN
from lowalt.scene.rays_loops import can_meet

ROOM_M = 1e-9
"""Margin of boxes for rounding (m)."""


class Bundle(NamedTuple):
    """A bundle of rays: the middles of its two boxes and their half widths, (3,) m each.

    boxes (12,): all four in the order of `rays_loops.can_meet`, the others are views of it; box
    (6,): work space, a box around a triangle.
    """

    boxes: np.ndarray
    start: np.ndarray
    way: np.ndarray
    start_half: np.ndarray
    way_half: np.ndarray
    box: np.ndarray


class RaySpan(NamedTuple):
    """The least and largest starts and ways of rays, (3, 3) m each.

    There is a row for each leg of a path, the first where rays have one leg.
    """

    low_start: np.ndarray
    high_start: np.ndarray
    low_way: np.ndarray
    high_way: np.ndarray


@ALLOCATING
def empty_bundle():
    """Return room for one bundle."""
    boxes = np.empty(12)
    return Bundle(boxes, boxes[:3], boxes[3:6], boxes[6:9], boxes[9:], np.empty(6))


@ALLOCATING
def empty_span():
    """Return room for the rays of three legs."""
    return RaySpan(np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)))


@INNER
def clear_span(span, leg):
    """Set a leg's row of a span to that of no rays."""
    for i in range(3):
        span.low_start[leg, i] = np.inf
        span.low_way[leg, i] = np.inf
        span.high_start[leg, i] = -np.inf
        span.high_way[leg, i] = -np.inf


@INNER
def widen(span, leg, start, end):
    """Widen a leg's row of a span by the ray between two points (3,)."""
    for i in range(3):
        way = end[i] - start[i]
        span.low_start[leg, i] = min(span.low_start[leg, i], start[i])
        span.high_start[leg, i] = max(span.high_start[leg, i], start[i])
        span.low_way[leg, i] = min(span.low_way[leg, i], way)
        span.high_way[leg, i] = max(span.high_way[leg, i], way)


@INNER
def bundle_of(span, leg, bundle):
    """Fill a bundle with the rays of a leg's row of a span."""
    for i in range(3):
        low = span.low_start[leg, i]
        high = span.high_start[leg, i]
        bundle.start[i] = 0.5 * (low + high)
        bundle.start_half[i] = 0.5 * (high - low) + ROOM_M
        low = span.low_way[leg, i]
        high = span.high_way[leg, i]
        bundle.way[i] = 0.5 * (low + high)
        bundle.way_half[i] = 0.5 * (high - low) + ROOM_M


@INNER
def span_of(starts, ends, span, leg):
    """Set a leg's row of a span to that of the rays from starts to ends, (P, 3) m each."""
    clear_span(span, leg)
    for k in range(len(starts)):
        widen(span, leg, starts[k], ends[k])


@INNER
def bundled(starts, ends, span, bundle):
    """Fill a bundle with the rays from starts to ends, (P, 3) m each; span: work space."""
    span_of(starts, ends, span, 0)
    bundle_of(span, 0, bundle)


@INNER
def _meets(boxes, box):
    """Whether a bundle, by its boxes (12,), may meet a box (6,) between the rays' ends.

    See `rays_loops.can_meet`.
    """
    for i in range(3):
        start = boxes[i]
        way = boxes[3 + i]
        start_half = boxes[6 + i]
        way_half = boxes[9 + i]
        low = start - start_half
        high = start + start_half
        low = low + min(0.0, way - way_half)
        high = high + max(0.0, way + way_half)
        if box[i] > high or box[3 + i] < low:
            return False
    return can_meet(boxes, box)


@INNER
def can_cross(boxes, t, box):
    """Return whether a bundle, by its boxes (12,), may cross the box around a triangle t (9,).

    box: work space (6,).
    """
    for i in range(3):
        box[i] = t[i] + min(0.0, min(t[3 + i], t[6 + i])) - ROOM_M
        box[3 + i] = t[i] + max(0.0, max(t[3 + i], t[6 + i])) + ROOM_M
    return _meets(boxes, box)


@INNER
def between(occluders, bundle, found):
    """Fill found (F,) with the triangles that a bundle of rays may cross; return their number."""
    boxes = occluders.boxes
    count = 0
    leaves = len(boxes) // 2
    node = 1
    size = len(occluders.triangles) // leaves
    while True:
        if _meets(bundle.boxes, boxes[node]):
            if node < leaves:
                node *= 2
                continue
            for row in range((node - leaves) * size, (node - leaves + 1) * size):
                if can_cross(bundle.boxes, occluders.triangles[row], bundle.box):
                    found[count] = row
                    count += 1
        # The next node that is not inside this one.
        node += 1
        while node % 2 == 0:
            node //= 2
        if node == 1:
            return count


@PLAIN
def near(occluders, starts, ends, room, found):
    """Fill found (F,) with the triangles within about `room` (m) of rays between points (P, 3) m.

    Returns how many there are.
    """
    bundle = empty_bundle()
    bundled(starts, ends, empty_span(), bundle)
    for i in range(3):
        bundle.start_half[i] += room
    return between(occluders, bundle, found)


@PLAIN
def blocked(occluders, starts, ends):
    """Return whether a triangle stands between starts and ends, (P, 3) m each, as (P,) bool."""
    result = np.zeros(len(starts), np.bool_)
    found = np.empty(len(occluders.triangles), np.int64)
    bundle = empty_bundle()
    span = empty_span()
    for p in range(len(starts)):
        bundled(starts[p : p + 1], ends[p : p + 1], span, bundle)
        for f in range(between(occluders, bundle, found)):
            if crosses(occluders.triangles[found[f]], starts[p], ends[p]):
                result[p] = True
                break
    return result


@INNER
def _stops(facets, occluders, row, start, end):
    """Whether a triangle, or its facet where that is convex, lies between two points (3,).

    row: of the triangle.
    """
    facet = occluders.facet[row]
    if not facets.convex[facet]:
        return crosses(occluders.triangles[row], start, end)
    for other in range(facets.first[facet], facets.first[facet + 1]):
        if crosses(facets.triangles[other], start, end):
            return True
    return False


@INNER
def dark(facets, occluders, starts, ends, rows):
    """Return whether one of the triangles `rows` blocks all rays of a block.

    A triangle counts alone or with its convex facet.

    starts, ends: (C, 3), of the rays to a box's corners; these decide, since the shadow of a convex
    shape is convex.
    """
    for row in rows:
        every = True
        for k in range(len(starts)):
            every = every and _stops(facets, occluders, row, starts[k], ends[k])
        if every:
            return True
    return False
