"""The compiled loops of `image_paths`: whether a ray by some facets passes all buildings.

Rays that end near each other are traced in blocks. A block that no ray can reach is dropped, and one with a triangle
that may be in the way is halved until single rays decide.
"""

import numpy as np

from lowalt.extensions.town.image_loops import crosses, misses, trace_ray
from lowalt.machine.jit import INNER, PLAIN, kernel
from lowalt.scene.rays_loops import can_meet

ALLOCATING = kernel(inner=True)
"""For functions that only kernels call and that make arrays."""


@INNER
def _meets(bundle, box):
    """Whether a bundle of rays may meet a box (6,) between the rays' starts and ends, see `rays_loops.can_meet`."""
    for i in range(3):
        low, high = bundle[i] - bundle[6 + i], bundle[i] + bundle[6 + i]
        low, high = low + min(0.0, bundle[3 + i] - bundle[9 + i]), high + max(0.0, bundle[3 + i] + bundle[9 + i])
        if box[i] > high or box[3 + i] < low:
            return False
    return can_meet(bundle, box)


@INNER
def _can_cross(bundle, t, box):
    """Whether a bundle of rays may cross the box around a triangle (9,); box: work space (6,)."""
    for i in range(3):
        box[i] = t[i] + min(0.0, min(t[3 + i], t[6 + i])) - 1e-9
        box[3 + i] = t[i] + max(0.0, max(t[3 + i], t[6 + i])) + 1e-9
    return _meets(bundle, box)


@INNER
def between(occluders, bundle, found):
    """Fill found (F,) with the triangles that a bundle of rays may cross; return their number.

    bundle: the first twelve as in `rays_loops.can_meet`, the others are work space.
    """
    boxes, count, box = occluders.boxes, 0, bundle[12:18]
    leaves, node = len(boxes) // 2, 1
    size = len(occluders.triangles) // leaves
    while True:
        if _meets(bundle, boxes[node]):
            if node < leaves:
                node *= 2
                continue
            for row in range((node - leaves) * size, (node - leaves + 1) * size):
                if _can_cross(bundle, occluders.triangles[row], box):
                    found[count] = row
                    count += 1
        # The next node that is not inside this one.
        node += 1
        while node % 2 == 0:
            node //= 2
        if node == 1:
            return count


@INNER
def _no_span(span):
    """Set span (12,), the least and largest starts and ways of rays, to those of none."""
    for i in range(3):
        span[i], span[6 + i] = np.inf, np.inf
        span[3 + i], span[9 + i] = -np.inf, -np.inf


@INNER
def _widen(start, end, span):
    """Widen span (12,) by the ray between two points (3,)."""
    for i in range(3):
        way = end[i] - start[i]
        span[i], span[3 + i] = min(span[i], start[i]), max(span[3 + i], start[i])
        span[6 + i], span[9 + i] = min(span[6 + i], way), max(span[9 + i], way)


@INNER
def _span(span, bundle):
    """Fill bundle (18,) with the middles and half widths of the starts and ways of a span (12,)."""
    for i in range(3):
        bundle[i], bundle[6 + i] = 0.5 * (span[i] + span[3 + i]), 0.5 * (span[3 + i] - span[i]) + 1e-9
        bundle[3 + i], bundle[9 + i] = 0.5 * (span[6 + i] + span[9 + i]), 0.5 * (span[9 + i] - span[6 + i]) + 1e-9


@INNER
def bundled(starts, ends, count, bundle):
    """Fill bundle (30,) with the rays from starts to ends, (count, 3) each."""
    span = bundle[18:]
    _no_span(span)
    for k in range(count):
        _widen(starts[k], ends[k], span)
    _span(span, bundle)


@PLAIN
def near(occluders, starts, ends, room, found):
    """Fill found (F,) with the triangles within about `room` (m) of rays between places (P, 3) m; return how many."""
    bundle = np.empty(30)
    bundled(starts, ends, len(starts), bundle)
    for i in range(3):
        bundle[6 + i] += room
    return between(occluders, bundle, found)


