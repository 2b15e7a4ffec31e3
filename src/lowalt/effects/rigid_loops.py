"""Compiled loops that carry points and normals along with the rigid parts of a target."""

import numpy as np

from lowalt.common.jit import kernel

LOOPS = kernel(error_model="numpy")


@LOOPS
def carried(rotation, translation, vectors, part, out):
    """Fill out (N, L, 3) with rotation[n, part[l]] @ vectors[l] + translation[n, part[l]].

    rotation: (N, P, 3, 3); translation: (N, P, 3); vectors: (L, 3); part: (L,).
    """
    for n in range(rotation.shape[0]):
        for l in range(len(vectors)):  # noqa: E741
            p = part[l]
            x, y, z = vectors[l, 0], vectors[l, 1], vectors[l, 2]
            for i in range(3):
                turned = rotation[n, p, i, 0] * x + rotation[n, p, i, 1] * y + rotation[n, p, i, 2] * z
                out[n, l, i] = turned + translation[n, p, i]


def carry(rotation: np.ndarray, translation: np.ndarray | None, vectors: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Return rotation[n, part[l]] @ vectors[l] + translation[n, part[l]], (N, L, 3); no translation for directions."""
    if translation is None:
        translation = np.zeros((*rotation.shape[:2], 3))
    out = np.empty((len(rotation), len(vectors), 3))
    carried(
        np.ascontiguousarray(rotation), np.ascontiguousarray(translation), np.ascontiguousarray(vectors),
        np.asarray(part, np.int64), out,
    )  # fmt: skip
    return out
