"""Pieces of mesh files, and files of polygons, OBJ and PLY, as viewers show them.

A polygon with a dent is cut by earcut, not as a fan; strips are triangles. Of OBJ files vertices,
faces and the names of objects, groups and materials are read; of PLY files polygons of any and of
mixed sizes, and strips, in text and in both binary orders. trimesh counts negative indices of OBJ
from the file's end, cuts polygons as fans and splits by one kind of name at a time; it drops strips
of PLY, and takes all faces of a binary file to be as long as its first (Blender writes mixed ones).
Sources: Wavefront's Object Files (.obj), version 3.0; Greg Turk, The PLY Polygon File Format
(1994).
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

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


FLAT = 1e-9
"""A corner dents its polygon where its turn against the polygon's sense is more than this share of
the area.
"""


def triangulated(
    vertices: np.ndarray, counts: np.ndarray, corners: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the triangles (F, 3) of polygons and the number of the polygon (F,) that each is of.

    vertices: (V, 3); counts: (P,) corners of each polygon; corners: the polygons' corners one after
    the other, indices of vertices. Polygons of fewer than three corners have no triangle.
    Raises: InputError where a corner is no vertex.
    """
    missing = len(corners) != counts.sum()
    outside = len(corners) > 0 and not 0 <= corners.min() <= corners.max() < len(vertices)
    if missing or outside:
        raise InputError(f"a face has a corner that is none of the {len(vertices)} vertices")
    starts = np.cumsum(counts) - counts
    faces = [np.zeros((0, 3), int)]
    owners = [np.zeros(0, int)]
    for size in np.unique(counts[counts >= 3]):
        which = np.flatnonzero(counts == size)
        ring = corners[starts[which, None] + np.arange(size)]
        first = np.repeat(ring[:, :1], size - 2, axis=1)
        fan = np.stack([first, ring[:, 1:-1], ring[:, 2:]], axis=2)
        if size > 3:
            for row in _dented(vertices[ring]):
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


def stripped(strip: np.ndarray) -> np.ndarray:
    """Return the triangles (F, 3) of a strip of vertices, of which every second one is turned.

    -1 begins the strip anew.
    Source: glTF 2.0, section 3.7.2.1; the restart is PLY's.
    """
    result = []
    for run in np.split(strip, np.flatnonzero(strip < 0)):
        run = run[run >= 0]
        faces = np.zeros((0, 3), int)
        if len(run) > 2:
            faces = np.stack([run[:-2], run[1:-1], run[2:]], axis=1)
        faces[1::2] = faces[1::2, [1, 0, 2]]
        result.append(faces)
    faces = np.concatenate(result)
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]


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


def read_obj(path: Path) -> list[Piece]:
    """Return the surface of each object, group and material of a file.

    Raises: InputError naming the file and the line that cannot be read, or the face that has no
    such vertex.
    """
    positions: list[list[float]] = []
    corners: list[int] = []
    counts: list[int] = []
    owners: list[int] = []
    keys: dict[_Names, int] = {}
    now = dict.fromkeys(NAMES, "")
    text = path.read_text(encoding="utf-8-sig", errors="replace").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), 1):
        word, _, values = line.strip().partition(" ")
        try:
            if word == "v":
                positions.append([*map(float, values.split()[:3])])
                if len(positions[-1]) < 3:
                    raise ValueError("fewer than three coordinates")
            elif word == "f":
                face = [int(corner.split("/", 1)[0]) for corner in values.split("#", 1)[0].split()]
                corners += [_vertex_index(stated, len(positions)) for stated in face]
                counts.append(len(face))
                owners.append(keys.setdefault(_Names(*now.values()), len(keys)))
            elif word in NAMES:
                now[word] = values.strip()
        except (ValueError, OverflowError) as error:
            raise InputError(
                f"{path}: line {number}: {line.strip()[:60]!r} cannot be read ({error})"
            ) from None
    vertices = np.array(positions, float).reshape(-1, 3)
    faces, polygon = triangulated(vertices, np.array(counts, int), np.array(corners, int))
    owner = np.array(owners, int)[polygon]
    pieces = []
    # trimesh's own names of materials, from the last to the first, which records may have.
    objects = {names.object for names in keys}
    base = next((names.object for names in keys if names.object), path.name)
    materials = list(dict.fromkeys(names.material for names in keys))[::-1]
    older = {name: f"{base}_{index}" if index else base for index, name in enumerate(materials)}
    for names, index in keys.items():
        used, inverse = np.unique(faces[owner == index], return_inverse=True)
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
    with path.open(errors="replace") as file:
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


