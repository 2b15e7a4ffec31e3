"""Paths between a station and a target in a town: direct, past edges, and by one or two facets or the ground.

The image method finds reflected rays. Every ray of every point and symbol is tested against all buildings.
"""

from typing import NamedTuple

import numpy as np

from lowalt.extensions.town import image_loops, knife_edge, shadow_loops
from lowalt.extensions.town.facets import Town
from lowalt.extensions.town.materials import properties
from lowalt.scene.fresnel import VACUUM_F_M

BLOCK = 64
"""Rays that are traced together at least."""
STEP = 8
"""Symbols of which one decides which rays exist."""


class Route(NamedTuple):
    """A path: the facets (0 to 2) from the station on; images (N, L, 3) m, where the station sees the points;
    coefficient (N, L) complex, 0 where there is no ray; station_m (3,), where the points see the station."""

    facets: tuple[int, ...]
    images: np.ndarray
    coefficient: np.ndarray
    station_m: np.ndarray


class TracedRays(NamedTuple):
    """The rays that decide which points are reached: places (R, 1, 3) m, where they end; of_point (N, L): the ray that
    decides for each point and symbol; boxes (C, 2, 3) m: low and high corners around the places of BLOCK rays each."""

    places: np.ndarray
    of_point: np.ndarray
    boxes: np.ndarray


def rays_to(places: np.ndarray, cell_m: float) -> TracedRays:
    """Return one ray for the points of places (N, L, 3) m that are in one cell of a grid of cell_m (m), STEP symbols
    sharing them; with cell_m 0 one for each point and symbol."""
    count, points = places.shape[:2]
    if cell_m == 0.0:
        ends, which = places.reshape(-1, 1, 3), np.arange(count * points).reshape(count, points)
    else:
        # The middle one of the symbols that share rays.
        some = places[np.minimum(np.arange(STEP // 2, count + STEP // 2, STEP), count - 1)]
        cells = np.floor(some / cell_m).astype(np.int64)
        cells -= cells.min(axis=(0, 1))
        sizes = cells.max(axis=(0, 1)) + 1
        keys = np.arange(len(some))[:, None]
        for axis in range(3):
            keys = keys * sizes[axis] + cells[..., axis]
        _, first, which = np.unique(keys, return_index=True, return_inverse=True)
        ends, which = some.reshape(-1, 1, 3)[first], np.repeat(which.reshape(keys.shape), STEP, axis=0)[:count]
    starts = np.arange(0, len(ends), BLOCK)
    low, high = np.minimum.reduceat(ends[:, 0], starts), np.maximum.reduceat(ends[:, 0], starts)
    return TracedRays(np.ascontiguousarray(ends), which, np.stack([low, high], axis=1))


def epsilons(town: Town, frequency_hz: float, where: str) -> np.ndarray:
    """Return the complex relative permittivity (K,) of each facet, for fields exp(+j 2 pi f t).

    Raises: InputError naming `where` for a material that is not known at this frequency.
    """
    of_material = []
    for name in town.materials:
        permittivity, conductivity = properties(name, frequency_hz, where)
        of_material.append(permittivity - 1j * conductivity / (2 * np.pi * frequency_hz * VACUUM_F_M))
    return np.array(of_material)[town.material]


def _pairs(town: Town, station_m: np.ndarray) -> np.ndarray:
    """The pairs (P, 2) of facets by which a ray from a station may go on; they hold for all targets."""
    key, facets = tuple(station_m.tolist()), town.facets
    if key not in town.pairs:
        every, corners = np.arange(len(facets.offset)), np.repeat(station_m[None], 8, axis=0)
        unseen = shadow_loops.hidden(facets, town.occluders, every, corners)
        town.pairs[key] = image_loops.ordered_pairs(facets, ~unseen, station_m, np.hypot(*facets.half.T))
    return town.pairs[key]


def _unhidden(town: Town, routes: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """The routes whose last facet is not hidden from the whole box between two corners (3,) m."""
    corners = np.stack(np.meshgrid(*zip(low, high, strict=True), indexing="ij"), axis=-1).reshape(8, 3)
    last, which = np.unique(routes[:, -1], return_inverse=True)
    return routes[~shadow_loops.hidden(town.facets, town.occluders, last, corners)[which]]


def candidates(town: Town, station_m: np.ndarray, places: np.ndarray, order: int) -> list[np.ndarray]:
    """Return the routes of each of 1 to `order` facets, (P, order) int64, that may lead from a station (3,) m to places
    (N, L, 3) m."""
    low, high = places.min(axis=(0, 1)), places.max(axis=(0, 1))
    routes = [np.arange(len(town.facets.offset))[:, None]] if order >= 1 else []
    routes += [_pairs(town, station_m)] if order >= 2 else []
    fitting = [image_loops.fitting(town.facets, one, station_m, low, high) for one in routes]
    return [_unhidden(town, one, low, high) for one in fitting]


def seen(town: Town, station_m: np.ndarray, rays: TracedRays, facets: np.ndarray) -> np.ndarray:
    """Return which points a ray from a station by facets (0 to 2,) reaches past all buildings, (N, L) bool."""
    present = np.zeros((len(rays.places), 1), bool)
    shadow_loops.trace(town.facets, town.occluders, facets, station_m, rays.places, rays.boxes, BLOCK, present)
    return present[:, 0][rays.of_point]


def reflected(
    town: Town, epsilon: np.ndarray, station_m: np.ndarray, places: np.ndarray, rays: TracedRays, order: int
) -> list[Route]:
    """Return the paths by 1 to `order` reflections that reach any of the points, places (N, L, 3) m C-contiguous.

    epsilon: (K,) complex permittivity of the facets. Source: image method and Fresnel's coefficients, Balanis, Advanced
    Engineering Electromagnetics, sections 5.3 and 7.4.
    """
    result = []
    for routes in candidates(town, station_m, rays.places, order):
        ask = town.facets, town.occluders, routes, station_m, rays.places, rays.boxes, BLOCK
        for route in routes[shadow_loops.reaching(*ask)]:
            present = seen(town, station_m, rays, route)
            images, coefficient = np.empty((len(places), 3, places.shape[1])), np.empty(present.shape, np.complex128)
            image_loops.coefficients(town.facets, epsilon, route, station_m, places, present, images, coefficient)
            behind = station_m.copy()
            for k in route:
                image_loops.mirrored(town.facets, k, behind)
            result.append(Route(tuple(route.tolist()), images.swapaxes(1, 2), coefficient, behind))
    return result


def direct(
    town: Town, station_m: np.ndarray, places: np.ndarray, rays: TracedRays, wavelength_m: float, diffraction: bool
) -> tuple[np.ndarray, np.ndarray]:
    """Return where the direct ray is free, (N, L) bool, and its field over that in free space, (N, L) complex."""
    lit = seen(town, station_m, rays, np.empty(0, np.int64))
    if not diffraction:
        return lit, lit.astype(np.complex128)
    return lit, knife_edge.direct(town, station_m, places, lit, wavelength_m)
