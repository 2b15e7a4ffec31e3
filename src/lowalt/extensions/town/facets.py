"""The plane facets of a town's triangles, and the tree of boxes of those that block rays.

Rays look for them in the tree.
"""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import ConvexHull

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.scene import rays
from lowalt.targets.mesh_files import components

GRID_M = 1e-3
"""Corners in the same cell of this grid are one corner.

Files in single precision repeat corners with other digits.
"""
FEW = 64
"""Number of a building's corners that are compared with all its facets first."""
BLOCK = 1 << 20
MOST_COMPARED = 1_000_000_000
"""Numbers of pairs of a facet and a corner that are compared at once, and in all of a town."""
FLAT_M = 0.02
PARALLEL = 1e-3
"""Corners of a facet are at most FLAT_M off its plane.

Normals of neighbouring triangles differ by at most PARALLEL.
"""


class Facets(NamedTuple):
    """K plane facets, the ground z = 0 last, as the compiled loops take them.

    normal (K, 3) and offset (K,) m: a facet's plane is normal . x = offset; centre (K, 3) m, across
    and up (K, 3), half (K, 2) m: a rectangle in the plane that holds the facet, infinite for the
    ground; first (K + 1,): a facet's triangles are rows first[k] to first[k + 1] of triangles (F,
    9) m, a corner and two edges; the ground has none; convex: (K,) bool, whether the triangles fill
    a convex polygon; outward: (K,), 1 or -1 where the normal points out of or into a closed convex
    building, within which there are no rays, and 0 for other facets.
    """

    normal: np.ndarray
    offset: np.ndarray
    centre: np.ndarray
    across: np.ndarray
    up: np.ndarray
    half: np.ndarray
    first: np.ndarray
    triangles: np.ndarray
    convex: np.ndarray
    outward: np.ndarray


class Occluders(NamedTuple):
    """The triangles that block rays.

    boxes: (2 B, 6), a tree as `rays.tree` makes it; triangles: (F, 9); facet: (F,), that of each.
    """

    boxes: np.ndarray
    triangles: np.ndarray
    facet: np.ndarray


class Town(NamedTuple):
    """A town as paths need it.

    material: (K,) number of each facet's material in `materials`; building: (F,) number of the
    building of each triangle of `facets`; edges: (E, 2, 3) m, edges that are not inside a facet,
    and of_building (E,), their buildings; pairs: cache, by the station's position (3,) m, of the
    pairs (P, 2) of facets that may reflect its rays in turn.
    """

    facets: Facets
    occluders: Occluders
    material: np.ndarray
    materials: tuple[str, ...]
    building: np.ndarray
    edges: np.ndarray
    of_building: np.ndarray
    pairs: dict[tuple[float, ...], np.ndarray]


def corner_numbers(corners: np.ndarray) -> np.ndarray:
    """Return the number (F, 3) of each corner of triangles (F, 3, 3) m.

    It is equal for corners in one cell of GRID_M.
    """
    cells = np.rint(corners.reshape(-1, 3) / GRID_M).astype(np.int64)
    return np.unique(cells, axis=0, return_inverse=True)[1].reshape(-1, 3)


