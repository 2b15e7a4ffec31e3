"""The pieces of a mesh file by name: a scene's surfaces, and the objects, groups and materials of an OBJ file.

OBJ, PLY and GLB have readers of their own (`mesh_obj`, `mesh_ply`, `mesh_glb`), which say why; trimesh reads STL and
DAE and places a scene's surfaces. Every error names the file and the reason. This module repairs no surface and knows
no target.
"""

import io
import logging
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.targets.mesh_collada import for_trimesh
from lowalt.targets.mesh_glb import read_glb
from lowalt.targets.mesh_obj import read_obj
from lowalt.targets.mesh_ply import read_ply


@dataclass(frozen=True)
class Piece:
    """A named surface as it stands in the file: `vertices` (V, 3) in file units, `faces` (F, 3) in right-hand order.

    `names` are all those that it can be chosen by, its own first: a place in the scene and the shape there, or the
    object, group and material of an OBJ file.
    """

    names: tuple[str, ...]
    vertices: np.ndarray
    faces: np.ndarray


def _scene(path: Path) -> list[tuple[tuple[str, ...], np.ndarray, np.ndarray]]:
    """Names, vertices and faces of the surfaces of an STL or DAE file, by trimesh."""
    import trimesh  # slow to import, and only records with a mesh need it

    # trimesh logs a traceback of every optional reader that it cannot import; failures are raised below.
    logging.getLogger("trimesh").setLevel(logging.CRITICAL)
    source, names = {"file_obj": path}, {}
    if path.suffix.lower() == ".dae":
        data, names = for_trimesh(path)
        source = {"file_obj": io.BytesIO(data), "file_type": "dae"}
    scene, result = trimesh.load_scene(**source, process=False), []
    for node in sorted(scene.graph.nodes_geometry):
        place, name = scene.graph[node]
        # A chain of transforms is multiplied by the machine's BLAS; its last bits are rounded away.
        place, mesh = np.round(place, 12), scene.geometry[name]
        if not isinstance(mesh, trimesh.Trimesh):
            continue
        # Values that are not finite are refused later, by name.
        with np.errstate(invalid="ignore"):
            vertices = portable.applied(place[:3, :3], mesh.vertices) + place[:3, 3]
        faces = np.asarray(mesh.faces)[:, :: -1 if np.linalg.det(place[:3, :3]) < 0 else 1]
        more = next((found for key, found in names.items() if re.fullmatch(re.escape(key) + r"(_\d+)?", name)), [])
        result.append((tuple(dict.fromkeys((str(node), name, *more))), vertices, faces))
    return result


def pieces(path: Path) -> list[Piece]:
    """Return the pieces of a mesh file that have triangles.

    Raises: InputError naming the file and the reason where it cannot be read.
    """
    read = {".obj": read_obj, ".glb": read_glb, ".ply": read_ply}.get(path.suffix.lower(), _scene)
    try:
        return [Piece(names, vertices, faces) for names, vertices, faces in read(path) if len(faces)]
    except InputError as error:
        text = str(error)
        raise InputError(text if text.startswith(str(path)) else f"{path}: {text}") from None
    except Exception as error:  # readers raise exceptions of many types on damaged files
        raise InputError(f"{path}: not a readable {path.suffix} mesh ({type(error).__name__}: {error})") from None


def selected(path: Path, names: list[str] | None) -> list[Piece]:
    """Return the pieces of a file that have one of `names`; all pieces where names is None.

    Raises: InputError naming the file, the names that are not in it and those that are.
    """
    found = pieces(path)
    if names is None:
        return found
    known = {name for piece in found for name in piece.names}
    if lacking := sorted(set(names) - known):
        raise InputError(f"{path}: geometry {lacking} is not in it, expected some of {sorted(known)}")
    return [piece for piece in found if set(names) & set(piece.names)]
