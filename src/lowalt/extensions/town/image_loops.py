"""The compiled loops of `image_paths`: which facets may reflect a wave to a target, where, and how much of it.

A reflected ray is a straight line from the station's image to the point, or from the station to the point's image.
"""

import math

import numpy as np

from lowalt.machine.jit import INNER, PLAIN

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
    inside = facets.outward[k] * here < 0.0
    if here < 0.0:
        here, there = -here, -there
    if inside or here == 0.0 or there <= -radius:
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
def ordered_pairs(facets, firsts, source, radii):
    """Return the pairs (P, 2) of facets such that the first may reflect a ray from a source to the second.

    firsts: (K,) bool, which may come first; radii: (K,) m, around the facets' centres, infinite for the ground.
    """
    size, count = 1024, 0
    found, image = np.empty((size, 2), np.int64), np.empty(3)
    for a in range(len(radii)):
        if not firsts[a]:
            continue
        mirror(facets, a, source, image)
        for b in range(len(radii)):
            if facets.outward[b] * _height(facets, b, image) < 0.0:
                continue
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
def trace_ray(facets, route, station, point, work, clip):
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
def _passes(facets, k, source, ends):
    """Whether the places of reflection at facet k of all rays from a source to a box lie on one side of the facet.

    ends: (8, 5, 3) m; column 0 holds the box's corners, in binary order of the axes. A projection keeps convex sets
    convex, so the corners of the part of the box on the source's side bound them.
    """
    here = _height(facets, k, source)
    sign, across, up = 1.0 if here > 0.0 else -1.0, facets.across[k], facets.up[k]
    here *= sign
    a, b = 0.0, 0.0
    for i in range(3):
        off = source[i] - facets.centre[k, i]
        a, b = a + across[i] * off, b + up[i] * off
    for c in range(8):
        # Columns 1 and 2: height over the plane, and the foot in it.
        end, x, y = ends[c, 0], 0.0, 0.0
        for i in range(3):
            off = end[i] - facets.centre[k, i]
            x, y = x + across[i] * off, y + up[i] * off
        ends[c, 1, 0], ends[c, 2, 0], ends[c, 2, 1] = sign * _height(facets, k, end), x, y
    least_a, most_a, least_b, most_b = np.inf, -np.inf, np.inf, -np.inf
    for c in range(8):
        there = ends[c, 1, 0]
        if there <= 0.0:
            continue
        for j in range(4):
            # The last one is the corner itself, the others are places where edges from it end in the plane.
            other = c ^ (1 << j) if j < 3 else c
            share, beyond = here / (here + there), ends[other, 1, 0]
            x, y = ends[c, 2, 0], ends[c, 2, 1]
            if j < 3:
                if beyond > 0.0:
                    continue
                part, share = there / (there - beyond), 1.0
                x, y = x + part * (ends[other, 2, 0] - x), y + part * (ends[other, 2, 1] - y)
            x, y = a + share * (x - a), b + share * (y - b)
            least_a, most_a, least_b, most_b = min(least_a, x), max(most_a, x), min(least_b, y), max(most_b, y)
    half, some = facets.half[k], here > 0.0 and facets.outward[k] * sign >= 0.0 and most_a > -np.inf
    return not (some and least_a <= half[0] and most_a >= -half[0] and least_b <= half[1] and most_b >= -half[1])


@INNER
def misses(facets, route, station, low, high, ends, work):
    """Whether surely no ray from a station by the facets of a route ends in the box between two corners (3,) m.

    False does not say that one does. ends: work space (8, 5, 3), work: (8, 3).
    """
    source = work[0]
    for i in range(3):
        source[i] = station[i]
    for k in range(len(route)):
        for c in range(8):
            for i in range(3):
                ends[c, 0, i] = high[i] if (c >> i) & 1 else low[i]
            for later in range(len(route) - 1, k, -1):
                mirror(facets, route[later], ends[c, 0], ends[c, 0])
        if _passes(facets, route[k], source, ends):
            return True
        mirror(facets, route[k], source, source)
    return False


@PLAIN
def fitting(facets, routes, station, low, high):
    """Return those of the routes (P, 1 or 2) by which rays from a station may end in the box between two corners (3,).

    Spheres around the box sort out most of them, before `misses` holds the box itself to the facets.
    """
    target, radius, found = 0.5 * (low + high), 0.0, np.empty_like(routes)
    images, ends, work = np.empty((len(facets.offset), 3)), np.empty((8, 5, 3)), np.empty((8, 3))
    source, count, latest = station.copy(), 0, -1
    for i in range(3):
        radius += (0.5 * (high[i] - low[i])) ** 2
    radius = math.sqrt(radius)
    for k in range(len(images)):
        mirror(facets, k, target, images[k])
    for p in range(len(routes)):
        first, last = routes[p, 0], routes[p, -1]
        if routes.shape[1] == 2:
            if not _reaches(facets, first, station, images[last], radius):
                continue
            if first != latest:
                mirror(facets, first, station, source)
                latest = first
        if _reaches(facets, last, source, target, radius) and not misses(
            facets, routes[p], station, low, high, ends, work
        ):
            found[count] = routes[p]
            count += 1
    return found[:count].copy()


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
