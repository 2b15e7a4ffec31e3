"""The compiled loops of `image_paths`: which facets reflect a wave to a target, where, and how much of it.

A reflected ray is a straight line from the station's image to the point, or from the station to the point's image. A
block is the points of a target in a few successive symbols. Blocks that cannot be reached are dropped whole, blocks
that nothing can shadow are kept whole, and others are halved until single rays decide.
"""

import math

import numpy as np

from lowalt.machine.jit import INNER, PLAIN, kernel
from lowalt.scene.rays_loops import can_meet

ALLOCATING = kernel(inner=True)
"""For functions that only kernels call and that make arrays."""
ROOM = 1e-9
"""Share of a ray next to its ends in which no triangle blocks it."""


@INNER
def _height(facets, k, point):
    """Height (m) of a point over the plane of facet k."""
    normal = facets.normal[k]
    return normal[0] * point[0] + normal[1] * point[1] + normal[2] * point[2] - facets.offset[k]


@INNER
def mirror(facets, k, point, image):
    """Set image (3,) to the mirror image of a point in the plane of facet k."""
    height, normal = _height(facets, k, point), facets.normal[k]
    for i in range(3):
        image[i] = point[i] - 2.0 * height * normal[i]


@PLAIN
def mirrored(facets, k, point):
    """Replace a point (3,) by its mirror image in the plane of facet k."""
    mirror(facets, k, point, point)


@INNER
def _reaches(facets, k, source, target, radius):
    """Whether facet k may reflect a ray from a source to any point within `radius` (m) of a target."""
    here, there = _height(facets, k, source), _height(facets, k, target)
    if here < 0.0:
        here, there = -here, -there
    if here == 0.0 or there <= -radius:
        return False
    least = here + there - radius
    if facets.first[k] == facets.first[k + 1] or least <= 0.0:
        return True
    share, across, up = here / (here + there), facets.across[k], facets.up[k]
    a, b, way_a, way_b = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        off, way = source[i] - facets.centre[k, i], target[i] - source[i]
        a, way_a = a + across[i] * off, way_a + across[i] * way
        b, way_b = b + up[i] * off, way_b + up[i] * way
    # By how much the place of reflection moves at most if the target moves by the radius.
    room = here * radius / least * (1.0 + math.sqrt(way_a * way_a + way_b * way_b) / (here + there))
    return abs(a + share * way_a) <= facets.half[k, 0] + room and abs(b + share * way_b) <= facets.half[k, 1] + room


@PLAIN
def single(facets, source, target, radius):
    """Return the numbers of the facets that may reflect a ray from a source (3,) to within `radius` of a target."""
    found = np.empty(len(facets.offset), np.int64)
    count = 0
    for k in range(len(found)):
        if _reaches(facets, k, source, target, radius):
            found[count] = k
            count += 1
    return found[:count]


@PLAIN
def ordered_pairs(facets, firsts, source, radii):
    """Return the pairs (P, 2) of facets, first and second, by which a ray from a source may go on at all.

    firsts: (K,) bool, which may come first; radii: (K,) m, around the facets' centres, infinite for the ground. The
    second must be reached by way of the first.
    """
    size, count = 1024, 0
    found = np.empty((size, 2), np.int64)
    for a in range(len(radii)):
        if not firsts[a]:
            continue
        for b in range(len(radii)):
            if a == b or not _reaches(facets, a, source, facets.centre[b], radii[b]):
                continue
            if count == size:
                size *= 2
                larger = np.empty((size, 2), np.int64)
                larger[:count] = found
                found = larger
            found[count, 0], found[count, 1] = a, b
            count += 1
    return found[:count].copy()


