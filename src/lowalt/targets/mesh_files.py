"""Reading and repairing mesh files; every fault is named by file and reason.

Nothing here knows a target. OBJ has a reader of its own (`mesh_polygons`), which says why; trimesh
reads STL and DAE and places a scene's surfaces; extensions offer readers of other formats.
pymeshlab repairs, since its filters keep two million triangles within seconds and a gigabyte;
sampling is that of `surfaces`, which is seeded (pymeshlab's sampling takes no seed and misses the
count).
"""

import io
import logging
import re
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from lowalt.files.atomic import existing
from lowalt.files.errors import InputError, reading, warn
from lowalt.numerics import portable
from lowalt.targets.mesh_collada import for_trimesh, stated_metres, stated_up
from lowalt.targets.mesh_polygons import (
    LARGEST_TRIANGLES,
    MOST_MESH_BYTES,
    Piece,
    read_obj,
    refuse_many,
    stated_unit,
)
from lowalt.targets.surfaces import Surface, merged

OWN_SUFFIXES = (".stl", ".obj", ".dae")
UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001, "in": 0.0254, "ft": 0.3048}
TEXT_BYTES = 100
"""Least number of bytes of a triangle in a text STL file."""
HASH_FIRST = np.uint64(0x9E3779B97F4A7C15)
HASH_NEXT = np.uint64(0xBF58476D1CE4E5B9)
HASH_SHIFT = np.uint64(29)
"""Constants that spread bits over a word. Any odd factors merge the same vertices, since equal
hashes of different vertices are noticed. Source: Steele, Lea, Flood, Fast splittable pseudorandom
number generators, OOPSLA 2014.
"""
SAME_UNIT = 1e-6
"""Two units are the same if their relative difference is at most this."""


@dataclass(frozen=True)
class Mesh(Surface):
    """A repaired surface in metres along the file's axes.

    component: (F,) the number of each face's connected component; closed: (C,) whether it is
    watertight.
    """

    component: np.ndarray
    closed: np.ndarray


def joined(meshes: list[Mesh]) -> Mesh:
    """Return several meshes as one, components numbered on."""
    whole = merged(meshes)
    numbers = []
    first = 0
    for mesh in meshes:
        numbers.append(mesh.component + first)
        first += len(mesh.closed)
    closed = np.concatenate([mesh.closed for mesh in meshes])
    return Mesh(whole.vertices, whole.faces, np.concatenate(numbers), closed)


def metres(unit: str | float) -> float:
    """Return the metres of a unit: one of UNITS_M by name, or the metres themselves."""
    if isinstance(unit, str):
        return UNITS_M[unit]
    return float(unit)


def stated_unit_m(path: Path) -> float | None:
    """Return the metres that a mesh file says its unit has, None where it says nothing.

    COLLADA states it (`<unit meter="...">`), an OBJ may in a comment, an extension's format may by
    its standard; STL has no unit. Source: COLLADA 1.4.1, element unit.
    Raises: InputError where a COLLADA file is no XML.
    """
    kind = path.suffix.lower()
    if kind == ".obj":
        return UNITS_M.get(stated_unit(path))
    if kind == ".dae":
        return stated_metres(path)
    return getattr(_added(kind), "METRES", None)


def stated_up_axis(path: Path) -> str | None:
    """Return the axis that a mesh file or its format says is up, None where neither says so.

    Source: COLLADA 1.4.1, element up_axis.
    Raises: InputError where a COLLADA file is no XML.
    """
    kind = path.suffix.lower()
    if kind == ".dae":
        return stated_up(path)
    return getattr(_added(kind), "UP", None)


def suffixes() -> tuple[str, ...]:
    """Return the suffixes of all files that are read, those of extensions last."""
    from lowalt.config.extensions import offered

    return (*OWN_SUFFIXES, *offered("meshes"))


def _added(suffix: str) -> ModuleType | None:
    """The module of the extension that reads files of this suffix, None where none does."""
    if suffix in OWN_SUFFIXES:
        return None
    # Looking for extensions takes longer than making a built-in cloud.
    from lowalt.config.extensions import module_offered, offered

    readers = offered("meshes")
    if suffix not in readers:
        return None
    return module_offered("meshes", suffix, readers[suffix])


