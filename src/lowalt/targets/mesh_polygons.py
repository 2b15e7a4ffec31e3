"""Pieces of mesh files, their polygons and strips of triangles, as viewers show them: a polygon with a dent is cut by
earcut, not as a fan."""

from dataclasses import dataclass

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.targets.surfaces import Surface


@dataclass(frozen=True)
class Piece(Surface):
    """A named surface as it stands in the file, `vertices` in file units. `names` are all those that it can be chosen
    by, its own first: a place in the scene and the shape there, or the object, group and material of an OBJ file."""

    names: tuple[str, ...]


FLAT = 1e-9
"""A corner dents its polygon where its turn against the polygon's sense is more than this share of the area."""


def triangulated(vertices: np.ndarray, counts: np.ndarray, corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles (F, 3) of polygons and the number of the polygon (F,) that each is of.

    vertices: (V, 3); counts: (P,) corners of each polygon; corners: the polygons' corners one after the other, indices
    of vertices. Polygons of fewer than three corners have no triangle.
    Raises: InputError where a corner is no vertex.
    """
    if len(corners) != counts.sum() or (len(corners) and not 0 <= corners.min() <= corners.max() < len(vertices)):
        raise InputError(f"a face has a corner that is none of the {len(vertices)} vertices")
    starts, faces, owners = np.cumsum(counts) - counts, [np.zeros((0, 3), int)], [np.zeros(0, int)]
    for size in np.unique(counts[counts >= 3]):
        which = np.flatnonzero(counts == size)
        ring = corners[starts[which, None] + np.arange(size)]
        fan = np.stack([np.repeat(ring[:, :1], size - 2, axis=1), ring[:, 1:-1], ring[:, 2:]], axis=2)
        for row in _dented(vertices[ring]) if size > 3 else ():
            fan[row] = _ears(vertices[ring[row]], ring[row], fan[row])
        faces.append(fan.reshape(-1, 3))
        owners.append(np.repeat(which, size - 2))
    order = np.argsort(np.concatenate(owners), kind="stable")
    return np.concatenate(faces)[order].astype(np.int64), np.concatenate(owners)[order]


def _dented(around: np.ndarray) -> np.ndarray:
    """Return the numbers of the polygons (K, size, 3) that have a corner turned inward."""
    with np.errstate(all="ignore"):  # values that are not finite are refused later, by name
        edge = np.roll(around, -1, axis=1) - around
        turn = np.cross(np.roll(edge, 1, axis=1), edge)
        from_first = around - around[:, :1]
        normal = np.cross(from_first, np.roll(from_first, -1, axis=1)).sum(axis=1)
        against = portable.dot(turn, normal[:, None])
        return np.flatnonzero(against.min(axis=1) < -FLAT * portable.dot(normal, normal))


def _ears(around: np.ndarray, ring: np.ndarray, fan: np.ndarray) -> np.ndarray:
    """Return the triangles of one polygon cut by earcut, or `fan` where it has no area and cannot be cut."""
    import mapbox_earcut  # viewers' own algorithm (three.js); only a polygon with a dent needs it

    from_first = around - around[0]
    normal = np.cross(from_first, np.roll(from_first, -1, axis=0)).sum(axis=0)
    flat = np.delete(from_first, np.abs(normal).argmax(), axis=1)
    ears = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32)).reshape(-1, 3).astype(int)
    if len(ears) != len(fan):
        return fan
    a, b, c = np.moveaxis(around[ears], 1, 0)
    wrong = portable.dot(np.cross(b - a, c - a), normal) < 0
    return ring[np.where(wrong[:, None], ears[:, ::-1], ears)]


def stripped(strip: np.ndarray) -> np.ndarray:
    """Return the triangles (F, 3) of a strip of vertices; every second one is turned, -1 begins the strip anew.

    Source: glTF 2.0, section 3.7.2.1; the restart is PLY's.
    """
    result = []
    for part in np.split(strip, np.flatnonzero(strip < 0)):
        part = part[part >= 0]
        faces = np.stack([part[:-2], part[1:-1], part[2:]], axis=1) if len(part) > 2 else np.zeros((0, 3), int)
        faces[1::2] = faces[1::2, [1, 0, 2]]
        result.append(faces)
    faces = np.concatenate(result)
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]