@PLAIN
def double(facets, pairs, source, target, radius):
    """Return those of the pairs (P, 2) that may reflect a ray from a source to within `radius` of a target."""
    found = np.empty((len(pairs), 2), np.int64)
    images = np.empty((len(facets.offset), 3))
    first, count, last = np.empty(3), 0, -1
    for b in range(len(images)):
        mirror(facets, b, target, images[b])
    for p in range(len(pairs)):
        a, b = pairs[p, 0], pairs[p, 1]
        if not _reaches(facets, a, source, images[b], radius):
            continue
        if a != last:
            mirror(facets, a, source, first)
            last = a
        if _reaches(facets, b, first, target, radius):
            found[count, 0], found[count, 1] = a, b
            count += 1
    return found[:count].copy()


@INNER
def _inside(facets, k, point):
    """Whether a point in the plane of facet k lies in one of its triangles; the ground has no end."""
    first, last = facets.first[k], facets.first[k + 1]
    if first == last:
        return True
    for row in range(first, last):
        t = facets.triangles[row]
        x, y, z = point[0] - t[0], point[1] - t[1], point[2] - t[2]
        aa, bb = t[3] * t[3] + t[4] * t[4] + t[5] * t[5], t[6] * t[6] + t[7] * t[7] + t[8] * t[8]
        ab = t[3] * t[6] + t[4] * t[7] + t[5] * t[8]
        pa, pb = x * t[3] + y * t[4] + z * t[5], x * t[6] + y * t[7] + z * t[8]
        whole, u, v = aa * bb - ab * ab, pa * bb - pb * ab, pb * aa - pa * ab
        if u >= 0.0 and v >= 0.0 and u + v <= whole:
            return True
    return False


@INNER
def crosses(t, start, end):
    """Whether a triangle (9,) lies between two points (3,): Moeller & Trumbore 1997."""
    u, v, w = end[0] - start[0], end[1] - start[1], end[2] - start[2]
    o0, o1, o2 = start[0] - t[0], start[1] - t[1], start[2] - t[2]
    h0, h1, h2 = v * t[8] - w * t[7], w * t[6] - u * t[8], u * t[7] - v * t[6]
    q0, q1, q2 = o1 * t[5] - o2 * t[4], o2 * t[3] - o0 * t[5], o0 * t[4] - o1 * t[3]
    turned = t[3] * h0 + t[4] * h1 + t[5] * h2
    sign = 1.0 if turned > 0.0 else -1.0
    whole = sign * turned
    first, second = sign * (o0 * h0 + o1 * h1 + o2 * h2), sign * (u * q0 + v * q1 + w * q2)
    way = sign * (t[6] * q0 + t[7] * q1 + t[8] * q2)
    met = first >= 0.0 and second >= 0.0 and first + second <= whole
    return met and way > ROOM * whole and way < (1.0 - ROOM) * whole


@INNER
def _can_cross(bundle, t, box):
    """Whether a bundle of rays may cross the box around a triangle (9,); box: work space (6,)."""
    for i in range(3):
        box[i] = t[i] + min(0.0, min(t[3 + i], t[6 + i])) - 1e-9
        box[3 + i] = t[i] + max(0.0, max(t[3 + i], t[6 + i])) + 1e-9
    return can_meet(bundle, box)


@INNER
def between(occluders, bundle, found, most):
    """Fill found with the triangles that a bundle of rays may cross, up to `most`; return their number, -1 for more.

    bundle: the first twelve as in `rays_loops.can_meet`, the others are work space.
    """
    boxes, count, box = occluders.boxes, 0, bundle[12:18]
    leaves, node = len(boxes) // 2, 1
    size = len(occluders.triangles) // leaves
    while True:
        if can_meet(bundle, boxes[node]):
            if node < leaves:
                node *= 2
                continue
            for row in range((node - leaves) * size, (node - leaves + 1) * size):
                if _can_cross(bundle, occluders.triangles[row], box):
                    if count == most:
                        return -1
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
    """Fill bundle (18,) with the rays of a span (12,): middles and spans of starts and ways."""
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
    """Fill found (F,) with the triangles within about `room` (m) of rays from starts to ends, (P, 3) m; return how many."""
    bundle = np.empty(30)
    bundled(starts, ends, len(starts), bundle)
    for i in range(3):
        bundle[6 + i] += room
    return between(occluders, bundle, found, len(found))


