"""Reading PLY files: polygons of any and mixed sizes, strips, as text and in binary orders.

trimesh drops strips, and takes all faces of a binary file to be as long as its first (Blender
writes mixed ones). Source: Greg Turk, The PLY Polygon File Format (1994).
"""

import warnings
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from lowalt.files.atomic import bytes_of
from lowalt.targets.mesh_polygons import MOST_MESH_BYTES, Piece, triangulated


def stripped(strip: np.ndarray) -> np.ndarray:
    """Return the triangles (F, 3) of a strip of vertices; -1 begins the strip anew.

    Every second triangle is turned. Source: glTF 2.0, section 3.7.2.1; the restart is PLY's.
    """
    result = []
    for section in np.split(strip, np.flatnonzero(strip < 0)):
        corners = section[section >= 0]
        faces = np.zeros((0, 3), int)
        if len(corners) > 2:
            faces = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
        faces[1::2] = faces[1::2, [1, 0, 2]]
        result.append(faces)
    faces = np.concatenate(result)
    return faces[(faces != np.roll(faces, 1, axis=1)).all(axis=1)]


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


class _Ply:
    """A PLY file: `elements` (name, count, properties as words) and data, read from the front."""

    def __init__(self, data: bytes) -> None:
        end = data.index(b"end_header")
        self.data = data
        self.at = data.index(b"\n", end) + 1
        self.elements: list[tuple[str, int, list[list[str]]]] = []
        lines = [line.split() for line in data[:end].decode("latin-1").splitlines()]
        kind = next((words[1] for words in lines if words[:1] == ["format"]), "")
        if not data.startswith(b"ply") or kind not in ORDERS:
            raise ValueError(f"format {kind!r}, expected a PLY of format {list(ORDERS)}")
        for words in lines:
            if words[:1] == ["element"]:
                if not words[2].isdecimal():
                    raise ValueError(f"{words[2]!r} of {words[1]}, expected a count")
                self.elements.append((words[1], int(words[2]), []))
            elif words[:1] == ["property"]:
                self.elements[-1][2].append(words[1:])
        self.order = ORDERS[kind]
        if not self.order:  # the numbers of a text, as if they were stored one by one
            with warnings.catch_warnings():
                warnings.simplefilter("error")  # NumPy only warns of a word that is no number
                self.data = np.fromstring(data[self.at :], float, sep=" ").tobytes()
            self.at = 0

    def dtype(self, word: str) -> np.dtype:
        """The type of a number as it is stored."""
        if not self.order:
            return np.dtype("f8")
        return np.dtype(self.order + TYPES[word])

    def take(self, dtype: np.dtype, count: int) -> np.ndarray:
        """The next `count` numbers or records. Raises: ValueError where the file ends before."""
        if not count:
            return np.zeros(0, dtype)
        values = np.frombuffer(self.data, dtype, count, self.at)
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
    ) -> Mapping[str, np.ndarray | list[np.ndarray]]:
        """The values of an element's properties by name.

        They are read at once where all lists of a property are as long as its first one, otherwise
        list by list.
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
            sizes = [table[name] for name in rows.fields or () if name.startswith("size ")]
            if all((of_list == of_list[0]).all() for of_list in sizes):
                return {words[-1]: table[words[-1]] for words in properties}
        self.at = start
        values: dict[str, list[np.ndarray]] = {words[-1]: [] for words in properties}
        for _ in range(count):
            for words in properties:
                size = self.size(words) if words[0] == "list" else 1
                values[words[-1]].append(self.take(self.dtype(words[-2]), size))
        return values


def pieces(path: Path) -> list[Piece]:
    """Return a file's one surface, which has the file's name.

    Raises: exceptions of many types for a damaged file.
    """
    ply = _Ply(bytes_of(path, "mesh", MOST_MESH_BYTES))
    vertices = np.zeros((0, 3))
    polygons: Sequence[np.ndarray] | np.ndarray = []
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
    if not faces:
        faces.append(np.zeros((0, 3), np.int64))
    return [Piece(vertices, np.concatenate(faces), (path.name,))]
