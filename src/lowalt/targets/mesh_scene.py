"""The pieces of a mesh file by name: a scene's surfaces, and the objects, groups and materials of an OBJ file.

OBJ, PLY and GLB have readers of their own (`mesh_polygons`, `mesh_glb`), which say why; trimesh reads STL and
DAE and places a scene's surfaces. Every error names the file and the reason. This module repairs no surface and knows
no target.
"""

import io
import logging
import re
from pathlib import Path

import numpy as np

from lowalt.files.errors import InputError, reading
from lowalt.targets.mesh_collada import for_trimesh
from lowalt.targets.mesh_glb import read_glb
from lowalt.targets.mesh_polygons import Piece, read_obj, read_ply


def _scene(path: Path) -> list[Piece]:
    """The surfaces of an STL or DAE file, by trimesh."""
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
        more = next((named for key, named in names.items() if re.fullmatch(re.escape(key) + r"(_\d+)?", name)), [])
        piece = Piece(np.asarray(mesh.vertices), np.asarray(mesh.faces), tuple(dict.fromkeys((str(node), name, *more))))
        # Values that are not finite are refused later, by name.
        with np.errstate(invalid="ignore"):
            result.append(piece.mapped(place[:3, :3]).moved(place[:3, 3]))
    return result


def pieces(path: Path) -> list[Piece]:
    """Return the pieces of a mesh file that have triangles.

    Raises: InputError naming the file and the reason where it cannot be read.
    """
    read = {".obj": read_obj, ".glb": read_glb, ".ply": read_ply}.get(path.suffix.lower(), _scene)
    with reading(path, f"{path.suffix} mesh"):
        return [piece for piece in read(path) if len(piece.faces)]


def selected(path: Path, names: list[str] | None) -> list[Piece]:
    """Return the pieces of a file that have one of `names`; all pieces where names is None.

    Raises: InputError naming the file, the names that are not in it and those that are.
    """
    present = pieces(path)
    if names is None:
        return present
    known = {name for piece in present for name in piece.names}
    if lacking := sorted(set(names) - known):
        raise InputError(f"{path}: geometry {lacking} is not in it, expected some of {sorted(known)}")
    return [piece for piece in present if set(names) & set(piece.names)]