@PLAIN
def blocked(occluders, starts, ends):
    """Return whether a triangle stands between starts and ends, (P, 3) m each, as (P,) bool."""
    result, found, bundle = np.zeros(len(starts), np.bool_), np.empty(len(occluders.triangles), np.int64), np.empty(30)
    for p in range(len(starts)):
        bundled(starts[p : p + 1], ends[p : p + 1], 1, bundle)
        for f in range(between(occluders, bundle, found, len(found))):
            if crosses(occluders.triangles[found[f]], starts[p], ends[p]):
                result[p] = True
                break
    return result


@INNER
def _trace(facets, route, station, point, work, clip):
    """Fill work (8, 3) for one point: its corners along the ray, rows 0 to len(route) + 1, and its image, row 7.

    clip: whether the ray must meet the facets, not their planes alone. Returns 0 where there is such a ray, else the
    number of the condition that fails; for each number, the points that fail by it alone form a convex set.
    """
    count, image, behind = len(route), work[7], work[6]
    for i in range(3):
        work[0, i], work[count + 1, i], image[i], behind[i] = station[i], point[i], point[i], station[i]
    for k in range(count - 1, -1, -1):
        mirror(facets, route[k], image, image)
    # From the station on, each facet in turn: the ray goes straight from the station's image to what it meets next.
    for k in range(count):
        for i in range(3):
            work[5, i] = point[i]
        for later in range(count - 1, k, -1):
            mirror(facets, route[later], work[5], work[5])
        here, there = _height(facets, route[k], behind), _height(facets, route[k], work[5])
        if here * there <= 0.0:
            return 1 + k
        share = here / (here + there)
        mirror(facets, route[k], work[5], work[5])
        for i in range(3):
            work[k + 1, i] = behind[i] + share * (work[5, i] - behind[i])
        if clip and not _inside(facets, route[k], work[k + 1]):
            return 9
        mirror(facets, route[k], behind, behind)
    # Each corner must be reached from the side on which the ray goes on.
    for k in range(count):
        if _height(facets, route[k], work[k]) * _height(facets, route[k], work[k + 2]) <= 0.0:
            return 5 + k
    return 0


@INNER
def _copy(ray, corners):
    """Copy the corners (5, 3) of a traced ray."""
    for k in range(5):
        for i in range(3):
            corners[k, i] = ray[k, i]


@INNER
def _misses(facets, route, corners):
    """Whether all rays of a block, given by its corners (8, 5, 3), pass a facet of the route on one side."""
    for k in range(len(route)):
        facet = route[k]
        for axis in range(2):
            way, least, most = (facets.up if axis else facets.across)[facet], np.inf, -np.inf
            for c in range(8):
                off = 0.0
                for i in range(3):
                    off += way[i] * (corners[c, k + 1, i] - facets.centre[facet, i])
                least, most = min(least, off), max(most, off)
            if least > facets.half[facet, axis] or most < -facets.half[facet, axis]:
                return True
    return False


@INNER
def _own(occluders, row, route, leg):
    """Whether a triangle belongs to a facet at which a leg of the route begins or ends."""
    facet = occluders.facet[row]
    return (leg > 0 and facet == route[leg - 1]) or (leg < len(route) and facet == route[leg])


@INNER
def _shadowed(occluders, work, held, counts, hints):
    """Whether a triangle of the lists held (legs, most) blocks a leg of a traced ray; the last to do so comes first."""
    legs, last = len(counts), hints[-1]
    for k in range(legs):
        leg = (k + last) % legs
        for f in range(counts[leg]):
            row = held[leg, f]
            if crosses(occluders.triangles[row], work[leg], work[leg + 1]):
                held[leg, f], held[leg, 0], hints[-1] = held[leg, 0], row, leg
                return True
    return False