def _scene(path: Path) -> list[Piece]:
    """The surfaces of an STL or DAE file, by trimesh."""
    import trimesh  # slow to import, and only records with a mesh need it

    # trimesh logs a traceback of every optional reader that it cannot import; failures are raised
    # below.
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    names: dict[str, list[str]] = {}
    if path.suffix.lower() == ".dae":
        data, names = for_trimesh(path)
        scene = trimesh.load_scene(io.BytesIO(data), "dae", process=False)
    else:
        scene = trimesh.load_scene(path, process=False)
    result = []
    for node in sorted(scene.graph.nodes_geometry):
        pose, name = scene.graph[node]
        # A chain of transforms is multiplied by the machine's BLAS; its last bits are rounded away.
        pose = np.round(pose, 12)
        mesh = scene.geometry[name]
        if not isinstance(mesh, trimesh.Trimesh):
            continue
        # trimesh numbers the surfaces of one geometry.
        known = [key for key in names if re.fullmatch(re.escape(key) + r"(_\d+)?", str(name))]
        chosen_by = [str(node), str(name)]
        if known:
            chosen_by += names[known[0]]
        own = tuple(dict.fromkeys(chosen_by))
        piece = Piece(np.asarray(mesh.vertices), np.asarray(mesh.faces), own)
        # Values that are not finite are refused later, by name.
        with np.errstate(invalid="ignore"):
            result.append(piece.mapped(pose[:3, :3]).moved(pose[:3, 3]))
    return result


def _refuse_stl(path: Path) -> None:
    """Refuse an STL file that is cut off or has too many triangles.

    A binary file is cut off if it has fewer triangles than its header states. The triangles of a
    text file are not counted; it has at most one in TEXT_BYTES bytes.

    Raises: InputError naming the file and both numbers.
    """
    with path.open("rb") as file:
        head = file.read(1000)
    # A binary STL has 80 bytes of text, the number of triangles in four, and 50 of each triangle.
    stated = int.from_bytes(head[80:84], "little")
    there = (path.stat().st_size - 84) // 50
    is_text = head.startswith(b"solid") and b"facet" in head
    if not is_text and len(head) >= 84 and there < stated:
        raise InputError(
            f"{path}: the header states {stated} triangles and the file ends after {there}, "
            "expected the whole file: copy or export it again"
        )
    if is_text:
        there = path.stat().st_size // TEXT_BYTES
    if there > LARGEST_TRIANGLES:
        raise InputError(f"{path}: {there} triangles, expected at most {LARGEST_TRIANGLES}")


def pieces(path: Path) -> list[Piece]:
    """Return the pieces of a mesh file that have triangles.

    Raises: InputError naming the file and the reason: no such file, another format, or it cannot be
    read.
    """
    path = existing(path, "mesh", MOST_MESH_BYTES)
    kind = path.suffix.lower()
    added = _added(kind)
    if added is not None:
        read = added.pieces
    elif kind == ".obj":
        read = read_obj
    elif kind in OWN_SUFFIXES:
        read = _scene
    else:
        raise InputError(f"{path}: format {path.suffix!r}, expected one of {suffixes()}")
    with reading(path, f"{path.suffix} mesh"):
        if kind == ".stl":
            _refuse_stl(path)
        found = [piece for piece in read(path) if len(piece.faces)]
        triangles = sum(len(piece.faces) for piece in found)
        refuse_many(triangles, triangles)
    return found


def selected(path: Path, names: list[str] | None) -> list[Piece]:
    """Return the pieces of a file that have one of `names`; all pieces where names is None.

    Raises: InputError naming the file, the names that are not in it and those that are.
    """
    present = pieces(path)
    if names is None:
        return present
    known: set[str] = set()
    for piece in present:
        known.update(piece.names)
    if lacking := sorted(set(names) - known):
        raise InputError(
            f"{path}: geometry {lacking} is not in it, expected some of {sorted(known)}"
        )
    return [piece for piece in present if set(names) & set(piece.names)]


