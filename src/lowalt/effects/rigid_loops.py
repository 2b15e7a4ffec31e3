"""Compiled loops that carry points and normals along with the rigid parts of a target."""

import numpy as np

from lowalt.common.jit import kernel

LOOPS = kernel(error_model="numpy")


@LOOPS
def placed(rotation, translation, planes, part, out):
    """Fill out (3, L) with rotation[part[l]] @ planes[:, l] + translation[part[l]].

    rotation: (P, 3, 3); translation: (P, 3); planes: (3, L) coordinates; part: (L,). Points of a part that follow each
    other pass through one loop, whose operations are done as written.
    """
    count, first = len(part), 0
    x, y, z = planes[0], planes[1], planes[2]
    while first < count:
        p, last = part[first], first
        while last < count and part[last] == p:
            last += 1
        for i in range(3):
            a, b, c, t = rotation[p, i, 0], rotation[p, i, 1], rotation[p, i, 2], translation[p, i]
            row = out[i]
            for l in range(np.uint64(first), np.uint64(last)):  # noqa: E741
                row[l] = a * x[l] + b * y[l] + c * z[l] + t
        first = last


@LOOPS
def carried(rotation, translation, planes, part, out):
    """Fill out (N, 3, L) with what `placed` gives under rotation (N, P, 3, 3) and translation (N, P, 3)."""
    for n in range(rotation.shape[0]):
        placed(rotation[n], translation[n], planes, part, out[n])


def carry(rotation: np.ndarray, translation: np.ndarray | None, vectors: np.ndarray, part: np.ndarray) -> np.ndarray:
    """Return rotation[n, part[l]] @ vectors[l] + translation[n, part[l]], (N, L, 3); no translation for directions.

    In memory each coordinate of a symbol's points stands together, as the vector loops of `response_loops` take them.
    """
    if translation is None:
        translation = np.zeros((*rotation.shape[:2], 3))
    out = np.empty((len(rotation), 3, len(vectors)))
    carried(
        np.ascontiguousarray(rotation), np.ascontiguousarray(translation), np.ascontiguousarray(vectors.T),
        np.asarray(part, np.int64), out,
    )  # fmt: skip
    return out.swapaxes(1, 2)