@INNER
def _gather_leg(occluders, route, leg, bundle, older, found):
    """Fill found (F,) with the triangles that may block a bundle on one leg; return their number.

    older: a list that holds them all, empty to look for them in the tree.
    """
    kept, box = 0, bundle[12:18]
    if len(older) == 0:
        for f in range(between(occluders, bundle, found, len(found))):
            if not _own(occluders, found[f], route, leg):
                found[kept] = found[f]
                kept += 1
        return kept
    for f in range(len(older)):
        if _can_cross(bundle, occluders.triangles[older[f]], box):
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
    """The first of some triangles that alone, or by its convex facet, blocks all rays of a block; -1 for none.

    starts, ends: (C, 3), of the rays to the corners of a box: a convex surface's shadow is convex.
    """
    for row in rows:
        every = True
        for k in range(len(starts)):
            every = every and _stops(facets, occluders, row, starts[k], ends[k])
        if every:
            return row
    return -1


@PLAIN
def hidden(facets, occluders, which, corners):
    """Return which of some facets (B,) a single convex surface hides whole from all of a box, corners (8, 3) m."""
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
        for f in range(between(occluders, bundle, held, len(held))):
            if occluders.facet[held[f]] != facet:
                held[kept] = held[f]
                kept += 1
        result[b] = _dark(facets, occluders, rays[:, 0], rays[:, 1], held[:kept]) >= 0
    return result


@INNER
def _trace_rays(facets, occluders, route, station, places, work, depth, known, present, first_only):
    """Do as `_trace_blocks` for a block of places (n, 1, 3) by single rays.

    known: whether work holds, at this depth, lists of the triangles that can be in the way.
    """
    held, counts, hints, _, _, ray, bundle, _ = work
    legs, met, any_ray, spans, total = len(route) + 1, False, False, bundle[18:], 0
    for leg in range(legs):
        _no_span(spans[12 * leg : 12 * leg + 12])
    for n in range(len(places)):
        if _trace(facets, route, station, places[n, 0], ray, True) == 0:
            any_ray = True
            for leg in range(legs):
                _widen(ray[leg], ray[leg + 1], spans[12 * leg : 12 * leg + 12])
    if not any_ray:
        return False
    lists, lengths = held[depth + 1], counts[depth + 1, :legs]
    for leg in range(legs):
        _span(spans[12 * leg : 12 * leg + 12], bundle)
        lengths[leg] = 0
        if not known or counts[depth, leg] > 0:
            older = held[depth, leg, : counts[depth, leg] if known else 0]
            lengths[leg] = _gather_leg(occluders, route, leg, bundle, older, lists[leg])
        total += lengths[leg]
    for n in range(len(places)):
        if _trace(facets, route, station, places[n, 0], ray, True) == 0 and (
            total == 0 or not _shadowed(occluders, ray, lists, lengths, hints)
        ):
            present[n, 0] = met = True
            if first_only:
                return True
    return met


@INNER
def _shadow_lists(facets, occluders, route, work, depth, parent):
    """Fill the lists at a depth with the triangles that can be in the way of a block; return their number, -1 where one
    convex surface is in the way of all rays.

    parent: the depth of lists that hold them all, -1 for none.
    """
    held, counts, hints, _, corners, _, bundle, _ = work
    legs, total = len(route) + 1, 0
    for leg in range(legs):
        row = hints[leg]
        if row >= 0 and not _own(occluders, row, route, leg):
            if _dark(facets, occluders, corners[:, leg], corners[:, leg + 1], hints[leg : leg + 1]) >= 0:
                return -1
    for k in range(legs):
        leg = (k + hints[3]) % legs
        counts[depth, leg] = 0
        if parent < 0 or counts[parent, leg] > 0:
            bundled(corners[:, leg], corners[:, leg + 1], 8, bundle)
            older = held[max(parent, 0), leg, : counts[parent, leg] if parent >= 0 else 0]
            counts[depth, leg] = _gather_leg(occluders, route, leg, bundle, older, held[depth, leg])
        total += counts[depth, leg]
        rows = held[depth, leg, : counts[depth, leg]]
        row = _dark(facets, occluders, corners[:, leg], corners[:, leg + 1], rows)
        if row >= 0:
            hints[leg], hints[3] = row, leg
            return -1
    return total


