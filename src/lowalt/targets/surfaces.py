"""Triangle surfaces: closed ones from primitives, whether points lie inside, and points on them.

This module is geometry only: it knows no target, part or record. Every primitive is one closed
shell with outward normals (right-hand rule), in the caller's unit. Built-in models consist of
several shells, which may overlap. trimesh's sampler draws the faces independently; here they are
drawn systematically, which halves the unevenness before thinning and spares the import.
"""

import functools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable

BOX_EXPONENT = 8.0
"""Exponent of the superellipse that is a box's section along y."""
GRAIN = 30
"""Triangles across the border of a cut are divided.

Their edges are then shorter than the part's extent / GRAIN.
"""


@dataclass(frozen=True)
class Surface:
    """A triangle surface.

    vertices: (V, 3); faces: (F, 3), indices in right-hand order seen from outside.
    """

    vertices: np.ndarray
    faces: np.ndarray

    def moved(self, offset: Iterable[float]) -> Self:
        """Return the surface shifted by `offset` (3,)."""
        return replace(self, vertices=self.vertices + np.asarray(offset, float))

    def mapped(self, matrix: np.ndarray) -> Self:
        """Return the surface under a linear map (3, 3).

        A mirroring map turns the faces, so that normals stay outward.
        """
        matrix = np.asarray(matrix, float)
        result = replace(self, vertices=portable.applied(matrix, self.vertices))
        if np.linalg.det(matrix) < 0:
            return result.flipped()
        return result

    def flipped(self) -> Self:
        """Return the surface with its inside and outside exchanged."""
        return replace(self, faces=self.faces[:, ::-1])


def volume(surface: Surface) -> float:
    """Return the enclosed volume, positive where the normals point outward (divergence theorem)."""
    a, b, c = np.moveaxis(surface.vertices[surface.faces], 1, 0)
    return float(portable.total(portable.dot(a, np.cross(b, c))) / 6)


def merged(surfaces: Iterable[Surface]) -> Surface:
    """Return several surfaces as one list of triangles."""
    vertices = []
    faces = []
    start = 0
    for surface in surfaces:
        vertices.append(surface.vertices)
        faces.append(surface.faces + start)
        start += len(surface.vertices)
    return Surface(np.concatenate(vertices), np.concatenate(faces))


