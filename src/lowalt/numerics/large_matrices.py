"""Large real matrices in a written order of operations, compiled.

There are products, triangular roots and principal axes.

A BLAS chooses its kernels, and with them the order of its sums, by the processor. These loops add
each sum from the first term on and take half to twice the time.
"""

import numpy as np

from lowalt.machine.jit import INNER, LEAN

SWEEPS = 40
"""Most sweeps of Jacobi's rotations; convergence is quadratic, and ten are enough."""
ORTHOGONAL = 1e-15
"""Cosine between two rows below which they count as orthogonal."""


@LEAN
def multiply(a, b, out):
    """Fill out (I, J) with a (I, K) times b (K, J), each sum from the first k on."""
    inner, columns = b.shape
    for i in range(len(out)):
        row = out[i]
        for j in range(np.uint64(columns)):
            row[j] = a[i, 0] * b[0, j]
        k = 1
        # Four terms share a pass over the row; each is still added by itself, the lowest k first.
        while k + 4 <= inner:
            p = a[i, k]
            q = a[i, k + 1]
            r = a[i, k + 2]
            s = a[i, k + 3]
            for j in range(np.uint64(columns)):
                row[j] = (((row[j] + p * b[k, j]) + q * b[k + 1, j]) + r * b[k + 2, j]) + s * b[
                    k + 3, j
                ]
            k += 4
        while k < inner:
            p = a[i, k]
            for j in range(np.uint64(columns)):
                row[j] += p * b[k, j]
            k += 1


def matrix_product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the product (I, J) of real matrices (I, K) and (K, J), K > 0.

    It equals `portable.product` in every bit.
    """
    out = np.empty((a.shape[0], b.shape[1]))
    multiply(np.ascontiguousarray(a, np.float64), np.ascontiguousarray(b, np.float64), out)
    return out


@LEAN
def _factor(left):
    """Replace the upper triangle of left (N, N) by its Cholesky factor, row by row."""
    count = len(left)
    for k in range(count):
        pivot = left[k]
        root = np.sqrt(pivot[k])
        for j in range(k, count):
            pivot[j] /= root
        for i in range(k + 1, count):
            row = left[i]
            share = pivot[i]
            for j in range(np.uint64(i), np.uint64(count)):
                row[j] -= share * pivot[j]


def upper_root(covariance: np.ndarray) -> np.ndarray:
    """Return the upper triangular U (N, N) with U^T U = `covariance`.

    covariance: symmetric and positive definite.

    Raises: ValueError for a matrix that is not positive definite. Source: Cholesky's decomposition,
    Higham 2002, 10.1.
    """
    result = np.array(covariance, np.float64)
    with np.errstate(invalid="ignore", divide="ignore"):
        _factor(result)
    if not np.isfinite(result.diagonal()).all():
        raise ValueError("the covariance is not positive definite")
    return np.triu(result)


@INNER
def _along(first, second):
    """Return the sum of first times second, (N,) each.

    Every fourth product is added by itself, then these four sums.
    """
    a = 0.0
    b = 0.0
    c = 0.0
    d = 0.0
    whole = len(first) // 4 * 4
    for i in range(0, whole, 4):
        a += first[i] * second[i]
        b += first[i + 1] * second[i + 1]
        c += first[i + 2] * second[i + 2]
        d += first[i + 3] * second[i + 3]
    for i in range(whole, len(first)):
        a += first[i] * second[i]
    return (a + b) + (c + d)


@LEAN
def _orthogonalise(rows, square):
    """Rotate pairs of rows (K, N) until all are orthogonal.

    Returns whether they are. square: (K,) work space.
    """
    for _ in range(SWEEPS):
        turned = False
        for p in range(len(rows)):
            square[p] = _along(rows[p], rows[p])
        for p in range(len(rows) - 1):
            for q in range(p + 1, len(rows)):
                first = rows[p]
                second = rows[q]
                both = _along(first, second)
                # The products are those of the sweep's beginning, carried along by the rotations.
                if abs(both) <= ORTHOGONAL * np.sqrt(square[p] * square[q]):
                    continue
                turned = True
                slope = (square[q] - square[p]) / (2.0 * both)
                tangent = 1.0 / (abs(slope) + np.sqrt(slope * slope + 1.0))
                if slope < 0.0:
                    tangent = -tangent
                cosine = 1.0 / np.sqrt(tangent * tangent + 1.0)
                sine = tangent * cosine
                square[p] = max(square[p] - tangent * both, 0.0)
                square[q] += tangent * both
                for i in range(np.uint64(len(first))):
                    a = first[i]
                    b = second[i]
                    first[i] = cosine * a - sine * b
                    second[i] = sine * a + cosine * b
        if not turned:
            return True
    return False


def principal_axes(root: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the eigenvalues (K,) of B B^T for a root B (N, K), and its unit eigenvectors (N, K).

    They are in no order.

    Eigenvectors of eigenvalue 0 are zeros. Raises: ValueError where the rotations do not converge.
    Source: one-sided Jacobi rotations of a pivoted Cholesky factor, Demmel and Veselic 1992,
    accurate in every digit.
    """
    rows = np.array(root.T, np.float64, order="C")
    if not _orthogonalise(rows, np.empty(len(rows))):
        raise ValueError("Jacobi's rotations do not converge")
    power = np.add.accumulate(rows * rows, axis=1)[:, -1]
    size = np.sqrt(power)
    return power, (rows / np.where(size > 0, size, 1.0)[:, None]).T
