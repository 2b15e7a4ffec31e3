"""The fields of reflected rays: Fresnel's coefficients of both polarisations at each facet."""

import math

import numpy as np

from lowalt.extensions.town.image_loops import mirror
from lowalt.machine.jit import INNER, PLAIN

UPRIGHT = 1e-12
"""Below this sine of the angle to a normal or to the vertical, a ray counts as along it."""


@INNER
def _bounced(normal, epsilon, way, field):
    """Reflect a wave's way (3,) and its complex field (3,) at a plane.

    Fresnel's coefficients are those of a lossy half space.

    s is the direction across the plane of incidence, p the one in it and across the way; the field
    along p counts as the vertical one of `fresnel.fresnel`.
    """
    sine = way[0] * normal[0] + way[1] * normal[1] + way[2] * normal[2]
    s0 = way[1] * normal[2] - way[2] * normal[1]
    s1 = way[2] * normal[0] - way[0] * normal[2]
    s2 = way[0] * normal[1] - way[1] * normal[0]
    size = math.sqrt(s0 * s0 + s1 * s1 + s2 * s2)
    if size < UPRIGHT:
        # At right angles any direction in the plane is across the plane of incidence.
        flat = math.hypot(normal[0], normal[1])
        if flat > UPRIGHT:
            s0 = -normal[1] / flat
            s1 = normal[0] / flat
        else:
            s0 = 1.0
            s1 = 0.0
        s2 = 0.0
        size = 1.0
    s0 = s0 / size
    s1 = s1 / size
    s2 = s2 / size
    p0 = s1 * way[2] - s2 * way[1]
    p1 = s2 * way[0] - s0 * way[2]
    p2 = s0 * way[1] - s1 * way[0]
    across = field[0] * s0 + field[1] * s1 + field[2] * s2
    within = field[0] * p0 + field[1] * p1 + field[2] * p2
    inside = np.sqrt(epsilon - 1.0 + sine * sine)
    grazing = abs(sine)
    across *= (grazing - inside) / (grazing + inside)
    within *= (grazing * epsilon - inside) / (grazing * epsilon + inside)
    for i in range(3):
        way[i] -= 2.0 * sine * normal[i]
    p0 = s1 * way[2] - s2 * way[1]
    p1 = s2 * way[0] - s0 * way[2]
    p2 = s0 * way[1] - s1 * way[0]
    field[0] = across * s0 + within * p0
    field[1] = across * s1 + within * p1
    field[2] = across * s2 + within * p2


@INNER
def _vertical(way, field):
    """Set field (3,) to the direction of vertical polarisation across a way (3,)."""
    flat = math.hypot(way[0], way[1])
    if flat < UPRIGHT:
        field[0] = 1.0
        field[1] = 0.0
        field[2] = 0.0
        return
    field[0] = -way[2] * way[0] / flat
    field[1] = -way[2] * way[1] / flat
    field[2] = flat


@PLAIN
def coefficients(facets, epsilons, route, station, points, present, images, result):
    """Fill images (N, 3, L) m and result (N, L), the coefficients of a path.

    The images are where the station sees the points (N, L, 3) m by a route.

    epsilons: (K,) complex relative permittivity of each facet; present: (N, L), where there is a
    ray; elsewhere the image is given too and the coefficient is 0. Vertical polarisation is sent
    and counted.
    """
    image = np.empty(3)
    way = np.empty(3)
    field = np.empty(3, np.complex128)
    vertical = np.empty(3)
    for n in range(points.shape[0]):
        for point in range(points.shape[1]):
            image[:] = points[n, point]
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
            _vertical(way, vertical)
            for i in range(3):
                field[i] = vertical[i]
            for k in range(len(route)):
                _bounced(facets.normal[route[k]], epsilons[route[k]], way, field)
            _vertical(way, vertical)
            result[n, point] = (
                field[0] * vertical[0] + field[1] * vertical[1] + field[2] * vertical[2]
            )
