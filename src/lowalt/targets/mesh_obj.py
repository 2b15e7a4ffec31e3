"""Reading OBJ files: vertices, faces and the names of objects, groups and materials; the rest of the format is left.

trimesh counts negative indices from the file's end, cuts polygons as fans and splits by one kind of name at a time.
Source: Wavefront's Object Files (.obj), version 3.0.
"""

import re
from pathlib import Path

import numpy as np

from lowalt.files.errors import InputError
from lowalt.targets.mesh_polygons import Piece, triangulated

NAMES = ("o", "g", "usemtl")


def read_obj(path: Path) -> list[Piece]:
    """Return the surface of each object, group and material of a file.

    Raises: InputError naming the file and the line that cannot be read, or the face that has no such vertex.
    """
    places: list[list[float]] = []
    corners: list[int] = []
    counts: list[int] = []
    owners: list[int] = []
    keys: dict[tuple[str, ...], int] = {}
    now = dict.fromkeys(NAMES, "")
    text = path.read_text(encoding="utf-8-sig", errors="replace").replace("\\\n", " ")
    for number, line in enumerate(text.splitlines(), 1):
        word, _, values = line.strip().partition(" ")
        try:
            if word == "v":
                places.append([*map(float, values.split()[:3])])
                if len(places[-1]) < 3:
                    raise ValueError("fewer than three coordinates")
            elif word == "f":
                face = [int(corner.split("/", 1)[0]) for corner in values.split("#", 1)[0].split()]
                # A negative index counts back from the vertices so far.
                corners += [index - 1 if index > 0 else len(places) + index if index else -1 for index in face]
                counts.append(len(face))
                owners.append(keys.setdefault(tuple(now.values()), len(keys)))
            elif word in NAMES:
                now[word] = values.strip()
        except (ValueError, OverflowError) as error:
            raise InputError(f"{path}: line {number}: {line.strip()[:60]!r} cannot be read ({error})") from None
    vertices = np.array(places, float).reshape(-1, 3)
    faces, polygon = triangulated(vertices, np.array(counts, int), np.array(corners, int))
    owner, pieces = np.array(owners, int)[polygon], []
    # trimesh's own names of materials, from the last to the first, which records may have.
    base = next((names[0] for names in keys if names[0]), path.name)
    materials = list(dict.fromkeys(names[2] for names in keys))[::-1]
    older = {name: f"{base}_{index}" if index else base for index, name in enumerate(materials)}
    for names, index in keys.items():
        used, inverse = np.unique(faces[owner == index], return_inverse=True)
        known = [name for name in names if name] or [path.name]
        known += [older[names[2]]] if len(materials) > 1 and older[names[2]] not in {key[0] for key in keys} else []
        pieces.append(Piece(vertices[used], inverse.reshape(-1, 3), tuple(dict.fromkeys(known))))
    return pieces


def stated_unit(path: Path) -> str:
    """Return the unit that a comment at the start of an OBJ file names, as a word of `UNITS_M`; "" where none does.

    Blender, SketchUp and others write such as "# File units = inches"; a comment names it after the word unit.
    """
    words = {"m": "met(?:er|re)s?|m", "cm": "centimet(?:er|re)s?|cm", "mm": "millimet(?:er|re)s?|mm",
             "in": "inch(?:es)?|in", "ft": "f(?:ee|oo)t|ft"}  # fmt: skip
    with path.open(errors="replace") as file:
        for line, _ in zip(file, range(200), strict=False):
            stated = re.match(r"\s*#.*\bunits?\b\W*(?:(?:in|is|are)\b)?\W*1?\W*([a-z]+)", line, re.IGNORECASE)
            for unit, pattern in words.items() if stated else ():
                if re.fullmatch(pattern, stated[1], re.IGNORECASE):
                    return unit
    return ""