@PLAIN
def blocked(occluders, starts, ends):
    """Return whether a triangle stands between starts and ends, (P, 3) m each, as (P,) bool."""
    result, found, bundle = np.zeros(len(starts), np.bool_), np.empty(len(occluders.triangles), np.int64), np.empty(30)
    for p in range(len(starts)):
        bundled(starts[p : p + 1], ends[p : p + 1], 1, bundle)
        for f in range(between(occluders, bundle, found)):
            if crosses(occluders.triangles[found[f]], starts[p], ends[p]):
                result[p] = True
                break
    return result


@INNER
def _own(occluders, row, route, leg):
    """Whether a triangle belongs to a facet at which a leg of the route begins or ends."""
    facet = occluders.facet[row]
    return (leg > 0 and facet == route[leg - 1]) or (leg < len(route) and facet == route[leg])


@INNER
def _shadowed(occluders, work, held, counts):
    """Whether a triangle of the lists held (legs, most) blocks a leg of a traced ray; that one is tried first next."""
    for leg in range(len(counts)):
        for f in range(counts[leg]):
            row = held[leg, f]
            if crosses(occluders.triangles[row], work[leg], work[leg + 1]):
                held[leg, f], held[leg, 0] = held[leg, 0], row
                return True
    return False


@INNER
def _gather_leg(occluders, route, leg, bundle, older, found):
    """Fill found (F,) with the triangles that may block a bundle on one leg; return their number.

    older: a list that holds them all, empty to look for them in the tree.
    """
    kept, box = 0, bundle[12:18]
    if len(older) == 0:
        older = found[: between(occluders, bundle, found)]
    for f in range(len(older)):
        if not _own(occluders, older[f], route, leg) and _can_cross(bundle, occluders.triangles[older[f]], box):
            found[kept] = older[f]
            kept += 1
    return kept


@INNER
def _stops(facets, occluders, row, start, end):
    """Whether the triangle of this row, or its facet where that is convex, lies between two points (3,)."""
    facet = occluders.facet[row]
    if not facets.convex[facet]:
        return crosses(occluders.triangles[row], start, end)
    for other in range(facets.first[facet], facets.first[facet + 1]):
        if crosses(facets.triangles[other], start, end):
            return True
    return False


@INNER
def _dark(facets, occluders, starts, ends, rows):
    """Whether one of the triangles `rows`, alone or with its convex facet, blocks all rays of a block.

    starts, ends: (C, 3), of the rays to a box's corners; these decide, since the shadow of a convex shape is convex.
    """
    for row in rows:
        every = True
        for k in range(len(starts)):
            every = every and _stops(facets, occluders, row, starts[k], ends[k])
        if every:
            return True
    return False