def _merged(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface with identical vertices merged; STL stores every corner on its own.

    Before pymeshlab, whose vertices take 150 bytes each: this keeps two million triangles near a
    gigabyte.
    """
    bits = np.ascontiguousarray(vertices + 0.0).view(np.uint64)  # adding 0 makes -0 equal to 0
    # A hash of each vertex is sorted several times faster than its three coordinates.
    hashes = bits[:, 0] * HASH_FIRST
    for column in (1, 2):
        hashes ^= hashes >> HASH_SHIFT
        hashes = (hashes + bits[:, column]) * HASH_NEXT
    _, first, inverse = np.unique(hashes, return_index=True, return_inverse=True)
    # Two different vertices with one hash: about never.
    if not np.array_equal(vertices[first][inverse], vertices):
        _, first, inverse = np.unique(vertices, axis=0, return_index=True, return_inverse=True)
    return vertices[first], inverse.reshape(-1)[faces]


def _repaired(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the surface with equal vertices merged, and empty, repeated and unused elements gone.

    Raises: InputError where pymeshlab cannot be imported.
    """
    try:
        import pymeshlab
    except ImportError as error:
        raise InputError(
            f"mesh records need pymeshlab, which does not load here ({error}); on a machine "
            "without a display install the system's OpenGL libraries (Debian: libgl1 libopengl0), "
            "or use built-in records"
        ) from None
    vertices, faces = _merged(vertices, faces)
    meshes = pymeshlab.MeshSet(verbose=False)
    meshes.add_mesh(pymeshlab.Mesh(vertices, faces.astype(np.int32)))
    # Single precision separates equal vertices by up to a millionth of the diagonal.
    meshes.meshing_merge_close_vertices(threshold=pymeshlab.PercentageValue(1e-4))
    meshes.meshing_remove_duplicate_faces()
    meshes.meshing_remove_null_faces()
    meshes.meshing_remove_unreferenced_vertices()
    mesh = meshes.current_mesh()
    return np.array(mesh.vertex_matrix()), np.array(mesh.face_matrix()).astype(np.int64)


def edges_of(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the edges (E, 2) of triangles (F, 3), one triangle of each, and how many share it."""
    sides = [faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]
    edges = np.sort(np.concatenate(sides), axis=1)
    key = edges[:, 0] * (int(faces.max()) + 1) + edges[:, 1]
    _, first, uses = np.unique(key, return_index=True, return_counts=True)
    return edges[first], first % len(faces), uses


def components(faces: np.ndarray, count: int) -> np.ndarray:
    """Return the number (F,) of the connected component of each triangle (F, 3) of `count` vertices.

    Faces that share a vertex are connected.
    """
    links = np.concatenate([faces[:, :2], faces[:, 1:]])
    graph = coo_array((np.ones(len(links), np.int8), links.T), shape=(count, count))
    label = connected_components(graph, directed=False)[1]
    return np.unique(label[faces[:, 0]], return_inverse=True)[1]


def _mesh(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    """Return a surface with its connected components, each closed one turned outward."""
    component = components(faces, len(vertices))
    closed = np.ones(int(component.max()) + 1, bool)
    _, face, uses = edges_of(faces)
    closed[component[face[uses != 2]]] = False
    # About the middle: georeferenced coordinates of 1e6 m would drown the volume in rounding
    # errors.
    middle = (vertices.min(axis=0) + vertices.max(axis=0)) / 2
    a, b, c = np.moveaxis(vertices[faces] - middle, 1, 0)
    volume = np.bincount(component, portable.dot(a, np.cross(b, c)), minlength=len(closed))
    inverted = closed & (volume < 0)
    outward = np.where(inverted[component][:, None], faces[:, ::-1], faces)
    return Mesh(vertices, outward, component, closed)


def read_mesh(path: str | Path, unit: str | float, geometry: list[str] | None = None) -> Mesh:
    """Return the repaired mesh of a file of a format in `suffixes`.

    It is in metres along the file's own axes.

    `unit` is the length unit of the file's numbers (m, cm, mm, in, ft, or its metres), `geometry`
    the names of the scene's geometries, instances, objects or groups to take (all by default). Open
    surfaces stay open: they are sampled as triangle soup.
    Raises: InputError naming the file and the reason: no such file, another format, unreadable, no
    or fewer than four triangles, no area, NaN or infinite vertices, too many triangles.
    Warns: InputWarning where the file states another unit than `unit`.
    """
    path = Path(path)
    pieces = selected(path, geometry)
    if not pieces:
        raise InputError(f"{path}: has no triangle, expected a surface")
    whole = merged(pieces)
    vertices = np.asarray(whole.vertices, float)
    faces = np.asarray(whole.faces, np.int64)
    stated = stated_unit_m(path)
    if stated is not None and abs(stated / metres(unit) - 1) > SAME_UNIT:
        warn(
            f"{path}: the file states a unit of {stated:g} m, the record says {unit}; the record "
            "is followed"
        )
    # One mark per vertex: a copy of millions of corners would double the memory.
    finite = np.isfinite(vertices).all(axis=1)
    if faces.min() < 0 or faces.max() >= len(vertices) or not finite[faces].all():
        raise InputError(
            f"{path}: a triangle has a NaN, infinite or missing vertex, expected finite ones"
        )
    vertices *= metres(unit)
    vertices, faces = _repaired(vertices, faces)
    if len(faces) < 4:
        raise InputError(
            f"{path}: {len(faces)} triangles with an area, expected a surface of at least 4"
        )
    return _mesh(vertices, faces)
