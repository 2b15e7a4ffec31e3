"""The triangles of a file of buildings as its reader finds them, with the names of their materials."""

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.extensions.town.materials import named
from lowalt.targets.mesh_files import metres, pieces


class Surfaces(NamedTuple):
    """Triangles as a reader finds them: corners (F, 3, 3) m; material (F,), numbers of `names`, "" where the file names
    none; left_out: what the reader left out, in words, with how many."""

    corners: np.ndarray
    material: np.ndarray
    names: tuple[str, ...]
    left_out: dict[str, int]


def joined(parts: Iterable[tuple[np.ndarray, str]], left_out: dict[str, int]) -> Surfaces:
    """Return the surfaces of parts, each the corners (F, 3, 3) and the name of their material."""
    parts = list(parts)
    names = tuple(dict.fromkeys(name for _, name in parts))
    material = np.repeat([names.index(name) for _, name in parts], [len(corners) for corners, _ in parts])
    corners = np.concatenate([np.zeros((0, 3, 3)), *(corners for corners, _ in parts)])
    return Surfaces(corners, material.astype(np.int64), names, left_out)


def mesh_parts(path: Path, unit: str, up: str) -> list[tuple[np.ndarray, str]]:
    """Return the corners (F, 3, 3) m, z up, and the material's name of each piece of a mesh file.

    Raises: InputError as the readers of `targets.mesh_files`.
    """
    result = []
    for piece in pieces(path):
        corners = np.asarray(piece.vertices, float)[piece.faces] * metres(unit)
        if up == "y":
            corners = np.stack([corners[..., 0], -corners[..., 2], corners[..., 1]], axis=-1)
        result.append((corners, next(filter(None, map(named, piece.names)), "")))
    return result
