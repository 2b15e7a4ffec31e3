"""The triangular root of a covariance that depends on the lag alone, in time that grows with the square of its size."""

import numpy as np

from lowalt.common.jit import VECTOR


@VECTOR
def _factored(one, other, upper):
    """Fill upper (M, M) with the root's transpose; one: the lags (M,), of a positive definite matrix, overwritten.

    Each row is the first of two generators of what the rows above leave of the matrix; a hyperbolic turn of both makes
    the second one begin with zero. other: (M,) work space.
    """
    count, first = len(one), np.sqrt(one[0])
    for i in range(np.uint64(count)):
        one[i] /= first
        other[i] = one[i]
    for k in range(count):
        row, size = upper[k], count - k
        for i in range(np.uint64(k)):
            row[i] = 0.0
        for i in range(np.uint64(size)):
            row[k + i] = one[i]
        if size == 1:
            return
        share = other[1] / one[0]
        rest = np.sqrt((1.0 - share) * (1.0 + share))
        # The second generator from the new first one: products of both old ones would lose digits.
        for i in range(np.uint64(size - 1)):
            turned = (one[i] - share * other[i + 1]) / rest
            other[i] = rest * other[i + 1] - share * turned
            one[i] = turned


def upper(lags: np.ndarray, out: np.ndarray) -> None:
    """Fill out (M, M) with the transpose of `root`."""
    _factored(np.array(lags, np.float64), np.empty(len(lags)), out)


def root(lags: np.ndarray) -> np.ndarray:
    """Return the lower Cholesky root (M, M) of the positive definite matrix whose entry i, j is lags[|i - j|], (M,).

    Source: A. W. Bojanczyk, R. P. Brent, F. R. de Hoog, D. R. Sweet, On the stability of the Bareiss and related
    Toeplitz factorization algorithms, SIAM J. Matrix Anal. Appl. 16(1), 1995.
    """
    transposed = np.empty((len(lags), len(lags)))
    upper(lags, transposed)
    return transposed.T
