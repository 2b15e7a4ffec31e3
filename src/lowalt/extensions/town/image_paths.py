"""Paths between a station and a target in a town.

They are direct, past edges, and by one or two facets or the ground.

Three steps find the reflected ones. *Candidates*: the routes over facets that may lead to the
target at all (`candidates`). *Image method*: the rays of each route, every one tested against all
buildings (`traced`). *Fields*: images and coefficients of the rays that there are (`with_field`).
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from lowalt.extensions.town import (
    candidate_loops,
    field_loops,
    image_loops,
    knife_edge,
    shadow_loops,
)
from lowalt.extensions.town.facets import Town
from lowalt.extensions.town.materials import properties
from lowalt.scene.fresnel import VACUUM_F_M

BLOCK = 64
"""Rays that are traced together at least."""
STEP = 8
"""Symbols of which one decides which rays exist."""


class Route(NamedTuple):
    """A path.

    facets: (0 to 2), from the station on; images: (N, L, 3) m, where the station sees the points;
    coefficient: (N, L) complex, 0 where there is no ray; station_m: (3,), where the points see the
    station.
    """

    facets: tuple[int, ...]
    images: np.ndarray
    coefficient: np.ndarray
    station_m: np.ndarray


class TracedRays(NamedTuple):
    """The rays that decide which points are reached.

    places (R, 1, 3) m: where they end; of_point (N, L): the ray that decides for each point and
    symbol; boxes (C, 2, 3) m: low and high corners around the ends of BLOCK rays each.
    """

    places: np.ndarray
    of_point: np.ndarray
    boxes: np.ndarray


def _ends_in_cells(points: np.ndarray, cell_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return one end (R, 3) m in each occupied cell of a grid, and the end (N, L) of each point.

    points: (N, L, 3) m; STEP symbols share their ends.
    """
    count = len(points)
    # The middle one of the symbols that share rays.
    middles = np.arange(STEP // 2, count + STEP // 2, STEP)
    some = points[np.minimum(middles, count - 1)]
    cells = np.floor(some / cell_m).astype(np.int64)
    cells -= cells.min(axis=(0, 1))
    sizes = cells.max(axis=(0, 1)) + 1
    keys = np.arange(len(some))[:, None]
    for axis in range(3):
        keys = keys * sizes[axis] + cells[..., axis]
    _, first, which = np.unique(keys, return_index=True, return_inverse=True)
    ends = some.reshape(-1, 3)[first]
    of_point = np.repeat(which.reshape(keys.shape), STEP, axis=0)[:count]
    return ends, of_point


def rays_to(places: np.ndarray, cell_m: float) -> TracedRays:
    """Return one ray for the points that are in one cell of a grid.

    places: (N, L, 3) m, the points; cell_m: the cell's edge (m), 0 for one ray for each point and
    symbol; STEP symbols share their rays.
    """
    if cell_m == 0.0:
        ends = places.reshape(-1, 3)
        of_point = np.arange(len(ends)).reshape(places.shape[:2])
    else:
        ends, of_point = _ends_in_cells(places, cell_m)
    starts = np.arange(0, len(ends), BLOCK)
    low = np.minimum.reduceat(ends, starts)
    high = np.maximum.reduceat(ends, starts)
    boxes = np.stack([low, high], axis=1)
    return TracedRays(np.ascontiguousarray(ends[:, None]), of_point, boxes)


def epsilons(town: Town, frequency_hz: float, where: str) -> np.ndarray:
    """Return the complex relative permittivity (K,) of each facet, for fields exp(+j 2 pi f t).

    Raises: InputError naming `where` for a material that is not known at this frequency.
    """
    of_material = []
    for name in town.materials:
        permittivity, conductivity = properties(name, frequency_hz, where)
        loss = conductivity / (2 * np.pi * frequency_hz * VACUUM_F_M)
        of_material.append(permittivity - 1j * loss)
    return np.array(of_material)[town.material]


def _pairs(town: Town, station_m: np.ndarray) -> np.ndarray:
    """The pairs (P, 2) of facets by which a ray from a station may go on.

    They hold for all targets.
    """
    key = tuple(station_m.tolist())
    facets = town.facets
    if key not in town.pairs:
        every_facet = np.arange(len(facets.offset))
        at_station = np.repeat(station_m[None], 8, axis=0)
        seen_first = ~candidate_loops.hidden(facets, town.occluders, every_facet, at_station)
        radii = np.hypot(*facets.half.T)
        town.pairs[key] = candidate_loops.ordered_pairs(facets, seen_first, station_m, radii)
    return town.pairs[key]


def _unhidden(town: Town, routes: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The routes whose last facet is not hidden from the whole box between two corners (3,) m."""
    axes = np.meshgrid(*zip(low, high, strict=True), indexing="ij")
    corners = np.stack(axes, axis=-1).reshape(8, 3)
    last, which = np.unique(routes[:, -1], return_inverse=True)
    hidden = candidate_loops.hidden(town.facets, town.occluders, last, corners)
    return routes[~hidden[which]]


def candidates(
    town: Town, station_m: np.ndarray, places: np.ndarray, order: int
) -> list[np.ndarray]:
    """Return the routes of each of 1 to `order` facets, (P, order) int64.

    They may lead from a station (3,) m to places (N, L, 3) m.
    """
    low = places.min(axis=(0, 1))
    high = places.max(axis=(0, 1))
    routes = []
    if order >= 1:
        routes.append(np.arange(len(town.facets.offset))[:, None])
    if order >= 2:
        routes.append(_pairs(town, station_m))
    result = []
    for one in routes:
        fitting = candidate_loops.fitting(town.facets, one, station_m, low, high)
        result.append(_unhidden(town, fitting, low, high))
    return result


def seen(town: Town, station_m: np.ndarray, rays: TracedRays, facets: np.ndarray) -> np.ndarray:
    """Return which points a ray from a station reaches past all buildings, (N, L) bool.

    facets: (0 to 2,), those that reflect it.
    """
    path = shadow_loops.RayPath(town.facets, town.occluders, facets, station_m)
    present = np.zeros((len(rays.places), 1), bool)
    shadow_loops.trace(path, rays.places, rays.boxes, BLOCK, present)
    return present[:, 0][rays.of_point]


def traced(
    town: Town, station_m: np.ndarray, rays: TracedRays, routes: np.ndarray
) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield the routes (P, 1 or 2) that reach any point, each with which points, (N, L) bool."""
    reaching = shadow_loops.reaching(
        town.facets, town.occluders, routes, station_m, rays.places, rays.boxes, BLOCK
    )
    for route in routes[reaching]:
        yield route, seen(town, station_m, rays, route)


def with_field(
    town: Town,
    epsilon: np.ndarray,
    station_m: np.ndarray,
    places: np.ndarray,
    route: np.ndarray,
    present: np.ndarray,
) -> Route:
    """Return the path by a route (0 to 2,), with images and coefficients.

    present: (N, L), where there is a ray; others as in `reflected`.
    """
    images = np.empty((len(places), 3, places.shape[1]))
    coefficient = np.empty(present.shape, np.complex128)
    field_loops.coefficients(
        town.facets, epsilon, route, station_m, places, present, images, coefficient
    )
    behind = station_m.copy()
    for k in route:
        image_loops.mirrored(town.facets, k, behind)
    return Route(tuple(route.tolist()), images.swapaxes(1, 2), coefficient, behind)


def reflected(
    town: Town,
    epsilon: np.ndarray,
    station_m: np.ndarray,
    places: np.ndarray,
    rays: TracedRays,
    order: int,
) -> list[Route]:
    """Return the paths by 1 to `order` reflections that reach any of the points.

    places: (N, L, 3) m, C-contiguous.

    epsilon: (K,) complex permittivity of the facets. Source: image method and Fresnel's
    coefficients, Balanis, Advanced Engineering Electromagnetics, sections 5.3 and 7.4.
    """
    result = []
    for routes in candidates(town, station_m, rays.places, order):
        for route, present in traced(town, station_m, rays, routes):
            result.append(with_field(town, epsilon, station_m, places, route, present))
    return result


def direct(
    town: Town,
    station_m: np.ndarray,
    places: np.ndarray,
    rays: TracedRays,
    wavelength_m: float,
    diffraction: bool,
) -> tuple[np.ndarray, np.ndarray]:
    """Return where the direct ray is free, (N, L) bool, and its field, (N, L) complex.

    The field is given over that in free space.
    """
    lit = seen(town, station_m, rays, np.empty(0, np.int64))
    if not diffraction:
        return lit, lit.astype(np.complex128)
    return lit, knife_edge.direct(town, station_m, places, lit, wavelength_m)
