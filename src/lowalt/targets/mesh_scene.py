"""The pieces of a mesh file by name: a scene's geometries and instances, and the objects and groups of an OBJ file.

trimesh reads all five formats and places a scene's geometries; pymeshlab would flatten scenes and drop their names.
Every error names the file and the reason. This module repairs no surface and knows no target.
"""

import logging
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lowalt.common import portable
from lowalt.common.errors import InputError

HEADER_BYTES = 1 << 20
"""Number of bytes at the start of a file that are searched for its unit and its extensions."""


@dataclass(frozen=True)
class Piece:
    """A named surface as it stands in the file: `vertices` (V, 3) in file units, `faces` (F, 3) in right-hand order.

    `geometry` is the name of the shape, `instance` that of its place in the scene; several instances may share one
    shape.
    """

    geometry: str
    instance: str
    vertices: np.ndarray
    faces: np.ndarray


def _compressed(path: Path) -> bool:
    """Whether a GLB needs the Draco decoder, which trimesh does not have."""
    with path.open("rb") as file:
        return path.suffix.lower() == ".glb" and b"KHR_draco_mesh_compression" in file.read(HEADER_BYTES)


def pieces(path: Path, groups: bool = False) -> list[Piece]:
    """Return the pieces of a mesh file that have triangles, sorted by instance.

    `groups`: whether an OBJ file is split by its objects and groups, under their names, not by its materials.
    Raises: InputError naming the file and the reason where it cannot be read.
    """
    import trimesh  # slow to import, and only records with a mesh need it

    # trimesh logs a traceback of every optional reader that it cannot import; failures are raised below.
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    if _compressed(path):
        raise InputError(f"{path}: is compressed by Draco, expected a plain GLB: export it without compression")
    options = {"split_objects": True, "split_groups": True, "group_material": False} if groups else {}
    found = []
    try:
        scene = trimesh.load_scene(path, process=False, **options)
        for node in sorted(scene.graph.nodes_geometry):
            place, name = scene.graph[node]
            # A chain of transforms is multiplied by the machine's BLAS; its last bits are rounded away.
            place = np.round(place, 12)
            mesh = scene.geometry[name]
            if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
                # Values that are not finite are refused later, by name.
                with np.errstate(invalid="ignore"):
                    vertices = portable.applied(place[:3, :3], mesh.vertices) + place[:3, 3]
                faces = np.asarray(mesh.faces)
                faces = faces[:, ::-1] if np.linalg.det(place[:3, :3]) < 0 else faces
                found.append(Piece(name, str(node), vertices, faces))
    except Exception as error:  # trimesh's readers raise exceptions of many types
        raise InputError(f"{path}: not a readable {path.suffix} mesh ({type(error).__name__}: {error})") from None
    return found


def selected(path: Path, names: list[str] | None) -> list[Piece]:
    """Return the pieces of a file whose geometry or instance is one of `names`; all pieces where names is None.

    An OBJ file is split by its objects and groups. Where one of `names` is none of these, it is split by its materials;
    a file of one material is then one piece with the name of its first object.
    Raises: InputError naming the file, the names that are not in it and those that are.
    """
    if names is None:
        return pieces(path)
    found = pieces(path, groups=path.suffix.lower() == ".obj")
    if _lacking(found, names):
        materials = pieces(path)
        found = found if _lacking(materials, names) else materials
    if _lacking(found, names):
        known = sorted({name for piece in found for name in (piece.geometry, piece.instance)})
        raise InputError(f"{path}: geometry {_lacking(found, names)} is not in it, expected some of {known}")
    return [piece for piece in found if piece.geometry in names or piece.instance in names]


def _lacking(found: list[Piece], names: list[str]) -> list[str]:
    """Return the names that no piece has, as its geometry or its instance."""
    known = {name for piece in found for name in (piece.geometry, piece.instance)}
    return sorted(set(names) - known)
