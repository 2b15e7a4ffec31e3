"""Small mesh files of kinds that readers get wrong: mixed polygons, strips, second numbers of
corners, skins.
"""

import json
import struct
from pathlib import Path

import numpy as np
import pytest

from lowalt.targets.mesh_files import pieces, stated_unit_m

TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], float)
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
STRIP = [0, 1, 2, 3, 7, 1, 5, 0, 4, 2, 6, 7, 4, 5]
CORNERS = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
L_SHAPE = [(2, 0), (2, 0.2), (0.2, 0.2), (0.2, 2), (0, 2), (0, 0)]


def prism(height: float = 0.1) -> tuple[list, list]:
    """Vertices and faces of an L of area 0.76, each end one polygon with a dent, between
    quadrilaterals.
    """
    vertices = [(*at, 0.0) for at in L_SHAPE] + [(*at, height) for at in L_SHAPE]
    sides = [[i, (i + 1) % 6, (i + 1) % 6 + 6, i + 6] for i in range(6)]
    return vertices, [[5, 4, 3, 2, 1, 0], [6, 7, 8, 9, 10, 11], *sides]


def ply(vertices: list, faces: list, kind: str, strips: list = ()) -> bytes:
    """A PLY file of a kind (ascii, little, big) with faces of mixed sizes and triangle strips."""
    head = (
        f"ply\nformat {'ascii' if kind == 'ascii' else f'binary_{kind}_endian'} 1.0\nelement vertex"
        f" {len(vertices)}\n"
    )
    head += "property float x\nproperty float y\nproperty float z\nproperty uchar red\n"
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
    head += f"element tristrips {len(strips)}\nproperty list int int vertex_indices\nend_header\n"
    if kind == "ascii":
        rows = [*((*at, 7) for at in vertices), *((len(row), *row) for row in (*faces, *strips))]
        return (head + "\n".join(" ".join(map(str, row)) for row in rows) + "\n").encode()
    order = {"little": "<", "big": ">"}[kind]
    data = b"".join(struct.pack(order + "3fB", *at, 7) for at in vertices)
    data += b"".join(struct.pack(f"{order}B{len(row)}i", len(row), *row) for row in faces)
    return (
        head.encode()
        + data
        + b"".join(struct.pack(f"{order}i{len(row)}i", len(row), *row) for row in strips)
    )


def dae(vertices: list, faces: list, more: str = "") -> str:
    """A COLLADA file with one list of polygons whose corners have a second number each, a colour's."""
    numbers = " ".join(f"{value}" for at in vertices for value in at)
    corners = " ".join(f"{corner} 0" for face in faces for corner in face)
    return f"""<?xml version="1.0"?>{more}<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><created>2026-01-01T00:00:00</created><modified>2026-01-01T00:00:00</modified>
<!-- <unit meter="0.001"/> --><unit name="inch" meter="0.0254"/></asset>
<library_geometries><geometry id="g"><mesh><source id="s"><float_array id="f" count="{3 * len(vertices)}">{numbers}
</float_array><technique_common><accessor source="#f" count="{len(vertices)}" stride="3"><param name="X" type="float"/>
<param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#s"/></vertices><polylist count="{len(faces)}">
<input semantic="VERTEX" source="#v" offset="0"/><input semantic="NORMAL" source="#s" offset="1"/>
<vcount>{" ".join(str(len(face)) for face in faces)}</vcount><p>{corners}</p></polylist></mesh></geometry>
</library_geometries><library_visual_scenes><visual_scene id="w"><node id="n"><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#w"/></scene></COLLADA>"""


def glb(path: Path, head: dict, **arrays: np.ndarray) -> Path:
    """Write a GLB of one mesh, its arrays by attribute (`indices`, `bind` apart), and more of its
    JSON in `head`.
    """
    types = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
    views = []
    accessors = []
    data = b""
    for array in arrays.values():
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": array.nbytes})
        shape = {1: "SCALAR", 3: "VEC3", 4: "VEC4", 16: "MAT4"}[
            array.shape[1] if array.ndim > 1 else 1
        ]
        accessors.append(
            {
                "bufferView": len(views) - 1,
                "componentType": types[array.dtype.str[1:]],
                "count": len(array),
                "type": shape,
                "normalized": array.dtype.kind == "i",
            }
        )
        data += array.tobytes() + bytes(-array.nbytes % 4)
    names = {name: index for index, name in enumerate(arrays)}
    surface = {"attributes": {name: at for name, at in names.items() if name.isupper()}}
    surface |= {"indices": names["indices"]} if "indices" in names else {}
    surface |= head.pop("surface", {})
    meshes = [{"name": "shape", "primitives": [surface]}]
    scene = {
        "asset": {"version": "2.0"},
        "meshes": meshes,
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
        "nodes": [{"mesh": 0}],
    } | head
    text = json.dumps(scene).encode()
    text += b" " * (-len(text) % 4)
    chunks = (
        struct.pack("<I4s", len(text), b"JSON")
        + text
        + struct.pack("<I4s", len(data), b"BIN\0")
        + data
    )
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks)
    return path


def skinned(path: Path) -> Path:
    """A GLB of a tetrahedron that two joints hold: the second, with three quarters of the weight,
    stands 8 along y.
    """
    joints = np.zeros((4, 4), "u1")
    weights = np.zeros((4, 4), "<f4")
    joints[:, 1] = 1
    weights[:, :2] = [0.25, 0.75]
    bind = np.tile(np.eye(4, dtype="<f4").reshape(16), (2, 1))
    bind[1, 12:15] = [0, 0, -3]  # column by column
    nodes = [{"mesh": 0, "skin": 0, "scale": [9, 9, 9]}, {"translation": [4, 0, 0], "children": [2]},
             {"translation": [0, 8, 0]}]  # fmt: skip
    head = {"nodes": nodes, "skins": [{"joints": [1, 2], "inverseBindMatrices": 4}]}
    arrays = {
        "POSITION": TETRAHEDRON.astype("<f4"),
        "indices": FACES.ravel().astype("<u4"),
        "JOINTS_0": joints,
        "WEIGHTS_0": weights,
        "bind": bind,
    }
    return glb(path, head, **arrays)


def measures(path: Path) -> tuple[np.ndarray, float, float]:
    """Extents (3,), area and enclosed volume of all pieces of a file, in the file's unit."""
    corners = np.concatenate([piece.vertices[piece.faces] for piece in pieces(path)])
    a, b, c = np.moveaxis(corners, 1, 0)
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2
    return np.ptp(corners.reshape(-1, 3), axis=0), area, float((a * np.cross(b, c)).sum() / 6)


def check_as_viewers_show(path: Path, extent: list, area: float, volume: float, unit: float | None):
    """Assert extents, area, enclosed volume and stated unit (m) of a file."""
    found = measures(path)
    assert found[0] == pytest.approx(extent, rel=1e-4)
    assert found[1:] == pytest.approx((area, volume), rel=1e-3)
    assert stated_unit_m(path) == unit
