"""Reading GLB files as viewers show them: quantised, sparse and skinned surfaces, morphs at their
weights, strips.

trimesh leaves normalised integers, skins and morphs out; pygltflib hands on the JSON and no arrays,
pymeshlab's own reader ends the process on a skin. Source: Khronos, glTF 2.0 (sections 3.6, 3.7,
4.4) and KHR_mesh_quantization.
"""

import base64
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np

from lowalt.extensions.drafting.mesh_ply import stripped
from lowalt.files.atomic import bytes_of
from lowalt.files.errors import InputError
from lowalt.files.json_objects import json_object
from lowalt.numerics import portable
from lowalt.targets.mesh_polygons import MOST_MESH_BYTES, Piece, refuse_many

TYPES = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
OF_TRIANGLE = 6
"""Numbers of a triangle: three corners, and half a vertex of three numbers."""
OF_PLACE = 200
"""Numbers that take as long as the place of a node or of an instance."""
METRES = 1.0
"""Metres of the unit of the format. Source: glTF 2.0, section 3.4."""
UP = "y"
"""The axis of the format that points up (the front is z). Source: glTF 2.0, section 3.4."""


class _Glb:
    """A GLB file's JSON and its arrays; a damaged one raises KeyError, IndexError, TypeError or
    ValueError.
    """

    def __init__(self, data: bytes) -> None:
        magic, version, _, size, kind = struct.unpack_from("<4sII I4s", data)
        if magic != b"glTF" or version != 2 or kind != b"JSON":
            raise ValueError("expected a binary glTF of version 2")
        self.json = json_object(data[20 : 20 + size].decode(), "its JSON", "glTF")
        self.binary = data[28 + size :]
        self.embedded: dict[int, bytes] = {}
        self.size = len(data)
        self.values = 0
        self.count(OF_PLACE * len(self.list("nodes")))

    def count(self, values: int) -> None:
        """Count numbers before they are made, however often one surface is shown.

        Raises: InputError for too many.
        """
        self.values += values
        refuse_many(self.values // OF_TRIANGLE, self.size // OF_TRIANGLE)

    def list(self, name: str) -> list:
        """A list of the file's JSON, empty where it has none."""
        return self.json.get(name, [])

    def _buffer(self, index: int) -> bytes:
        """The bytes of a buffer: those behind the JSON, or those in it."""
        uri = self.list("buffers")[index].get("uri")
        if not uri:
            return self.binary
        if index not in self.embedded:
            head, _, text = uri.partition(";base64,")
            if not head.startswith("data:"):
                raise ValueError("its data lies in another file, expected all in one")
            self.embedded[index] = base64.b64decode(text)
        return self.embedded[index]

    def _view(self, index: int, kind: str, width: int, count: int, offset: int) -> np.ndarray:
        """`count` elements of `width` numbers of a buffer view, as they are stored."""
        view = self.list("bufferViews")[_natural(index)]
        data = self._buffer(_natural(view["buffer"]))
        start = _natural(view.get("byteOffset", 0))
        length = _natural(view["byteLength"])
        data = data[start : start + length]
        size = np.dtype(kind).itemsize
        # NumPy refuses a shape that leaves the bytes of the view.
        return np.ndarray(
            (count, width), kind, data, offset, (view.get("byteStride") or size * width, size)
        )

    def array(self, index: int) -> np.ndarray:
        """An accessor's numbers (count, width); normalised integers become fractions."""
        accessor = self.list("accessors")[_natural(index)]
        kind = TYPES[accessor["componentType"]]
        width = WIDTHS[accessor["type"]]
        count = _natural(accessor["count"])
        self.count(count * width)
        if "bufferView" in accessor:
            offset = _natural(accessor.get("byteOffset", 0))
            values = self._view(accessor["bufferView"], kind, width, count, offset).copy()
        else:
            values = np.zeros((count, width), kind)
        if sparse := accessor.get("sparse"):
            at = sparse["indices"]
            new = sparse["values"]
            self.count(_natural(sparse["count"]) * width)
            rows = self._view(
                at["bufferView"],
                TYPES[at["componentType"]],
                1,
                sparse["count"],
                at.get("byteOffset", 0),
            )
            values[rows[:, 0]] = self._view(
                new["bufferView"], kind, width, sparse["count"], new.get("byteOffset", 0)
            )
        if accessor.get("normalized") and kind != "<f4":
            return np.maximum(values / np.iinfo(kind).max, -1.0)
        return values

    def placed(self) -> dict[int, np.ndarray]:
        """The pose (4, 4) of each node of the scene shown, by its number."""
        nodes = self.list("nodes")
        scenes = self.list("scenes")
        if scenes:
            roots = scenes[_natural(self.json.get("scene", 0))].get("nodes", [])
        else:
            # A file without a scene shows every node that hangs on no other.
            inner = set()
            for node in nodes:
                inner.update(node.get("children", []))
            roots = [index for index in range(len(nodes)) if index not in inner]
        poses: dict[int, np.ndarray] = {}
        waiting = [(root, np.eye(4)) for root in roots]
        while waiting:
            index, above = waiting.pop()
            if _natural(index) in poses:
                raise ValueError(f"node {index} hangs on two nodes")
            poses[index] = portable.product(above, _local(nodes[index]))
            waiting += [(child, poses[index]) for child in nodes[index].get("children", [])]
        return dict(sorted(poses.items()))

    def vertices(self, primitive: dict, node: dict, weights: list) -> np.ndarray:
        """A primitive's vertices (V, 3) before they are placed, with its morph targets applied.

        The node's weights of the targets come before `weights`, those of the mesh.
        """
        points = self.array(primitive["attributes"]["POSITION"]).astype(float)
        targets = primitive.get("targets", [])
        for target, weight in zip(targets, node.get("weights", weights), strict=False):
            if weight and "POSITION" in target:
                points = points + float(weight) * self.array(target["POSITION"])
        if points.shape[1] != 3:
            raise ValueError("places of other than three numbers")
        return points

    def skinned(
        self, points: np.ndarray, primitive: dict, skin: dict, places: dict[int, np.ndarray]
    ) -> np.ndarray:
        """The vertices (V, 3) where the joints of a skin hold them; the place of the node itself
        does not count.
        """
        joints = skin["joints"]
        self.count(16 * len(joints))
        attributes = primitive["attributes"]
        bind = np.tile(np.eye(4), (len(joints), 1, 1))
        if "inverseBindMatrices" in skin:
            bind = (
                self.array(skin["inverseBindMatrices"])
                .reshape(-1, 4, 4)
                .swapaxes(1, 2)
                .astype(float)
            )
        moves = np.stack(
            [portable.product(places[joint], bind[row]) for row, joint in enumerate(joints)]
        )
        result = np.zeros_like(points)
        total = np.zeros(len(points))
        for group in range(sum(name.startswith("JOINTS_") for name in attributes)):
            which, weights = (
                self.array(attributes[f"{name}_{group}"]) for name in ("JOINTS", "WEIGHTS")
            )
            for column in range(which.shape[1]):
                move = moves[which[:, column].astype(int)]
                weight = weights[:, column].astype(float)
                result += weight[:, None] * (
                    portable.applied(move[:, :3, :3], points) + move[:, :3, 3]
                )
                total += weight
        return result / np.where(total > 0, total, 1.0)[:, None]

    def faces(self, primitive: dict, count: int) -> np.ndarray:
        """A primitive's triangles (F, 3); points and lines have none."""
        order = (
            self.array(primitive["indices"])[:, 0].astype(np.int64)
            if "indices" in primitive
            else np.arange(count)
        )
        mode = primitive.get("mode", 4)
        if mode == 4:
            faces = order[: len(order) // 3 * 3].reshape(-1, 3)
        elif mode == 5:
            faces = stripped(order)
        else:
            order = order if mode == 6 and len(order) > 2 else order[:0]
            faces = np.stack(
                [np.repeat(order[:1], max(0, len(order) - 2)), order[1:-1], order[2:]], axis=1
            )
        if len(faces) and faces.max() >= count:
            raise ValueError(f"a triangle has vertex {faces.max()} of {count}")
        return faces


def _natural(value: object) -> int:
    """A whole number from 0. Raises: ValueError for anything else: -1 would count from the end."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError(f"{value!r} is no whole number from 0")
    return value


def _local(node: dict) -> np.ndarray:
    """A node's own place (4, 4): its matrix, or its translation, rotation and scale."""
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    place = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", [0, 0, 0, 1]), float)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    place[:3, :3] = turn * np.array(node.get("scale", [1, 1, 1]), float)
    place[:3, 3] = node.get("translation", [0, 0, 0])
    return place


def _instances(glb: _Glb, node: dict) -> list[np.ndarray]:
    """Return the place (4, 4) of each instance of a node's mesh in the node, one at its own place
    where it names none.

    Source: glTF extension EXT_mesh_gpu_instancing.
    """
    attributes = node.get("extensions", {}).get("EXT_mesh_gpu_instancing", {}).get("attributes", {})
    columns = {
        name.lower(): glb.array(index)
        for name, index in attributes.items()
        if name in ("TRANSLATION", "ROTATION", "SCALE")
    }
    if not columns:
        return [np.eye(4)]
    glb.count(OF_PLACE * max(map(len, columns.values())))
    return [
        _local(dict(zip(columns, row, strict=True))) for row in zip(*columns.values(), strict=True)
    ]


def pieces(path: Path) -> list[Piece]:
    """Return each surface of the scene shown, by the names of its node and its mesh.

    Raises: InputError where the file is compressed, or its data lies elsewhere; other exceptions
    for a damaged file.
    """
    glb = _Glb(bytes_of(path, "mesh", MOST_MESH_BYTES))
    for name, word in COMPRESSED.items():
        if name in glb.list("extensionsRequired"):
            raise InputError(
                f"{path}: is compressed by {word}, expected a plain GLB: export it without "
                "compression"
            )
    places = glb.placed()
    pieces = []
    taken = set()
    for index, place in places.items():
        node = glb.list("nodes")[index]
        if "mesh" not in node:
            continue
        mesh = glb.list("meshes")[_natural(node["mesh"])]
        shape = str(mesh.get("name", f"mesh {node['mesh']}"))
        name = str(node.get("name", shape))
        name = name if name not in taken else f"{name} {index}"
        taken.add(name)
        for number, primitive in enumerate(mesh["primitives"]):
            if "POSITION" not in primitive["attributes"]:
                continue
            points = glb.vertices(primitive, node, mesh.get("weights", []))
            numbered = (f"{name} {number}",) if len(mesh["primitives"]) > 1 else ()
            piece = Piece(points, glb.faces(primitive, len(points)), (*numbered, name, shape))
            if "skin" in node and "JOINTS_0" in primitive["attributes"]:
                skin = glb.list("skins")[_natural(node["skin"])]
                pieces.append(replace(piece, vertices=glb.skinned(points, primitive, skin, places)))
                continue
            instances = _instances(glb, node)
            glb.count((len(instances) - 1) * (piece.faces.size + piece.vertices.size))
            for instance, within in enumerate(instances):
                at = portable.product(place, within)
                names = (f"{name} instance {instance}",) if len(instances) > 1 else ()
                pieces.append(
                    replace(piece.mapped(at[:3, :3]).moved(at[:3, 3]), names=(*names, *piece.names))
                )
    return pieces
