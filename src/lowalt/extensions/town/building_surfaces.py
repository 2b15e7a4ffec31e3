"""The triangles of a file of buildings as its reader finds them, and their materials' names."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.extensions.town.materials import named
from lowalt.files.errors import InputError
from lowalt.targets.mesh_files import metres, pieces


class Surfaces(NamedTuple):
    """Triangles as a reader finds them.

    corners: (F, 3, 3) m; material: (F,), numbers of `names`, of which "" stands where the file
    names none; left_out: what the reader left out, in words, with how many; notes: what it read
    otherwise than the file states, in the same way; unknown: names of materials that no table has,
    one for each surface.
    """

    corners: np.ndarray
    material: np.ndarray
    names: tuple[str, ...]
    left_out: Mapping[str, int]
    notes: Mapping[str, int]
    unknown: Sequence[str]


MOST_TRIANGLES = 500_000


def refuse_many(path: Path, triangles: int) -> None:
    """Raise InputError naming the file for more than MOST_TRIANGLES; readers count before they make
    them.
    """
    if triangles > MOST_TRIANGLES:
        raise InputError(f"{path}: {triangles} triangles, expected at most {MOST_TRIANGLES}")


def such_as(values: Iterable[str]) -> str:
    """Return the first three different values of a file in words, ", such as 'a' and 'b'"."""
    different = list(dict.fromkeys(values))[:3]
    return ", such as " + " and ".join(repr(value[:40]) for value in different)


def joined(
    walls: Iterable[tuple[np.ndarray, str]],
    left_out: Mapping[str, int],
    notes: Mapping[str, int],
    unknown: Sequence[str],
) -> Surfaces:
    """Return the surfaces of walls, each the corners (F, 3, 3) m and the name of their material.

    left_out, notes, unknown: see `Surfaces`.
    """
    corners = [np.zeros((0, 3, 3))]
    material = [np.zeros(0, np.int64)]
    names: dict[str, int] = {}
    for triangles, name in walls:
        number = names.setdefault(name, len(names))
        corners.append(triangles)
        material.append(np.full(len(triangles), number))
    return Surfaces(
        np.concatenate(corners), np.concatenate(material), tuple(names), left_out, notes, unknown
    )


def mesh_parts(path: Path, unit: str, up: str) -> tuple[list[tuple[np.ndarray, str]], list[str]]:
    """Return the pieces of a mesh file, and the names of those that are called like no material.

    A piece is its corners (F, 3, 3) m, z up, and its material's name, "" for none that is known.

    Raises: InputError as the readers of `targets.mesh_files`.
    """
    result = []
    unknown = []
    found = pieces(path)
    refuse_many(path, sum(len(piece.faces) for piece in found))
    for piece in found:
        corners = np.asarray(piece.vertices, float)[piece.faces] * metres(unit)
        if up == "y":
            corners = np.stack([corners[..., 0], -corners[..., 2], corners[..., 1]], axis=-1)
        material = next(filter(None, map(named, piece.names)), "")
        result.append((corners, material))
        # A piece without a name of its own has its file's.
        own = [name for name in piece.names if name and name not in (path.name, path.stem)]
        if own and not material:
            unknown.append(own[0])
    return result, unknown