def sizes(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit normals (F, 3), NaN without an area, and areas (F,) m2 of triangles (F, 3, 3)."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(across, axis=1)
    with np.errstate(invalid="ignore"):
        return across / twice[:, None], 0.5 * twice


def _edges(numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The edges (3 F, 2) of triangles by their corners' numbers, and the triangle (3 F,) of each.

    The smaller number comes first.
    """
    edges = np.concatenate([numbers[:, [0, 1]], numbers[:, [1, 2]], numbers[:, [2, 0]]])
    triangle_of = np.tile(np.arange(len(numbers)), 3)
    return np.sort(edges, axis=1), triangle_of


def labels(corners: np.ndarray, numbers: np.ndarray, material: np.ndarray) -> np.ndarray:
    """Return the facet (F,) of each triangle.

    Neighbours in one plane and of one material share a facet.

    A facet that is not flat, such as a finely divided dome, falls apart into its triangles.
    """
    normal, area = sizes(corners)
    edges, triangle_of = _edges(numbers)
    order = np.lexsort(edges.T)
    edges = edges[order]
    triangle_of = triangle_of[order]
    shared = np.flatnonzero((edges[1:] == edges[:-1]).all(axis=1))
    first = triangle_of[shared]
    second = triangle_of[shared + 1]
    cosine = abs((normal[first] * normal[second]).sum(axis=1))
    alike = (cosine > 1.0 - PARALLEL**2 / 2) & (material[first] == material[second])
    count = len(corners)
    links = (np.ones(int(alike.sum()), np.int8), (first[alike], second[alike]))
    graph = coo_array(links, shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    # The plane of a facet is that of its largest triangle.
    order = np.lexsort((-area, label))
    largest = np.empty(label.max() + 1, np.int64)
    largest[label[order][::-1]] = order[::-1]
    own = largest[label]
    heights = ((corners - corners[own, :1]) * normal[own][:, None]).sum(axis=2)
    bent = np.isin(label, label[abs(heights).max(axis=1) > FLAT_M])
    alone = count + np.arange(count)
    return np.unique(np.where(bent, alone, label), return_inverse=True)[1]


def _convex(along: np.ndarray, area: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Whether facets fill the convex hull of their corners, (K,) bool.

    along: (F, 3, 2) m, corners in the facets' planes; area: (F,) m2.
    """
    result = np.ones(len(first) - 1, bool)
    for k in np.flatnonzero(np.diff(first) > 1):
        rows = slice(first[k], first[k + 1])
        # In the plane a hull's volume is its area.
        hull_m2 = ConvexHull(along[rows].reshape(-1, 2)).volume
        result[k] = hull_m2 <= area[rows].sum() * (1.0 + 1e-6)
    return result


def _outward(
    corners: np.ndarray,
    numbers: np.ndarray,
    building: np.ndarray,
    label: np.ndarray,
    planes: np.ndarray,
) -> np.ndarray:
    """Which way the facets' planes (K, 4), normals and offsets, are turned, (K,): see `Facets`.

    corners (F, 3, 3) m, numbers (F, 3), building and label (F,): of the triangles.
    """
    edges, triangle_of = _edges(numbers)
    _, which = np.unique(edges, axis=0, return_inverse=True)
    height = np.empty(int(numbers.max()) + 1)
    height[numbers.reshape(-1)] = corners[..., 2].reshape(-1)
    # A surface is closed if each of its edges belongs to two triangles; edges on the ground need
    # only one.
    lone = (np.bincount(which)[which] != 2) & (height[edges].max(axis=1) > FLAT_M)
    result = np.zeros(len(planes))
    order = np.argsort(building, kind="stable")
    compared = 0
    starts = np.searchsorted(building[order], np.arange(int(building.max()) + 2))
    for number in np.setdiff1d(building, building[triangle_of[lone]]):
        triangles = order[starts[number] : starts[number + 1]]
        facets = np.unique(label[triangles])
        points = np.unique(corners[triangles].reshape(-1, 3), axis=0)
        # Most facets of a building with dents have corners on both sides among a few of them.
        some = points[:: -(-len(points) // FEW)]
        below, above = _one_sided(planes[facets], some)
        facets = facets[below | above]
        compared += len(facets) * len(points)
        if compared > MOST_COMPARED:
            raise InputError(
                f"a building of {len(facets)} facets and {len(points)} corners, expected fewer: "
                "divide its round walls less finely"
            )
        below, above = _one_sided(planes[facets], points)
        result[facets] = below.astype(float) - above
    return result


def _one_sided(planes: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whether points (P, 3) m lie all below and all above planes (K, 4), two of (K,) bool."""
    below = np.ones(len(planes), bool)
    above = np.ones(len(planes), bool)
    rows = max(1, BLOCK // max(1, len(points)))
    for first in range(0, len(planes), rows):
        block = slice(first, first + rows)
        over = portable.product(planes[block, :3], points.T) - planes[block, 3:]
        below[block] = over.max(axis=1) <= FLAT_M
        above[block] = over.min(axis=1) >= -FLAT_M
    return below, above


def town(
    corners: np.ndarray, material: np.ndarray, materials: tuple[str, ...], ground: str
) -> Town:
    """Return the town of triangles (F, 3, 3) m with materials (F,), on ground of another material.

    Triangles that share corners are one building.
    """
    numbers = corner_numbers(corners)
    label = labels(corners, numbers, material)
    order = np.argsort(label, kind="stable")
    corners = corners[order]
    numbers = numbers[order]
    material = material[order]
    label = label[order]
    first = np.searchsorted(label, np.arange(label.max() + 2))
    first_edge = corners[:, 1] - corners[:, 0]
    second_edge = corners[:, 2] - corners[:, 0]
    triangles = np.concatenate([corners[:, 0], first_edge, second_edge], axis=1)
    edges, of_building, building = _ridges(corners, numbers, label)
    facets = _facets(corners, numbers, label, first, building, triangles)
    tree = rays.tree(corners, False)
    facet_of = {row.tobytes(): k for row, k in zip(triangles, label, strict=True)}
    of_tree = [facet_of[row.tobytes()] for row in np.ascontiguousarray(tree.triangles)]
    names = tuple(dict.fromkeys((*materials, ground)))
    return Town(
        facets=facets,
        occluders=Occluders(tree.boxes, tree.triangles, np.array(of_tree)),
        material=np.append(material[first[:-1]], names.index(ground)),
        materials=names,
        building=building,
        edges=edges,
        of_building=of_building,
        pairs={},
    )


def _facets(
    corners: np.ndarray,
    numbers: np.ndarray,
    label: np.ndarray,
    first: np.ndarray,
    building: np.ndarray,
    triangles: np.ndarray,
) -> Facets:
    """The facets of triangles that stand in the order of their facets, and the ground.

    corners (F, 3, 3) m, numbers (F, 3), label and building (F,): of the triangles; first (K + 1,)
    and triangles (F, 9) as in `Facets`.
    """
    normal, area = sizes(corners)
    largest = np.array([a + area[a:b].argmax() for a, b in pairwise(first)])
    normal = normal[largest]
    across = np.cross([0.0, 0.0, 1.0], normal)
    level = np.linalg.norm(across, axis=1) < 1e-6
    across[level] = [1.0, 0.0, 0.0]
    across /= np.linalg.norm(across, axis=1)[:, None]
    up = np.cross(normal, across)
    offset = (normal * corners[largest, 0]).sum(axis=1)
    along_across = (corners * across[label][:, None]).sum(axis=2)
    along_up = (corners * up[label][:, None]).sum(axis=2)
    along = np.stack([along_across, along_up], axis=2)
    low = np.minimum.reduceat(along.min(axis=1), first[:-1])
    high = np.maximum.reduceat(along.max(axis=1), first[:-1])
    middle = 0.5 * (low + high)
    centre = offset[:, None] * normal + middle[:, :1] * across + middle[:, 1:] * up
    outward = _outward(corners, numbers, building, label, np.column_stack([normal, offset]))
    return Facets(
        normal=np.vstack([normal, [0.0, 0.0, 1.0]]),
        offset=np.append(offset, 0.0),
        centre=np.vstack([centre, np.zeros(3)]),
        across=np.vstack([across, [1.0, 0.0, 0.0]]),
        up=np.vstack([up, [0.0, 1.0, 0.0]]),
        half=np.vstack([0.5 * (high - low) + FLAT_M, [np.inf, np.inf]]),
        first=np.append(first, first[-1]),
        triangles=triangles,
        convex=np.append(_convex(along, area, first), False),
        outward=np.append(outward, 1.0),
    )


def _ridges(
    corners: np.ndarray, numbers: np.ndarray, label: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The edges (E, 2, 3) m at the rims of facets, their buildings (E,), and the triangles'.

    The latter are the building (F,) of each triangle.
    """
    size = int(numbers.max()) + 1
    building = components(numbers, size)
    edges, triangle_of = _edges(numbers)
    of_facet = np.column_stack([edges, label[triangle_of]])
    _, which = np.unique(of_facet, axis=0, return_inverse=True)
    # An edge that one facet has twice lies inside it.
    rim = np.flatnonzero(np.bincount(which)[which] == 1)
    _, first = np.unique(edges[rim], axis=0, return_index=True)
    points = np.empty((size, 3))
    points[numbers.reshape(-1)] = corners.reshape(-1, 3)
    rim = rim[first]
    return points[edges[rim]], building[triangle_of[rim]], building
