"""Reading Mitsuba scenes: shapes that are meshes, their poses and the names of their materials.
Nothing is run.

Source: Mitsuba 3, scene format (shape, transform, bsdf, ref) and plugins ply and obj; Sionna RT's
scenes and their materials, whose names are those of ITU-R P.2040.
"""

from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np
from scipy.spatial.transform import Rotation

from lowalt.extensions.town.building_surfaces import Surfaces, joined, mesh_parts, refuse_many
from lowalt.extensions.town.materials import named
from lowalt.files.errors import InputError
from lowalt.targets.mesh_collada import parsed

KINDS = ("ply", "obj")
MOST_SHAPES = 20_000
LARGEST_BYTES = 64 << 20


def _numbers(element: Element, size: int, default: float) -> np.ndarray:
    """The numbers of an element: `value` with one or all, or x, y and z."""
    words = element.get("value", "").replace(",", " ").split()
    if not words:
        words = [element.get(axis, str(default)) for axis in "xyz"]
    if len(words) not in (1, size):
        raise InputError(
            f"<{element.tag}> has {element.get('value')!r}, expected as many numbers as it takes"
        )
    return np.broadcast_to(np.array([float(word) for word in words]), size).copy()


def _pose(shape: Element) -> np.ndarray:
    """The pose (4, 4) of a shape in the scene.

    Each step of its transform acts after those before it.
    """
    result = np.eye(4)
    for transform in shape.findall("transform"):
        if transform.get("name") != "to_world":
            continue
        for step in transform:
            matrix = np.eye(4)
            if step.tag == "translate":
                matrix[:3, 3] = _numbers(step, 3, 0.0)
            elif step.tag == "scale":
                matrix[:3, :3] = np.diag(_numbers(step, 3, 1.0))
            elif step.tag == "rotate":
                axis = np.array([float(step.get(name, 0.0)) for name in "xyz"])
                turn = np.radians(float(step.get("angle", 0.0))) * axis / np.linalg.norm(axis)
                matrix[:3, :3] = Rotation.from_rotvec(turn).as_matrix()
            elif step.tag == "matrix":
                matrix = _numbers(step, 16, 0.0).reshape(4, 4)
            else:
                raise InputError(
                    f"a shape is placed by <{step.tag}>, expected translate, scale, rotate or "
                    "matrix"
                )
            result = matrix @ result
    return result


def _names(bsdf: Element) -> list[str]:
    """The names by which a `bsdf` may mean a material: its string `type`, then its identifier."""
    kinds = [text.get("value", "") for text in bsdf.findall("string") if text.get("name") == "type"]
    return [name for name in (*kinds, bsdf.get("id", "")) if name]


def _material(shape: Element, scene: dict[str, list[str]]) -> tuple[str, str]:
    """The material of a shape, and the name of one that is not known.

    Either is "" for none.

    scene: the names of the materials of the scene by their identifiers.
    """
    names = []
    for reference in shape.findall("ref"):
        identifier = reference.get("id", "")
        names += scene.get(identifier, [identifier])
    for bsdf in shape.findall("bsdf"):
        names += _names(bsdf) or [bsdf.get("type", "")]
    material = next(filter(None, map(named, names)), "")
    unknown = names[0] if names and not material else ""
    return material, unknown


def _file_of(shape: Element, path: Path) -> Path:
    """The mesh file of a shape.

    Raises: InputError where it is not in the folder of the scene, or not there.
    """
    name = ""
    for text in shape.findall("string"):
        if text.get("name") == "filename":
            name = text.get("value", "")
            break
    folder = path.resolve().parent
    try:
        file = (folder / name).resolve()
        inside = bool(name) and file.is_relative_to(folder) and file.is_file()
    except (OSError, ValueError):
        inside = False
    if not inside:
        raise InputError(
            f"{path}: names the mesh {name[:80]!r}, expected a file in the folder of the scene"
        )
    return file


def meshes_of(path: Path) -> list[Path]:
    """Return the mesh files that a Mitsuba scene names, each once. Raises: InputError as `read_mitsuba`."""
    shapes = parsed(path, LARGEST_BYTES).findall("shape")
    return list(
        dict.fromkeys(_file_of(shape, path) for shape in shapes if shape.get("type") in KINDS)
    )


def read_mitsuba(path: Path, unit: str) -> Surfaces:
    """Return the surfaces of a Mitsuba scene, whose axis z is up; unit: of its numbers.

    Shapes other than PLY and OBJ meshes are left out and counted.
    Raises: InputError naming the file: no scene, too large, a mesh outside its folder, or what a
    mesh's reader refuses.
    """
    root = parsed(path, LARGEST_BYTES)
    shapes = root.findall("shape")
    if root.tag != "scene" or len(shapes) > MOST_SHAPES:
        raise InputError(
            f"{path}: <{root.tag}> with {len(shapes)} shapes, expected a scene with at most "
            f"{MOST_SHAPES}"
        )
    materials = {bsdf.get("id", ""): _names(bsdf) for bsdf in root.findall("bsdf")}
    # A scene may name one mesh many times.
    read: dict[Path, list[tuple[np.ndarray, str]]] = {}
    count = 0
    walls = []
    left_out: dict[str, int] = {}
    unknown = []
    for shape in shapes:
        if shape.get("type") not in KINDS:
            label = f"shapes of type {str(shape.get('type'))[:20]}"
            left_out[label] = left_out.get(label, 0) + 1
            continue
        material, unknown_name = _material(shape, materials)
        if unknown_name:
            unknown.append(unknown_name)
        pose = _pose(shape)
        file = _file_of(shape, path)
        if file not in read:
            read[file] = mesh_parts(file, unit, "z")[0]
        for corners, _ in read[file]:
            count += len(corners)
            refuse_many(path, count)
            walls.append((corners @ pose[:3, :3].T + pose[:3, 3], material))
    return joined(walls, left_out, {}, unknown)