def inside(surface: Surface, points: np.ndarray) -> np.ndarray:
    """Return for each point (L, 3) whether it lies inside the closed surface, shape (L,) bool.

    Source: solid angle of a triangle, Van Oosterom & Strackee 1983; the winding number is their sum
    over 4 pi.
    """
    result = np.zeros(len(points), bool)
    low = surface.vertices.min(0)
    high = surface.vertices.max(0)
    near = np.flatnonzero(((points > low) & (points < high)).all(1))
    corners = surface.vertices[surface.faces]
    # Blocks bound the memory of the points-by-triangles arrays.
    for block in np.array_split(near, len(near) * len(corners) // 30_000 + 1):
        a, b, c = np.moveaxis(corners[None] - points[block, None, None], 2, 0)
        la = portable.norm(a)
        lb = portable.norm(b)
        lc = portable.norm(c)
        ab = portable.dot(a, b)
        bc = portable.dot(b, c)
        ca = portable.dot(c, a)
        numerator = portable.dot(a, np.cross(b, c))
        # The sum is 0 or 4 pi, so the last bits of the library's arc tangent cannot move it across
        # 2 pi.
        angle = 2 * np.arctan2(numerator, la * lb * lc + ab * lc + bc * la + ca * lb)
        result[block] = angle.sum(1) > 2 * np.pi
    return result


@functools.cache
def _faces_between(rows: int, sides: int) -> np.ndarray:
    """Return the triangles of `loft`, which follow from the numbers of loops and of their points.

    Sections come first in the list of vertices, then both tips.
    """
    grid = np.arange(rows * sides).reshape(rows, sides)
    a = grid[:-1]
    b = np.roll(grid[:-1], -1, 1)
    c = np.roll(grid[1:], -1, 1)
    d = grid[1:]
    first = rows * sides
    last = rows * sides + 1
    # The two halves of a loop are split along mirrored diagonals. Otherwise the upper and the lower
    # side of a twisted blade would cut through each other at its thin edge.
    half = np.arange(sides)[None, :, None] < sides // 2
    abc = np.stack([a, b, c], -1)
    abd = np.stack([a, b, d], -1)
    acd = np.stack([a, c, d], -1)
    bcd = np.stack([b, c, d], -1)
    faces = [
        np.where(half, abc, abd).reshape(-1, 3),
        np.where(half, acd, bcd).reshape(-1, 3),
        np.stack([np.full(sides, first), np.roll(grid[0], -1), grid[0]], -1),
        np.stack([np.full(sides, last), grid[-1], np.roll(grid[-1], -1)], -1),
    ]
    return np.concatenate(faces)


def loft(sections: np.ndarray, tips: np.ndarray | Sequence | None = None) -> Surface:
    """Return the closed skin over sections (K, S, 3), each a loop of S points in the same sense.

    Each end is closed by a fan from `tips` (2, 3), by default the middle of the end section. The
    normals point outward for either sense of the loops.
    """
    sections = np.asarray(sections, float)
    rows, sides, _ = sections.shape
    if tips is None:
        tips = portable.mean(sections[[0, -1]], 1)
    vertices = np.concatenate([sections.reshape(-1, 3), np.asarray(tips, float)])
    return _outward(Surface(vertices, _faces_between(rows, sides).copy()))


def _outward(surface: Surface) -> Surface:
    """Return a closed surface with its normals outward."""
    if volume(surface) > 0:
        return surface
    return surface.flipped()


def _circle(sides: int) -> tuple[np.ndarray, np.ndarray]:
    """Return sine and cosine (sides,) of a turn in equal steps, which every loop is made from."""
    return portable.sine_cosine_turns(np.arange(sides) / sides)


def superellipse(
    half_a: float, half_b: float, exponent: float = 2.0, sides: int = 24
) -> np.ndarray:
    """Return the loop |a/A|^n + |b/B|^n = 1, shape (sides, 2).

    n = 2 is an ellipse, a larger n a rounded rectangle.
    """
    sine, cosine = _circle(sides)
    along = np.sign(cosine) * portable.power(abs(cosine), 2 / exponent)
    across = np.sign(sine) * portable.power(abs(sine), 2 / exponent)
    return np.stack([half_a * along, half_b * across], 1)


def ellipsoid(
    radii: Iterable[float], centre: Iterable[float] = (0, 0, 0), sides: int = 16
) -> Surface:
    """Return an ellipsoid with the half axes `radii` (3,) about `centre` (3,)."""
    out, up = portable.sine_cosine_turns(np.arange(1, sides // 2) / (2 * (sides // 2)))
    sine, cosine = _circle(sides)
    level = out[:, None, None] * np.stack([cosine, sine], 1)
    height = np.broadcast_to(up[:, None, None], (len(up), sides, 1))
    rings = np.concatenate([level, height], 2)
    unit = loft(rings, tips=[[0, 0, 1], [0, 0, -1]])
    return unit.mapped(np.diag(np.asarray(radii, float))).moved(centre)


def tube(
    path: np.ndarray | Sequence, radii: np.ndarray | Sequence | float, sides: int = 10
) -> Surface:
    """Return a round tube along `path` (K, 3), a radius at each point, closed by flat ends."""
    path = np.asarray(path, float)
    radii = np.broadcast_to(np.asarray(radii, float), len(path))
    tangents = np.gradient(path, axis=0)
    tangents /= portable.norm(tangents)[:, None]
    # All sections share the axis that the path follows least as their reference, so that the loops
    # do not twist.
    reference = np.eye(3)[np.argmin(abs(tangents).max(0))]
    first = np.cross(tangents, reference)
    first /= portable.norm(first)[:, None]
    second = np.cross(tangents, first)
    sine, cosine = _circle(sides)
    rings = cosine[None, :, None] * first[:, None] + sine[None, :, None] * second[:, None]
    return loft(path[:, None] + radii[:, None, None] * rings)


def cylinder(
    radius: float, bottom: Iterable[float], top: Iterable[float], sides: int = 16
) -> Surface:
    """Return a cylinder between the centres of its two ends (3,)."""
    return tube(np.array([bottom, top], float), radius, sides)


def hull(stations: Iterable[tuple], exponent: float, sides: int = 24, bow: float = 0.0) -> Surface:
    """Return a body along y from stations (y, half_width, z_low, z_high), its ends closed.

    Sections are superellipses. `bow` shifts both tips outward along y by that length, which rounds
    the ends.
    """
    table = np.array(list(stations), float)
    loops = []
    for y, half_width, low, high in table:
        loop = superellipse(half_width, (high - low) / 2, exponent, sides)
        height = loop[:, 1] + (low + high) / 2
        loops.append(np.stack([loop[:, 0], np.full(sides, y), height], 1))
    sections = np.array(loops)
    tips = portable.mean(sections[[0, -1]], 1)
    sense = np.sign(table[-1, 0] - table[0, 0])
    tips[:, 1] += bow * np.array([-1, 1]) * sense
    return loft(sections, tips)


def box(size: Iterable[float], centre: Iterable[float] = (0, 0, 0)) -> Surface:
    """Return a box with the edge lengths `size` (x, y, z).

    BOX_EXPONENT rounds its edges along y.
    """
    x, y, z = (float(value) / 2 for value in size)
    return hull([(-y, x, -z, z), (y, x, -z, z)], BOX_EXPONENT).moved(centre)


def ring(profile: np.ndarray, sides: int = 32) -> Surface:
    """Return a closed profile (S, 2) of (radius, height) turned about z, such as a tyre or duct."""
    profile = np.asarray(profile, float)
    sine, cosine = _circle(sides)
    x = cosine[:, None] * profile[:, 0]
    y = sine[:, None] * profile[:, 0]
    vertices = np.stack([x, y, np.broadcast_to(profile[:, 1], x.shape)], -1)
    grid = np.arange(x.size).reshape(x.shape)
    right = np.roll(grid, -1, 0)
    up = np.roll(grid, -1, 1)
    both = np.roll(right, -1, 1)
    lower = np.stack([grid, right, both], -1)
    upper = np.stack([grid, both, up], -1)
    faces = np.concatenate([lower, upper]).reshape(-1, 3)
    return _outward(Surface(vertices.reshape(-1, 3), faces))


def airfoil(chord: float, thickness: float, panels: int = 6) -> np.ndarray:
    """Return a symmetric section (2 panels + 1, 2) of (along chord, across) as a loop.

    The leading edge is at +chord/4. `thickness` is the largest thickness over the chord. The blunt
    trailing edge has a fiftieth of that thickness.
    Source: NACA four-digit thickness distribution, Abbott & von Doenhoff 1959.
    """
    x = (1 - portable.sine_cosine_turns(np.arange(panels + 1) / (2 * panels))[1]) / 2
    polynomial = x * (-0.1260 + x * (-0.3516 + x * (0.2843 - 0.1015 * x)))
    y = 5 * thickness * (0.2969 * np.sqrt(x) + polynomial)
    upper = np.stack([x, y], 1)
    lower = np.stack([x, -y], 1)
    loop = np.concatenate([upper, lower[:0:-1]]) * chord
    return np.stack([chord / 4 - loop[:, 0], loop[:, 1]], 1)


def foil(stations: Iterable[tuple], thickness: float) -> Surface:
    """Return a wing or blade along +x from stations (x, y, z, chord, twist).

    Sections are airfoils, and the ends are closed. (x, y, z) is the quarter-chord point, the chord
    lies along y (leading edge at +y), a positive twist (rad) raises the leading edge.
    """
    sections = []
    for x, y, z, chord, twist in stations:
        loop = airfoil(chord, thickness)
        s, c = portable.sine_cosine(twist)
        along = loop[:, 0] * c - loop[:, 1] * s
        across = loop[:, 0] * s + loop[:, 1] * c
        sections.append(np.stack([np.full(len(loop), float(x)), y + along, z + across], 1))
    return loft(np.array(sections))


def longest_edge(corners: np.ndarray) -> np.ndarray:
    """Return the longest edge (F,) of triangles (F, 3, 3)."""
    return portable.norm(corners - np.roll(corners, 1, axis=1)).max(axis=1)


def quartered(corners: np.ndarray) -> np.ndarray:
    """Return triangles (F, 3, 3) each divided into four at the middles of its edges.

    The result (4 F, 3, 3) holds the copies in turn.
    """
    a, b, c = np.moveaxis(corners, 1, 0)
    ab = (a + b) / 2
    bc = (b + c) / 2
    ca = (c + a) / 2
    four = [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
    return np.concatenate([np.stack(three, axis=1) for three in four])


def face_normals(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return each triangle's unit normal (F, 3), by the right-hand rule, and its area (F,).

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
    """Return `count` points (count, 3) spread over the triangles by area, and their triangles.

    The triangles (count,) are indices of faces. `vertices` (V, 3), `faces` (F, 3) indices, `rng`
    the only source of randomness. One point falls into each of `count` equal slices of the running
    area, so a face of area a gets count * a / total points to within two. Degenerate triangles get
    none.
    Raises: InputError where the surface has no area or the area is not finite.
    Source: Osada et al. 2002 (uniform point in a triangle), systematic sampling over the faces.
    """
    _, areas = face_normals(vertices, faces)
    running = np.cumsum(areas)
    total = 0.0
    if len(running):
        total = running[-1]
    if not (np.isfinite(total) and total > 0):
        raise InputError(
            f"surface of {len(areas)} triangles has area {total}, expected a positive finite one"
        )
    area = (np.arange(count) + rng.random(count)) / count * total
    # side="right" passes over degenerate faces; the clip guards the last slice against rounding at
    # its end.
    face = np.searchsorted(running, area, side="right").clip(max=np.flatnonzero(areas)[-1])
    corners = np.asarray(vertices, float)[np.asarray(faces)[face]]
    root = np.sqrt(rng.random(count))[:, None]
    along = rng.random(count)[:, None]
    on_edge = (1 - along) * corners[:, 1] + along * corners[:, 2]
    points = (1 - root) * corners[:, 0] + root * on_edge
    return points, face


def thin(
    points: np.ndarray, count: int, rng: np.random.Generator, keep: np.ndarray | Sequence
) -> np.ndarray:
    """Return the indices of `count` points spread as evenly as can be, in the order chosen.

    Farthest-point sampling: each next point is the one farthest from all chosen so far (lowest
    index on a tie), from a random first one. `points` (L, D); the indices in `keep` are chosen
    first, in their order. The count is exact and the indices are unique, also where points
    coincide.
    Raises: InputError where `count` is not between max(1, len(keep)) and L.
    Source: Eldar et al. 1997, "The farthest point strategy for progressive image sampling".
    """
    points = np.asarray(points, float)
    kept = list(dict.fromkeys(np.asarray(keep, int).tolist()))
    fewest = max(1, len(kept))
    if not fewest <= count <= len(points):
        raise InputError(f"thinning to {count} points, expected {fewest} to {len(points)}")
    columns = np.ascontiguousarray(points.T)
    nearest = np.full(len(points), np.inf)
    chosen = np.empty(count, np.int64)
    # Drawn even where points are kept, so that the draws that follow stay the same.
    first = int(rng.integers(len(points)))
    for step in range(count):
        if step < len(kept):
            index = kept[step]
        elif step == 0:
            index = first
        else:
            index = int(np.argmax(nearest))
        chosen[step] = index
        away = (columns[0] - columns[0, index]) ** 2
        for column in columns[1:]:
            away += (column - column[index]) ** 2
        np.minimum(nearest, away, out=nearest)
        # Below every distance: a chosen point is never chosen again, even among coinciding ones.
        nearest[index] = -1.0
    return chosen