@INNER
def _trace_blocks(facets, occluders, route, station, places, boxes, block, work, present, first_only):
    """Set present (R, 1) to True where a ray reaches a place, see `trace`; return whether any does.

    work: lists held (D, 3, F) and their lengths counts (D, 3) by depth, hints (4,): the last triangle that blocked each
    leg, and the last leg that was; stack (64, 4), all int64; corners (8, 5, 3), ray (8, 3), bundle (54,), box (3, 3);
    first_only: stop at the first place.
    """
    _, _, _, stack, corners, ray, _, box = work
    low, high, middle = box[0], box[1], box[2]
    stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3], top, met = 0, len(boxes), 0, -1, 1, False
    while top > 0:
        top -= 1
        begin, end, depth, parent = stack[top, 0], stack[top, 1], stack[top, 2], stack[top, 3]
        faults, least, whole = 0, 9, True
        for i in range(3):
            low[i], high[i] = np.inf, -np.inf
            for c in range(begin, end):
                low[i], high[i] = min(low[i], boxes[c, 0, i]), max(high[i], boxes[c, 1, i])
        for k in range(8):
            for i in range(3):
                middle[i] = high[i] if (k >> i) & 1 else low[i]
            fault = _trace(facets, route, station, middle, ray, False)
            # Rays that only end on the wrong side of a facet still bound those between them.
            faults, least, whole = max(faults, fault), min(least, fault), whole and (fault == 0 or fault > 4)
            _copy(ray, corners[k])
        if (faults == least and faults > 0) or (whole and _misses(facets, route, corners)):
            continue
        found = 0
        if whole:
            found = _shadow_lists(facets, occluders, route, work, depth, parent)
            if found < 0:
                continue
        if (not whole or found > 0) and end - begin > 1:
            for half in range(2):
                stack[top, 0] = (begin + end) // 2 if half else begin
                stack[top, 1] = end if half else (begin + end) // 2
                stack[top, 2], stack[top, 3] = depth + 1, depth if whole else -1
                top += 1
            continue
        some, free = places[begin * block : end * block], present[begin * block : end * block]
        if _trace_rays(facets, occluders, route, station, some, work, depth, whole, free, first_only):
            met = True
            if first_only:
                break
    return met


@ALLOCATING
def _work(count, blocks):
    """The work space of `_trace_blocks` for `count` triangles and a number of blocks."""
    depths = 3
    while blocks > 0:
        depths, blocks = depths + 1, blocks // 2
    return (
        np.empty((depths, 3, count), np.int64), np.zeros((depths, 3), np.int64), np.array([-1, -1, -1, 0]),
        np.empty((64, 4), np.int64), np.empty((8, 5, 3)), np.empty((8, 3)), np.empty(54), np.empty((3, 3)),
    )  # fmt: skip


@PLAIN
def trace(facets, occluders, route, station, places, boxes, block, present):
    """Set present (R, 1) to True where a ray from the station by the facets of a route reaches a place.

    route: (0 to 2,) facets from the station on; places: (R, 1, 3) m; boxes (C, 2, 3): low and high corners around
    `block` places each.
    """
    work = _work(len(occluders.triangles), len(boxes))
    _trace_blocks(facets, occluders, route, station, places, boxes, block, work, present, False)


