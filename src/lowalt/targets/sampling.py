"""Points on a surface: area-weighted sampling of triangles and exact-count uniform thinning.

Shared by the built-in models and by the user's meshes. Pure functions over arrays, in whatever length unit the
caller uses; randomness comes in as a Generator. trimesh's sampler draws the faces independently; here they are
drawn systematically, which halves the unevenness before thinning and spares the import.
"""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable


def face_normals(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return each triangle's unit normal (F, 3), by the right-hand rule, and its area (F,) in squared units.

    `vertices` (V, 3), `faces` (F, 3) indices. A degenerate triangle has area 0 and a zero normal.
    """
    corners = np.asarray(vertices, float)[np.asarray(faces)]
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = portable.norm(cross)
    unit = np.divide(cross, length[:, None], out=np.zeros_like(cross), where=length[:, None] > 0)
    return unit, length / 2


def sample_faces(
    vertices: np.ndarray, faces: np.ndarray, count: int, rng: np.random.Generator
) -> tuple[np.ndarray, np.ndarray]:
    """Return `count` points (count, 3) spread over the triangles by area and the triangle (count,) each lies on.

    `vertices` (V, 3), `faces` (F, 3) indices, `rng` the only source of randomness. One point falls into each of
    `count` equal slices of the running area, so a face of area a gets count * a / total points to within two.
    Degenerate triangles get none.
    Raises: InputError where the surface has no area or the area is not finite.
    Source: Osada et al. 2002 (uniform point in a triangle), systematic sampling over the faces.
    """
    _, areas = face_normals(vertices, faces)
    running = np.cumsum(areas)
    total = running[-1] if len(running) else 0.0
    if not (np.isfinite(total) and total > 0):
        raise InputError(f"surface of {len(areas)} triangles has area {total}, expected a positive finite one")
    where = (np.arange(count) + rng.random(count)) / count * total
    # side="right" passes over degenerate faces; the clip guards the last slice against rounding at its end.
    face = np.searchsorted(running, where, side="right").clip(max=np.flatnonzero(areas)[-1])
    corners = np.asarray(vertices, float)[np.asarray(faces)[face]]
    root, along = np.sqrt(rng.random(count))[:, None], rng.random(count)[:, None]
    points = (1 - root) * corners[:, 0] + root * ((1 - along) * corners[:, 1] + along * corners[:, 2])
    return points, face


def thin(points: np.ndarray, count: int, rng: np.random.Generator, keep: np.ndarray | tuple = ()) -> np.ndarray:
    """Return the indices (count,) of `count` points spread as evenly as can be, in the order they were chosen.

    Farthest-point sampling: each next point is the one farthest from all chosen so far (lowest index on a tie),
    from a random first one. `points` (L, D); the indices in `keep` are chosen first, in their order. The count is
    exact and the indices are unique, also where points coincide.
    Raises: InputError where `count` is not between max(1, len(keep)) and L.
    Source: Eldar et al. 1997, "The farthest point strategy for progressive image sampling".
    """
    points = np.asarray(points, float)
    keep = [int(index) for index in dict.fromkeys(np.asarray(keep, int).tolist())]
    if not max(1, len(keep)) <= count <= len(points):
        raise InputError(f"thinning to {count} points, expected {max(1, len(keep))} to {len(points)}")
    columns = np.ascontiguousarray(points.T)
    nearest = np.full(len(points), np.inf)
    chosen = np.empty(count, np.int64)
    first = int(rng.integers(len(points)))
    for step in range(count):
        farthest = int(np.argmax(nearest)) if step else first
        index = keep[step] if step < len(keep) else farthest
        chosen[step] = index
        away = (columns[0] - columns[0, index]) ** 2
        for column in columns[1:]:
            away += (column - column[index]) ** 2
        np.minimum(nearest, away, out=nearest)
        # Below every distance: a chosen point is never chosen again, even among coinciding ones.
        nearest[index] = -1.0
    return chosen
