"""Pieces of mesh files, and OBJ files as viewers show them.

A polygon with a dent is cut by earcut, not as a fan.

Vertices, faces and the names of objects, groups and materials are read. trimesh counts negative
indices from the file's end, cuts polygons as fans and splits by one kind of name at a time.
Source: Wavefront's Object Files (.obj), version 3.0.
"""

import re
from array import array
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.files.atomic import LONGEST_LINE, text_file
from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.targets.surfaces import Surface


@dataclass(frozen=True)
class Piece(Surface):
    """A named surface as it stands in the file, `vertices` in file units.

    `names` are all those that it can be chosen by, its own first: a node of the scene and the shape
    there, or the object, group and material of an OBJ file.
    """

    names: tuple[str, ...]


MOST_MESH_BYTES = 2 << 30
"""Largest size of a mesh file: twenty million triangles as binary STL take half of it."""
LARGEST_TRIANGLES = 20_000_000
"""A surface of more triangles is refused, since its arrays alone would take over two gigabytes."""
REPEATED_TRIANGLES = 2_000_000
MOST_EAR_STEPS = 1_000_000_000
"""Bound on the sum over polygons with a dent of the square of their corners: earcut takes a time in
proportion to it.
"""
FLAT = 1e-9
"""Share of a polygon's area from which on a corner's turn against its sense is a dent."""


def refuse_many(shown: int, own: int) -> None:
    """Refuse a file that shows too many triangles; readers call this before they make them.

    own: those that stand in the file, each once. A file may show one surface many times, but a
    small one may not fill the memory.
    Raises: InputError naming both numbers.
    """
    most = min(LARGEST_TRIANGLES, REPEATED_TRIANGLES + 4 * own)
    if shown > most:
        raise InputError(f"more than {most} triangles, expected fewer")


