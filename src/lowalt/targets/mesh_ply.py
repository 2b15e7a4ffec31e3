"""Reading PLY files: polygons of any and of mixed sizes, and triangle strips, in text and in both binary orders.

trimesh drops strips, and takes a binary file's faces to be all as long as its first (Blender writes mixed ones).
Source: Greg Turk, The PLY Polygon File Format (1994).
"""

from pathlib import Path

import numpy as np

from lowalt.targets.mesh_polygons import stripped, triangulated

TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}  # fmt: skip
INDICES = ("vertex_indices", "vertex_index")


def _header(data: bytes) -> tuple[str, list[tuple[str, int, list[tuple[str, ...]]]], int]:
    """Return the file's format, its elements (name, count, properties as words) and where its data begins."""
    kind, elements, at = "", [], 0
    while True:
        end = data.index(b"\n", at)
        words, at = data[at:end].decode("latin-1").split(), end + 1
        if words[:1] == ["format"]:
            kind = words[1]
        elif words[:1] == ["element"]:
            if not words[2].isdecimal():
                raise ValueError(f"{words[2]!r} of {words[1]}, expected a count")
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == ["property"]:
            elements[-1][2].append(tuple(words[1:]))
        elif words[:1] == ["end_header"]:
            return kind, elements, at


class _Numbers:
    """The data of a PLY file, read from its front: columns (count,) of plain properties, or lists of arrays."""

    def __init__(self, data: bytes, kind: str, at: int) -> None:
        orders = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
        if not data.startswith(b"ply") or kind not in orders:
            raise ValueError(f"format {kind!r}, expected a PLY of format {list(orders)}")
        self.order, self.at = orders[kind], at
        self.data = data if self.order else np.array(data[at:].split(), float).view(np.uint8).tobytes()
        self.at = at if self.order else 0

    def dtype(self, word: str) -> np.dtype:
        """The type of a number as it is stored; that of a text's numbers is float64."""
        return np.dtype(self.order + TYPES[word]) if self.order else np.dtype("f8")

    def take(self, dtype: np.dtype, count: int) -> np.ndarray:
        """The next `count` numbers or records. Raises: ValueError where the file ends before."""
        found = np.frombuffer(self.data, dtype, count, self.at) if count else np.zeros(0, dtype)
        self.at += dtype.itemsize * count
        return found

    def element(self, count: int, properties: list[tuple[str, ...]]) -> dict[str, np.ndarray | list[np.ndarray]]:
        """The values of an element's properties by name."""
        if not count or not properties:
            return {}
        if uniform := self._uniform(count, properties):
            return uniform
        found: dict[str, list] = {words[-1]: [] for words in properties}
        for _ in range(count):
            for words in properties:
                size = int(self.take(self.dtype(words[1]), 1)[0]) if words[0] == "list" else 1
                if size < 0:
                    raise ValueError(f"a list of {size} numbers")
                found[words[-1]].append(self.take(self.dtype(words[-2]), size))
        return found

    def _uniform(self, count: int, properties: list[tuple[str, ...]]) -> dict:
        """The same where every list is as long as the first of its property; an empty mapping where one is not."""
        fields, at = [], self.at
        for number, words in enumerate(properties):
            if words[0] == "list":
                size_type = self.dtype(words[1])
                size = int(np.frombuffer(self.data, size_type, 1, at)[0])
                if not 0 <= size <= len(self.data):
                    return {}
                fields += [(f"size {number}", size_type), (words[-1], self.dtype(words[-2]), (size,))]
            else:
                fields.append((words[-1], self.dtype(words[0])))
            at = self.at + np.dtype(fields).itemsize
        whole = np.dtype(fields)
        if self.at + whole.itemsize * count > len(self.data):
            return {}
        rows = np.frombuffer(self.data, whole, count, self.at)
        if any((rows[name] != rows[name][0]).any() for name in whole.names if name.startswith("size ")):
            return {}
        self.at += whole.itemsize * count
        return {words[-1]: rows[words[-1]] for words in properties}


def read_ply(path: Path) -> list[tuple[tuple[str, ...], np.ndarray, np.ndarray]]:
    """Return the name, vertices (V, 3) and faces (F, 3) of a file's one surface.

    Raises: exceptions of many types for a damaged file.
    """
    data = path.read_bytes()
    kind, elements, at = _header(data)
    numbers, vertices, polygons = _Numbers(data, kind, at), np.zeros((0, 3)), []
    faces = []
    for name, count, properties in elements:
        found = numbers.element(count, properties)
        rows = next((found[word] for word in INDICES if word in found), [])
        if name == "vertex" and found:
            vertices = np.stack([np.asarray(found[axis], float).reshape(-1) for axis in "xyz"], axis=1)
        elif name == "face":
            polygons = rows
        elif name.startswith("tristrip"):
            faces += [stripped(np.asarray(row).astype(np.int64)) for row in rows]
    if len(polygons):
        counts = np.array([len(row) for row in polygons])
        faces.append(triangulated(vertices, counts, np.concatenate(polygons).astype(np.int64))[0])
    return [((path.name,), vertices, np.concatenate(faces) if faces else np.zeros((0, 3), np.int64))]
