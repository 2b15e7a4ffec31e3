"""Triangular roots of a covariance that depends on the lag alone, in time that grows with the square of its size.

Such a covariance is the same for reversed samples, so a symbol's even and odd part about its middle are uncorrelated:
each has a matrix of half the size, and the roots of both take half the products of one root.
Sources: A. W. Bojanczyk, R. P. Brent, F. R. de Hoog, D. R. Sweet, On the stability of the Bareiss and related Toeplitz
factorization algorithms, SIAM J. Matrix Anal. Appl. 16(1), 1995; P. Delsarte, Y. Genin, The split Levinson algorithm,
IEEE Trans. Acoust. Speech Signal Process. 34(3), 1986 (symmetric and antisymmetric predictors).
"""

import numpy as np

from lowalt.common.jit import VECTOR


@VECTOR
def _factored(one, other, even, odd):
    """Fill even and odd as `roots` does; one: the lags (M,), of a positive definite matrix, overwritten.

    one, other: the generators of what the samples so far leave of the matrix. A hyperbolic turn of both takes in a
    further sample and makes the second one begin with zero. Every second turn completes a sample on either side of the
    middle, and sum and difference of the generators are then rows of the roots. other: (M,) work space.
    """
    count, first, half = len(one), np.sqrt(one[0]), np.sqrt(0.5)
    middle = count % 2
    for i in range(np.uint64(count)):
        one[i] /= first
        other[i] = one[i]
    if middle == 1:
        for i in range(np.uint64(len(even))):
            even[0, i] = one[i]
    for k in range(count - 1):
        share = other[1] / one[0]
        if k % 2 == middle:
            row = k // 2
            sums, differences = even[row + middle], odd[row]
            for i in range(np.uint64(row + middle)):
                sums[i] = 0.0
            for i in range(np.uint64(row)):
                differences[i] = 0.0
            sums, differences = sums[row + middle :], differences[row:]
            more, less = half / np.sqrt(1.0 + share), half / np.sqrt(1.0 - share)
            for i in range(np.uint64(len(sums))):
                sums[i] = more * (one[i] + other[i + 1])
                differences[i] = less * (one[i] - other[i + 1])
        rest = np.sqrt((1.0 - share) * (1.0 + share))
        # The second generator from the new first one: products of both old ones would lose digits.
        for i in range(np.uint64(count - k - 1)):
            turned = (one[i] - share * other[i + 1]) / rest
            other[i] = rest * other[i + 1] - share * turned
            one[i] = turned


def roots(lags: np.ndarray, even: np.ndarray, odd: np.ndarray) -> None:
    """Fill even (ceil(M / 2), ceil(M / 2)) and odd (M // 2, M // 2) with upper triangular matrices.

    Independent standard normal numbers times them, (N, ceil(M / 2)) @ even and (N, M // 2) @ odd, are the `parts` of
    samples whose covariance is lags[k] at lag k, (M,), a positive definite matrix.
    """
    _factored(np.array(lags, np.float64), np.empty(len(lags)), even, odd)


def parts(samples: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the even part (N, ceil(M / 2)) and the odd part (N, M // 2) of samples (N, M) about their middle.

    They stand from the middle outward: half the sum, and half the difference, of the later sample and the earlier one
    that is equally far from the middle. For odd M the even part begins with the middle sample.
    """
    half = samples.shape[1] // 2
    later, earlier = samples[:, half:], samples[:, : samples.shape[1] - half][:, ::-1]
    middle = later.shape[1] - half
    return (later + earlier) / 2, (later[:, middle:] - earlier[:, middle:]) / 2


def joined(even: np.ndarray, odd: np.ndarray) -> np.ndarray:
    """Return the samples (N, M) whose `parts` are even (N, ceil(M / 2)) and odd (N, M // 2)."""
    half, middle = odd.shape[1], even.shape[1] - odd.shape[1]
    result = np.empty((len(even), 2 * half + middle))
    result[:, half : half + middle] = even[:, :middle]
    np.add(even[:, middle:], odd, out=result[:, half + middle :])
    np.subtract(even[:, middle:], odd, out=result[:, :half][:, ::-1])
    return result