@PLAIN
def hidden(facets, occluders, which, corners):
    """Return for facets `which` (B,) whether one convex surface hides all of it from a whole box, corners (8, 3) m."""
    result, bundle = np.zeros(len(which), np.bool_), np.empty(30)
    held, rays = np.empty(len(occluders.triangles), np.int64), np.empty((32, 2, 3))
    for b in range(len(which)):
        facet, kept = which[b], 0
        if facets.first[facet] == facets.first[facet + 1]:
            continue
        for k in range(32):
            a, b_ = facets.half[facet, 0] * (1 - 2 * (k // 8 % 2)), facets.half[facet, 1] * (1 - 2 * (k // 16))
            for i in range(3):
                rays[k, 0, i] = corners[k % 8, i]
                rays[k, 1, i] = facets.centre[facet, i] + a * facets.across[facet, i] + b_ * facets.up[facet, i]
        bundled(rays[:, 0], rays[:, 1], 32, bundle)
        for f in range(between(occluders, bundle, held)):
            if occluders.facet[held[f]] != facet:
                held[kept] = held[f]
                kept += 1
        result[b] = _dark(facets, occluders, rays[:, 0], rays[:, 1], held[:kept])
    return result


@INNER
def _trace_rays(scene, places, work, depth, known, present, first_only):
    """Do the work of `_trace_blocks` for one block of places (n, 1, 3), ray by ray.

    known: whether work holds, at this depth, lists of the triangles that can be in the way.
    """
    facets, occluders, route, station = scene
    held, counts, _, _, ray, bundle, _ = work
    legs, met, any_ray, spans = len(route) + 1, False, False, bundle[18:]
    for leg in range(legs):
        _no_span(spans[12 * leg : 12 * leg + 12])
    for n in range(len(places)):
        if trace_ray(facets, route, station, places[n, 0], ray, True) == 0:
            any_ray = True
            for leg in range(legs):
                _widen(ray[leg], ray[leg + 1], spans[12 * leg : 12 * leg + 12])
    if not any_ray:
        return False
    lists, lengths = held[depth + 1], counts[depth + 1, :legs]
    for leg in range(legs):
        _span(spans[12 * leg : 12 * leg + 12], bundle)
        older = held[depth, leg, : counts[depth, leg] if known else 0]
        lengths[leg] = 0 if known and len(older) == 0 else _gather_leg(occluders, route, leg, bundle, older, lists[leg])
    for n in range(len(places)):
        if trace_ray(facets, route, station, places[n, 0], ray, True) == 0 and not _shadowed(
            occluders, ray, lists, lengths
        ):
            present[n, 0] = met = True
            if first_only:
                return True
    return met


@INNER
def _cut(facets, k, low, high):
    """Cut a box (3,) to (3,) to that around facet k; return whether they meet."""
    for i in range(3):
        reach = abs(facets.across[k, i]) * facets.half[k, 0] + abs(facets.up[k, i]) * facets.half[k, 1] + 1e-6
        low[i], high[i] = max(low[i], facets.centre[k, i] - reach), min(high[i], facets.centre[k, i] + reach)
    return low[0] <= high[0] and low[1] <= high[1] and low[2] <= high[2]


@INNER
def _leg_bundled(facets, route, leg, corners, bundle):
    """Fill bundle (54,) with the rays of one leg of a block between corners (8, 5, 3), as far as they meet the facets.

    Near the plane of a facet the corners' rays meet it far outside of its rim. Returns whether any ray is left.
    """
    span, low, high = bundle[18:30], bundle[30:33], bundle[33:36]
    bundled(corners[:, leg], corners[:, leg + 1], 8, bundle)
    for i in range(3):
        low[i], high[i] = np.inf, -np.inf
        for k in range(8):
            low[i], high[i] = min(low[i], corners[k, leg + 1, i]), max(high[i], corners[k, leg + 1, i])
    for end in range(2):
        at = leg - 1 + end
        if at < 0 or at == len(route) or facets.first[route[at]] == facets.first[route[at] + 1]:
            continue
        if not _cut(facets, route[at], low if end else span[:3], high if end else span[3:6]):
            return False
    for i in range(3):
        span[6 + i], span[9 + i] = max(span[6 + i], low[i] - span[3 + i]), min(span[9 + i], high[i] - span[i])
    _span(span, bundle)
    return True


@INNER
def _shadow_lists(scene, work, depth, parent):
    """Fill the lists at a depth with the triangles that can be in the way of a block; return their number, -1 where one
    convex surface is in the way of all rays, or where no ray meets all facets.

    parent: the depth of lists that hold them all, -1 for none.
    """
    (facets, occluders, route, _), (held, counts, _, corners, _, bundle, _) = scene, work
    total = 0
    for leg in range(len(route) + 1):
        counts[depth, leg] = 0
        if parent < 0 or counts[parent, leg] > 0:
            if not _leg_bundled(facets, route, leg, corners, bundle):
                return -1
            older = held[max(parent, 0), leg, : counts[parent, leg] if parent >= 0 else 0]
            counts[depth, leg] = _gather_leg(occluders, route, leg, bundle, older, held[depth, leg])
        total += counts[depth, leg]
        rows = held[depth, leg, : counts[depth, leg]]
        if _dark(facets, occluders, corners[:, leg], corners[:, leg + 1], rows):
            return -1
    return total


@INNER
def _bounds(scene, boxes, begin, end, work):
    """Trace the rays to the corners of the box around blocks `begin` to `end`, and keep their corners in work.

    Returns 0 where no ray can reach the box by all facets of the route, 1 where the corners bound all rays between
    them, and 2 where they do not.
    """
    facets, _, route, station = scene
    _, _, _, corners, ray, _, box = work
    low, high, middle = box[0], box[1], box[2]
    for i in range(3):
        low[i], high[i] = np.inf, -np.inf
        for c in range(begin, end):
            low[i], high[i] = min(low[i], boxes[c, 0, i]), max(high[i], boxes[c, 1, i])
    if misses(facets, route, station, low, high, corners, ray):
        return 0
    most, least, whole = 0, 9, True
    for k in range(8):
        for i in range(3):
            middle[i] = high[i] if (k >> i) & 1 else low[i]
        fault = trace_ray(facets, route, station, middle, ray, False)
        # Rays that only end on the wrong side of a facet still bound those between them.
        most, least, whole = max(most, fault), min(least, fault), whole and (fault == 0 or fault > 4)
        for row in range(5):
            for i in range(3):
                corners[k, row, i] = ray[row, i]
    if most == least and most > 0:
        return 0
    return 1 if whole else 2


@INNER
def _trace_blocks(scene, places, boxes, block, work, present, first_only):
    """Set present (R, 1) to True where a ray reaches a place, see `trace`; return whether any does.

    scene: facets, occluders, route and station; work: lists held (D, 3, F) and their lengths counts (D, 3) by depth,
    stack (64, 4), all int64; corners (8, 5, 3), ray (8, 3), bundle (54,), box (3, 3); first_only: stop at the first
    place.
    """
    stack, top, met = work[2], 1, False
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = 0, len(boxes), 0, -1
    while top > 0 and not (met and first_only):
        top -= 1
        begin, end, depth, parent = stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3]
        bounded = _bounds(scene, boxes, begin, end, work)
        found = _shadow_lists(scene, work, depth, parent) if bounded == 1 else 1
        if bounded == 0 or found < 0:
            continue
        if found > 0 and end - begin > 1:
            for half in range(2):
                stack[top, 0] = (begin + end) // 2 if half else begin
                stack[top, 1] = end if half else (begin + end) // 2
                stack[top, 2], stack[top, 3] = depth + 1, depth if bounded == 1 else -1
                top += 1
            continue
        some, free = places[begin * block : end * block], present[begin * block : end * block]
        met = _trace_rays(scene, some, work, depth, bounded == 1, free, first_only) or met
    return met


@ALLOCATING
def _work(count, blocks):
    """The work space of `_trace_blocks` for `count` triangles and a number of blocks."""
    depths = 3
    while blocks > 0:
        depths, blocks = depths + 1, blocks // 2
    return (
        np.empty((depths, 3, count), np.int64), np.zeros((depths, 3), np.int64),
        np.empty((64, 4), np.int64), np.empty((8, 5, 3)), np.empty((8, 3)), np.empty(54), np.empty((3, 3)),
    )  # fmt: skip


@PLAIN
def trace(facets, occluders, route, station, places, boxes, block, present):
    """Set present (R, 1) to True where a ray from the station by the facets of a route reaches a place.

    route: (0 to 2,) facets from the station on; places: (R, 1, 3) m; boxes (C, 2, 3): low and high corners around
    `block` places each.
    """
    work = _work(len(occluders.triangles), len(boxes))
    _trace_blocks((facets, occluders, route, station), places, boxes, block, work, present, False)


@PLAIN
def reaching(facets, occluders, routes, station, places, boxes, block):
    """Return which routes (P, 1 or 2), facets from the station on, reach any place, (P,) bool; others as in `trace`."""
    work = _work(len(occluders.triangles), len(boxes))
    present, result = np.empty(places.shape[:2], np.bool_), np.zeros(len(routes), np.bool_)
    for p in range(len(routes)):
        scene = facets, occluders, routes[p], station
        result[p] = _trace_blocks(scene, places, boxes, block, work, present, True)
    return result
