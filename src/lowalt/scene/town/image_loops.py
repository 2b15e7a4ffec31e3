"""The compiled loops of `image_paths`: which facets may reflect a wave to a target, where, and how much of it.

A reflected ray is a straight line from the station's image to the point, or from the station to the point's image.
"""

import math

import numpy as np

from lowalt.machine.jit import INNER, PLAIN


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
    """Return the pairs (P, 2) of facets such that the first may reflect a ray from a source to the second.

    firsts: (K,) bool, which may come first; radii: (K,) m, around the facets' centres, infinite for the ground.
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
