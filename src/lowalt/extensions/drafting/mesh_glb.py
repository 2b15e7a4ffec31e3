"""Reading GLB files as viewers show them: quantised, sparse, skinned surfaces, morphs, strips.

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
TRIANGLES = 4
TRIANGLE_STRIP = 5
TRIANGLE_FAN = 6
"""Modes of primitives that have faces. Source: glTF 2.0, section 5.24.4."""
COMPRESSED = {
    "KHR_draco_mesh_compression": "Draco",
    "EXT_meshopt_compression": "meshopt",
    "KHR_meshopt_compression": "meshopt",
}
OF_TRIANGLE = 6
"""Numbers of a triangle: three corners, and half a vertex of three numbers."""
OF_POSE = 200
"""Numbers that take as long as the pose of a node or of an instance."""
METRES = 1.0
"""Metres of the unit of the format. Source: glTF 2.0, section 3.4."""
UP = "y"
"""The axis of the format that points up (the front is z). Source: glTF 2.0, section 3.4."""


class _Glb:
    """A GLB file's JSON and its arrays.

    A damaged file raises KeyError, IndexError, TypeError or ValueError.
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
        self.count(OF_POSE * len(self.listed("nodes")))

    def count(self, values: int) -> None:
        """Count numbers before they are made, however often one surface is shown.

        Raises: InputError for too many.
        """
        self.values += values
        refuse_many(self.values // OF_TRIANGLE, self.size // OF_TRIANGLE)

    def listed(self, name: str) -> list:
        """A list of the file's JSON, empty where it has none."""
        return self.json.get(name, [])

    def _buffer(self, index: int) -> bytes:
        """The bytes of a buffer: those behind the JSON, or those in it."""
        uri = self.listed("buffers")[index].get("uri")
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
        view = self.listed("bufferViews")[_natural(index)]
        data = self._buffer(_natural(view["buffer"]))
        start = _natural(view.get("byteOffset", 0))
        length = _natural(view["byteLength"])
        data = data[start : start + length]
        size = np.dtype(kind).itemsize
        stride = view.get("byteStride") or size * width
        # NumPy refuses a shape that leaves the bytes of the view.
        return np.ndarray((count, width), kind, data, offset, (stride, size))

    def array(self, index: int) -> np.ndarray:
        """An accessor's numbers (count, width); normalised integers become fractions."""
        accessor = self.listed("accessors")[_natural(index)]
        kind = TYPES[accessor["componentType"]]
        width = WIDTHS[accessor["type"]]
        count = _natural(accessor["count"])
        self.count(count * width)
        if "bufferView" in accessor:
            offset = _natural(accessor.get("byteOffset", 0))
            values = self._view(accessor["bufferView"], kind, width, count, offset).copy()
        else:
            values = np.zeros((count, width), kind)
        if accessor.get("sparse"):
            self._replace(values, accessor["sparse"], kind)
        if accessor.get("normalized") and kind != "<f4":
            return np.maximum(values / np.iinfo(kind).max, -1.0)
        return values

    def _replace(self, values: np.ndarray, sparse: dict, kind: str) -> None:
        """Write the values of a sparse accessor over those (count, width) of its buffer view."""
        at = sparse["indices"]
        new = sparse["values"]
        count = sparse["count"]
        self.count(_natural(count) * values.shape[1])
        index_kind = TYPES[at["componentType"]]
        rows = self._view(at["bufferView"], index_kind, 1, count, at.get("byteOffset", 0))
        width = values.shape[1]
        values[rows[:, 0]] = self._view(
            new["bufferView"], kind, width, count, new.get("byteOffset", 0)
        )

    def placed(self) -> dict[int, np.ndarray]:
        """The pose (4, 4) of each node of the scene shown, by its number."""
        nodes = self.listed("nodes")
        scenes = self.listed("scenes")
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
        self, points: np.ndarray, primitive: dict, skin: dict, poses: dict[int, np.ndarray]
    ) -> np.ndarray:
        """The vertices (V, 3) where the joints of a skin hold them.

        The pose of the node itself does not count.
        """
        joints = skin["joints"]
        self.count(16 * len(joints))
        attributes = primitive["attributes"]
        bind = np.tile(np.eye(4), (len(joints), 1, 1))
        if "inverseBindMatrices" in skin:
            by_column = self.array(skin["inverseBindMatrices"]).reshape(-1, 4, 4)
            bind = by_column.swapaxes(1, 2).astype(float)
        moves = np.stack(
            [portable.product(poses[joint], bind[row]) for row, joint in enumerate(joints)]
        )
        result = np.zeros_like(points)
        total = np.zeros(len(points))
        groups = sum(name.startswith("JOINTS_") for name in attributes)
        for group in range(groups):
            which = self.array(attributes[f"JOINTS_{group}"])
            weights = self.array(attributes[f"WEIGHTS_{group}"])
            for column in range(which.shape[1]):
                move = moves[which[:, column].astype(int)]
                weight = weights[:, column].astype(float)
                moved = portable.applied(move[:, :3, :3], points) + move[:, :3, 3]
                result += weight[:, None] * moved
                total += weight
        return result / np.where(total > 0, total, 1.0)[:, None]

    def faces(self, primitive: dict, count: int) -> np.ndarray:
        """A primitive's triangles (F, 3); points and lines have none."""
        order = np.arange(count)
        if "indices" in primitive:
            order = self.array(primitive["indices"])[:, 0].astype(np.int64)
        mode = primitive.get("mode", TRIANGLES)
        faces = np.zeros((0, 3), np.int64)
        if mode == TRIANGLES:
            faces = order[: len(order) // 3 * 3].reshape(-1, 3)
        elif mode == TRIANGLE_STRIP:
            faces = stripped(order)
        elif mode == TRIANGLE_FAN and len(order) > 2:
            hub = np.repeat(order[:1], len(order) - 2)
            faces = np.stack([hub, order[1:-1], order[2:]], axis=1)
        if len(faces) and faces.max() >= count:
            raise ValueError(f"a triangle has vertex {faces.max()} of {count}")
        return faces


def _natural(value: object) -> int:
    """A whole number from 0. Raises: ValueError for anything else: -1 would count from the end."""
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError(f"{value!r} is no whole number from 0")
    return value


def _local(node: dict) -> np.ndarray:
    """A node's own pose (4, 4): its matrix, or its translation, rotation and scale."""
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    pose = np.eye(4)
    x, y, z, w = np.array(node.get("rotation", [0, 0, 0, 1]), float)
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    pose[:3, :3] = turn * np.array(node.get("scale", [1, 1, 1]), float)
    pose[:3, 3] = node.get("translation", [0, 0, 0])
    return pose


def _instances(glb: _Glb, node: dict) -> list[np.ndarray]:
    """Return the pose (4, 4) of each instance of a node's mesh in the node.

    A node without instances has one at its own pose.
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
    glb.count(OF_POSE * max(map(len, columns.values())))
    rows = zip(*columns.values(), strict=True)
    return [_local(dict(zip(columns, row, strict=True))) for row in rows]


def pieces(path: Path) -> list[Piece]:
    """Return each surface of the scene shown, by the names of its node and its mesh.

    Raises: InputError where the file is compressed, or its data lies elsewhere; other exceptions
    for a damaged file.
    """
    glb = _Glb(bytes_of(path, "mesh", MOST_MESH_BYTES))
    for name, word in COMPRESSED.items():
        if name in glb.listed("extensionsRequired"):
            raise InputError(
                f"{path}: is compressed by {word}, expected a plain GLB: export it without "
                "compression"
            )
    poses = glb.placed()
    pieces = []
    taken = set()
    for index, pose in poses.items():
        node = glb.listed("nodes")[index]
        if "mesh" not in node:
            continue
        mesh = glb.listed("meshes")[_natural(node["mesh"])]
        shape = str(mesh.get("name", f"mesh {node['mesh']}"))
        name = str(node.get("name", shape))
        if name in taken:
            name = f"{name} {index}"
        taken.add(name)
        for number, primitive in enumerate(mesh["primitives"]):
            if "POSITION" not in primitive["attributes"]:
                continue
            points = glb.vertices(primitive, node, mesh.get("weights", []))
            names = [name, shape]
            if len(mesh["primitives"]) > 1:
                names.insert(0, f"{name} {number}")
            piece = Piece(points, glb.faces(primitive, len(points)), tuple(names))
            if "skin" in node and "JOINTS_0" in primitive["attributes"]:
                skin = glb.listed("skins")[_natural(node["skin"])]
                pieces.append(replace(piece, vertices=glb.skinned(points, primitive, skin, poses)))
                continue
            instances = _instances(glb, node)
            glb.count((len(instances) - 1) * (piece.faces.size + piece.vertices.size))
            pieces += _placed(piece, name, pose, instances)
    return pieces


def _placed(piece: Piece, name: str, pose: np.ndarray, instances: list[np.ndarray]) -> list[Piece]:
    """A piece at each instance (4, 4) of a node at a pose (4, 4); name: the node's."""
    result = []
    for number, instance in enumerate(instances):
        at = portable.product(pose, instance)
        placed = piece.mapped(at[:3, :3]).moved(at[:3, 3])
        if len(instances) > 1:
            placed = replace(placed, names=(f"{name} instance {number}", *piece.names))
        result.append(placed)
    return result