@PLAIN
def reaching(facets, occluders, routes, station, places, boxes, block):
    """Return which routes (P, 1 or 2), facets from the station on, reach any of the points (P,); others as in `trace`."""
    work = _work(len(occluders.triangles), len(boxes))
    present, result = np.empty(places.shape[:2], np.bool_), np.zeros(len(routes), np.bool_)
    for p in range(len(routes)):
        result[p] = _trace_blocks(facets, occluders, routes[p], station, places, boxes, block, work, present, True)
    return result


@INNER
def _bounced(normal, epsilon, way, field):
    """Reflect a wave's way (3,) and its complex field (3,) at a plane: Fresnel's coefficients of a lossy half space.

    Fields are split into the part across the plane of incidence and the part in it, whose vertical component counts as
    in `fresnel.fresnel`.
    """
    sine = way[0] * normal[0] + way[1] * normal[1] + way[2] * normal[2]
    s0, s1, s2 = (
        way[1] * normal[2] - way[2] * normal[1], way[2] * normal[0] - way[0] * normal[2],
        way[0] * normal[1] - way[1] * normal[0],
    )  # fmt: skip
    size = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
    if size < 1e-12:
        # At right angles any direction in the plane is across the plane of incidence.
        flat = math.hypot(normal[0], normal[1])
        s0, s1, s2 = (-normal[1] / flat, normal[0] / flat, 0.0) if flat > 1e-12 else (1.0, 0.0, 0.0)
        size = 1.0
    s0, s1, s2 = s0 / size, s1 / size, s2 / size
    p0, p1, p2 = s1 * way[2] - s2 * way[1], s2 * way[0] - s0 * way[2], s0 * way[1] - s1 * way[0]
    across = field[0] * s0 + field[1] * s1 + field[2] * s2
    within = field[0] * p0 + field[1] * p1 + field[2] * p2
    inside, grazing = np.sqrt(epsilon - 1.0 + sine * sine), abs(sine)
    across *= (grazing - inside) / (grazing + inside)
    within *= (grazing * epsilon - inside) / (grazing * epsilon + inside)
    for i in range(3):
        way[i] -= 2.0 * sine * normal[i]
    p0, p1, p2 = s1 * way[2] - s2 * way[1], s2 * way[0] - s0 * way[2], s0 * way[1] - s1 * way[0]
    field[0] = across * s0 + within * p0
    field[1] = across * s1 + within * p1
    field[2] = across * s2 + within * p2


@INNER
def _upright(way, field):
    """Set field (3,) to the direction of vertical polarisation across a way (3,)."""
    flat = math.hypot(way[0], way[1])
    if flat < 1e-12:
        field[0], field[1], field[2] = 1.0, 0.0, 0.0
        return
    field[0], field[1], field[2] = -way[2] * way[0] / flat, -way[2] * way[1] / flat, flat


@PLAIN
def coefficients(facets, epsilons, route, station, places, present, images, result):
    """Fill images (N, 3, L) m, where the station sees the points by a route, and result (N, L), the path's coefficient.

    epsilons: (K,) complex relative permittivity of each facet; present: (N, L), where there is a ray; elsewhere the
    image is given too and the coefficient is 0. Vertical polarisation is sent and counted.
    """
    image, way = np.empty(3), np.empty(3)
    field, sent = np.empty(3, np.complex128), np.empty(3)
    for n in range(places.shape[0]):
        for point in range(places.shape[1]):
            image[:] = places[n, point]
            for k in range(len(route) - 1, -1, -1):
                mirror(facets, route[k], image, image)
            images[n, :, point] = image
            result[n, point] = 0.0
            if not present[n, point]:
                continue
            size = 0.0
            for i in range(3):
                way[i] = image[i] - station[i]
                size += way[i] * way[i]
            size = math.sqrt(size)
            for i in range(3):
                way[i] /= size
            _upright(way, sent)
            for i in range(3):
                field[i] = sent[i]
            for k in range(len(route)):
                _bounced(facets.normal[route[k]], epsilons[route[k]], way, field)
            _upright(way, sent)
            result[n, point] = field[0] * sent[0] + field[1] * sent[1] + field[2] * sent[2]