TYPES = {
    "char": "i1",
    "int8": "i1",
    "uchar": "u1",
    "uint8": "u1",
    "short": "i2",
    "int16": "i2",
    "ushort": "u2",
    "uint16": "u2",
    "int": "i4",
    "int32": "i4",
    "uint": "u4",
    "uint32": "u4",
    "float": "f4",
    "float32": "f4",
    "double": "f8",
    "float64": "f8",
}
ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


class _Element(NamedTuple):
    """An element of a PLY file's header: its name, how many there are, its properties as words."""

    name: str
    count: int
    properties: list[list[str]]


class _Ply:
    """A PLY file: the `elements` of its header, and its data, read from the front."""

    def __init__(self, data: bytes) -> None:
        end = data.index(b"end_header")
        self.data = data
        self.at = data.index(b"\n", end) + 1
        self.elements: list[_Element] = []
        lines = [line.split() for line in data[:end].decode("latin-1").splitlines()]
        kind = next((words[1] for words in lines if words[:1] == ["format"]), "")
        if not data.startswith(b"ply") or kind not in ORDERS:
            raise ValueError(f"format {kind!r}, expected a PLY of format {list(ORDERS)}")
        for words in lines:
            if words[:1] == ["element"]:
                _, name, count = words[:3]
                if not count.isdecimal():
                    raise ValueError(f"{count!r} of {name}, expected a count")
                self.elements.append(_Element(name, int(count), []))
            elif words[:1] == ["property"]:
                self.elements[-1].properties.append(words[1:])
        self.order = ORDERS[kind]
        if not self.order:  # the numbers of a text, as if they were stored one by one
            self.data = np.array(data[self.at :].split(), float).tobytes()
            self.at = 0

    def dtype(self, word: str) -> np.dtype:
        """The type of a number as it is stored."""
        return np.dtype(self.order + TYPES[word]) if self.order else np.dtype("f8")

    def take(self, dtype: np.dtype, count: int) -> np.ndarray:
        """The next `count` numbers or records. Raises: ValueError where the file ends before."""
        values = np.frombuffer(self.data, dtype, count, self.at) if count else np.zeros(0, dtype)
        self.at += dtype.itemsize * count
        return values

    def size(self, words: list[str]) -> int:
        """The length of the next list. Raises: ValueError where it is negative."""
        size = int(self.take(self.dtype(words[1]), 1)[0])
        if size < 0:
            raise ValueError(f"a list of {size} numbers")
        return size

    def element(
        self, count: int, properties: list[list[str]]
    ) -> dict[str, np.ndarray | list[np.ndarray]]:
        """Return the values of an element's properties by name.

        They are read at once where all lists of a property are as long as its first one, else list
        by list.
        """
        if not count or not properties:
            return {}
        start = self.at
        fields = []
        for number, words in enumerate(properties):
            kind = self.dtype(words[-2])
            if words[0] == "list":
                size = min(self.size(words), len(self.data))
                fields.append((f"size {number}", self.dtype(words[1])))
                kind = np.dtype((kind, (size,)))
            fields.append((words[-1], kind))
            self.at = start + np.dtype(fields).itemsize
        self.at = start
        rows = np.dtype(fields)
        if start + rows.itemsize * count <= len(self.data):
            table = self.take(rows, count)
            sizes = [table[name] for name in table.dtype.names if name.startswith("size ")]
            if all((size == size[0]).all() for size in sizes):
                return {words[-1]: table[words[-1]] for words in properties}
        self.at = start
        values = {words[-1]: [] for words in properties}
        for _ in range(count):
            for words in properties:
                size = self.size(words) if words[0] == "list" else 1
                values[words[-1]].append(self.take(self.dtype(words[-2]), size))
        return values


def read_ply(path: Path) -> list[Piece]:
    """Return a file's one surface, which has the file's name.

    Raises: exceptions of many types for a damaged file.
    """
    ply = _Ply(path.read_bytes())
    vertices = np.zeros((0, 3))
    polygons = []
    faces = []
    for name, count, properties in ply.elements:
        values = ply.element(count, properties)
        lists = values.get("vertex_indices", values.get("vertex_index", []))
        if name == "vertex" and values:
            columns = [np.asarray(values[axis], float).reshape(-1) for axis in "xyz"]
            vertices = np.stack(columns, axis=1)
        elif name == "face":
            polygons = lists
        elif name.startswith("tristrip"):
            faces += [stripped(np.asarray(strip).astype(np.int64)) for strip in lists]
    if len(polygons):
        counts = np.array([len(polygon) for polygon in polygons])
        faces.append(triangulated(vertices, counts, np.concatenate(polygons).astype(np.int64))[0])
    triangles = np.concatenate(faces) if faces else np.zeros((0, 3), np.int64)
    return [Piece(vertices, triangles, (path.name,))]