def triangulated(
    vertices: np.ndarray, counts: np.ndarray, corners: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles (F, 3) of polygons and the number of the polygon (F,) that each is of.

    vertices: (V, 3); counts: (P,) corners of each polygon; corners: the polygons' corners one after
    the other, indices of vertices. Polygons of fewer than three corners have no triangle.
    Raises: InputError where a corner is no vertex, for more than LARGEST_TRIANGLES, and for dented
    polygons of too many corners.
    """
    triangles = int(counts.sum()) - 2 * len(counts)
    refuse_many(triangles, triangles)
    missing = len(corners) != counts.sum()
    outside = len(corners) > 0 and not 0 <= corners.min() <= corners.max() < len(vertices)
    if missing or outside:
        raise InputError(f"a face has a corner that is none of the {len(vertices)} vertices")
    starts = np.cumsum(counts) - counts
    faces = [np.zeros((0, 3), int)]
    owners = [np.zeros(0, int)]
    steps = 0
    for size in np.unique(counts[counts >= 3]):
        which = np.flatnonzero(counts == size)
        ring = corners[starts[which, None] + np.arange(size)]
        first = np.repeat(ring[:, :1], size - 2, axis=1)
        fan = np.stack([first, ring[:, 1:-1], ring[:, 2:]], axis=2)
        if size > 3:
            dented = _dented(vertices[ring])
            steps += len(dented) * int(size) ** 2
            if steps > MOST_EAR_STEPS:
                raise InputError(
                    f"polygons with dents and up to {size} corners, expected triangles"
                )
            for row in dented:
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
    """Return the triangles of one polygon cut by earcut, or `fan` where it has no area."""
    import mapbox_earcut  # viewers' own algorithm (three.js); only a polygon with a dent needs it

    from_first = around - around[0]
    normal = np.cross(from_first, np.roll(from_first, -1, axis=0)).sum(axis=0)
    flat = np.delete(from_first, np.abs(normal).argmax(), axis=1)
    corners = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], np.uint32))
    ears = corners.reshape(-1, 3).astype(int)
    if len(ears) != len(fan):
        return fan
    a, b, c = np.moveaxis(around[ears], 1, 0)
    wrong = portable.dot(np.cross(b - a, c - a), normal) < 0
    return ring[np.where(wrong[:, None], ears[:, ::-1], ears)]


NAMES = ("o", "g", "usemtl")
"""Words of an OBJ file that name what follows: an object, a group, a material."""


class _Names(NamedTuple):
    """The names that the faces of an OBJ file stand under, "" where none was given."""

    object: str
    group: str
    material: str


def _vertex_index(stated: int, so_far: int) -> int:
    """Return the index from 0 that a face of an OBJ file states from 1, -1 where it states 0.

    A negative index counts back from the vertices so far.
    """
    if stated > 0:
        return stated - 1
    if stated < 0:
        return so_far + stated
    return -1


def _lines(path: Path) -> Iterator[tuple[int, str]]:
    """The number and text of each line of an OBJ file, continued lines as one.

    Raises: InputError naming the file where a line is too long.
    """
    parts: list[str] = []
    length = 0
    first = 1
    with text_file(path, "mesh", MOST_MESH_BYTES, "replace") as file:
        for number, text in enumerate(file, 1):
            line = text.rstrip("\r\n")
            more = line.endswith("\\")
            parts.append(line[:-1] if more else line)
            length += len(line)
            if length > LONGEST_LINE:
                raise InputError(f"{path}: line {first} is continued too often, expected triangles")
            if more:
                continue
            yield first, " ".join(parts).strip()
            parts.clear()
            length = 0
            first = number + 1
    yield first, " ".join(parts).strip()


def read_obj(path: Path) -> list[Piece]:
    """Return the surface of each object, group and material of a file.

    Raises: InputError naming the file and the line that cannot be read, the face that has no such
    vertex, or for more than LARGEST_TRIANGLES.
    """
    # Arrays of machine numbers: lists of Python's would take ten times the memory.
    positions = array("d")
    corners = array("q")
    counts = array("q")
    owners = array("q")
    keys: dict[_Names, int] = {}
    now = dict.fromkeys(NAMES, "")
    for number, line in _lines(path):
        word, _, values = line.partition(" ")
        try:
            if word == "v":
                place = [*map(float, values.split()[:3])]
                if len(place) < 3:
                    raise ValueError("fewer than three coordinates")
                positions.extend(place)
            elif word == "f":
                stated_corners = values.split("#", 1)[0].split()
                face = [int(corner.split("/", 1)[0]) for corner in stated_corners]
                so_far = len(positions) // 3
                corners.extend(_vertex_index(stated, so_far) for stated in face)
                counts.append(len(face))
                owners.append(keys.setdefault(_Names(*now.values()), len(keys)))
            elif word in NAMES:
                now[word] = values.strip()
        except (ValueError, OverflowError) as error:
            raise InputError(
                f"{path}: line {number}: {line[:60]!r} cannot be read ({error})"
            ) from None
        if len(corners) > 3 * LARGEST_TRIANGLES or len(positions) > 9 * LARGEST_TRIANGLES:
            raise InputError(f"{path}: more than {LARGEST_TRIANGLES} triangles, expected fewer")
    vertices = np.array(positions, float).reshape(-1, 3)
    faces, polygon = triangulated(vertices, np.array(counts, int), np.array(corners, int))
    owner = np.array(owners, int)[polygon]
    pieces = []
    # trimesh's own names of materials, from the last to the first, which records may have.
    objects = {names.object for names in keys}
    base = next((names.object for names in keys if names.object), path.name)
    materials = list(dict.fromkeys(names.material for names in keys))[::-1]
    older = {name: f"{base}_{index}" if index else base for index, name in enumerate(materials)}
    faces = faces[np.argsort(owner, kind="stable")]
    ends = np.cumsum(np.bincount(owner, minlength=len(keys)))
    for (names, index), end in zip(keys.items(), ends, strict=True):
        first = ends[index - 1] if index else 0
        used, inverse = np.unique(faces[first:end], return_inverse=True)
        known = [name for name in names if name] or [path.name]
        if len(materials) > 1 and older[names.material] not in objects:
            known.append(older[names.material])
        pieces.append(Piece(vertices[used], inverse.reshape(-1, 3), tuple(dict.fromkeys(known))))
    return pieces


def stated_unit(path: Path) -> str:
    """Return the word of `UNITS_M` that a comment at the start of an OBJ file names, "" for none.

    Blender, SketchUp and others write such as "# File units = inches"; a comment names it after the
    word unit.
    """
    words = {
        "m": "met(?:er|re)s?|m",
        "cm": "centimet(?:er|re)s?|cm",
        "mm": "millimet(?:er|re)s?|mm",
        "in": "inch(?:es)?|in",
        "ft": "f(?:ee|oo)t|ft",
    }
    with text_file(path, "mesh", MOST_MESH_BYTES, "replace") as file:
        for line, _ in zip(file, range(200), strict=False):
            stated = re.match(
                r"\s*#.*\bunits?\b\W*(?:(?:in|is|are)\b)?\W*1?\W*([a-z]+)", line, re.IGNORECASE
            )
            if not stated:
                continue
            for unit, pattern in words.items():
                if re.fullmatch(pattern, stated[1], re.IGNORECASE):
                    return unit
    return ""
