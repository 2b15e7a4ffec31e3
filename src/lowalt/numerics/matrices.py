"""3 x 3 matrices in portable operations.

They give the axis of least variance of vectors, and the nearest rotations.
"""

import numpy as np

from lowalt.numerics.portable import dot, product, total


def thinnest(vectors: np.ndarray) -> np.ndarray:
    """Return the unit vector (3,) along which vectors (N, 3) of zero mean vary least.

    Its largest entry is positive.

    Source: Jacobi's rotations of the 3 x 3 matrix of second moments.
    """
    columns = np.asarray(vectors, np.float64).T
    moments = np.empty((3, 3))
    for row, a in enumerate(columns):
        for column, b in enumerate(columns):
            moments[row, column] = total(a * b)
    axes = np.eye(3)
    # Each sweep squares the relative size of the elements off the diagonal.
    for _ in range(12):
        for p, q in ((0, 1), (0, 2), (1, 2)):
            if abs(moments[p, q]) <= 1e-30 * np.diagonal(moments).max():
                continue
            slope = (moments[q, q] - moments[p, p]) / (2 * moments[p, q])
            tangent = 1.0 / (abs(slope) + np.sqrt(slope * slope + 1))
            if slope < 0:
                tangent = -tangent
            cosine = 1 / np.sqrt(tangent * tangent + 1)
            turn = np.eye(3)
            turn[p, p] = turn[q, q] = cosine
            turn[p, q] = tangent * cosine
            turn[q, p] = -tangent * cosine
            moments = product(product(turn.T, moments), turn)
            moments[p, q] = moments[q, p] = 0.0
            axes = product(axes, turn)
    axis = axes[:, np.argmin(np.diagonal(moments))]
    return axis * np.sign(axis[np.argmax(np.abs(axis))]) + 0.0


def nearest_rotations(matrices: np.ndarray) -> np.ndarray:
    """Return the rotations (..., 3, 3) nearest to matrices (..., 3, 3) of positive determinant.

    Source: Newton's iteration for the polar decomposition, Higham 1986.
    """
    result = np.asarray(matrices, np.float64)
    # Each step squares the error; blends of similar rotations need five steps.
    for _ in range(10):
        rows = [result[..., i, :] for i in range(3)]
        crossed = [
            np.cross(rows[1], rows[2]),
            np.cross(rows[2], rows[0]),
            np.cross(rows[0], rows[1]),
        ]
        cofactors = np.stack(crossed, axis=-2)
        determinant = dot(rows[0], crossed[0])[..., None, None]
        result = 0.5 * (result + cofactors / determinant)
    return result
