"""Linear Gaussian processes driven by white noise, discretised exactly.

The motion effects use them.

A process x' = F x + g n with white noise n of unit intensity changes over a step h to

    x <- exp(F h) x + w,

where the covariance of w is known in closed form. This is exact for steps of any length. Only
operations that IEEE 754 defines are used, in a fixed order, so every processor draws the same
walks.
"""

from typing import NamedTuple

import numpy as np

from lowalt.machine.jit import PLAIN
from lowalt.numerics import portable

_ORDER = 24
"""Orders of the exponential's Taylor series; of norms up to 2 the rest is below 2^25 / 25! = 2e-18.
"""
_LEAST = 1e-15
"""Pivots of a covariance of unit variances that are smaller than this are roundings of zero."""
_FORGOTTEN = 1e-12
"""Share of a state that is left when it counts as forgotten."""


class Steps(NamedTuple):
    """A process of K states over one step.

    transition: (K, K); added: (K, K), the covariance of the noise that a step adds.
    """

    transition: np.ndarray
    added: np.ndarray


def root_of(covariance: np.ndarray) -> np.ndarray:
    """Return B (K, K) with B B^T = `covariance`, positive semidefinite to rounding.

    States of very different size are scaled alike first, so that the small ones keep their digits.
    Source: Cholesky's decomposition, the largest pivot first, so that those left out are the
    smallest: Higham 2002, section 10.3.
    """
    size = np.sqrt(np.diag(covariance))
    scale = np.where(size > 0, size, 1.0)
    left = covariance / (scale[:, None] * scale)
    root = np.zeros_like(covariance)
    # Ones, and no roundings of one: the first pivot is then the same on every processor.
    np.fill_diagonal(left, size > 0)
    for column in range(len(left)):
        pivot = int(np.argmax(np.diag(left)))
        if left[pivot, pivot] <= _LEAST:
            break
        root[:, column] = left[:, pivot] / np.sqrt(left[pivot, pivot])
        left = left - root[:, None, column] * root[None, :, column]
        left[pivot] = 0.0
        left[:, pivot] = 0.0
    return scale[:, None] * root


def exponential(matrix: np.ndarray) -> np.ndarray:
    """Return the exponential of a matrix (K, K) by its series.

    The largest column sum of the sizes of its entries is at most 2.
    """
    unit = np.eye(len(matrix))
    result = unit
    for order in range(_ORDER, 0, -1):
        result = unit + portable.product(matrix, result) / order
    return result


def _twice(process: Steps) -> Steps:
    """The process over a step of twice the length."""
    transition, added = process
    carried = portable.product(portable.product(transition, added), transition.T)
    return Steps(portable.product(transition, transition), added + carried)


def steps(drift: np.ndarray, noise: np.ndarray) -> Steps:
    """Return the exact discretisation over one unit of time of x' = drift x + noise n.

    drift: (K, K); noise: (K,).

    Source: Van Loan 1978, "Computing integrals involving the matrix exponential", IEEE Trans.
    Automatic Control 23.
    """
    count = len(drift)
    # Compute a piece of the step so short that its exponentials neither grow nor cancel, then
    # double it repeatedly.
    largest = portable.total(np.abs(drift), axis=0).max()
    halvings = max(0, int(np.frexp(largest)[1]))
    block = np.zeros((2 * count, 2 * count))
    block[:count, :count] = -drift
    block[:count, count:] = noise[:, None] * noise
    block[count:, count:] = drift.T
    short = exponential(block / 2**halvings)
    transition = short[count:, count:].T
    process = Steps(transition, portable.product(transition, short[:count, count:]))
    for _ in range(halvings):
        process = _twice(process)
    return Steps(process.transition, 0.5 * (process.added + process.added.T))


def stationary(process: Steps) -> np.ndarray:
    """Return the stationary covariance (K, K) of a stable process.

    After so many steps, its start is forgotten.
    """
    while abs(process.transition).max() > _FORGOTTEN:
        process = _twice(process)
    return 0.5 * (process.added + process.added.T)


@PLAIN
def _walk(transition, root, normal, out):
    """Fill out (B, N, K), whose first row is set, with B independent walks."""
    count = out.shape[2]
    for b in range(out.shape[0]):
        for n in range(1, out.shape[1]):
            for i in range(count):
                total = 0.0
                for j in range(count):
                    moved = transition[b, i, j] * out[b, n - 1, j]
                    total += moved + root[b, i, j] * normal[b, n - 1, j]
                out[b, n, i] = total


def walk(processes: list[Steps], start: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return B walks (B, N, K) from `start` (B, K), driven by standard normals (B, N - 1, K)."""
    out = np.empty((len(start), normal.shape[1] + 1, start.shape[1]))
    out[:, 0] = start
    transition = np.ascontiguousarray([process.transition for process in processes])
    root = np.ascontiguousarray([root_of(process.added) for process in processes])
    _walk(transition, root, normal, out)
    return out


def step_s(times_s: np.ndarray) -> float:
    """Return the step (s) between equally spaced times (N,) s; 1 where there is only one."""
    if len(times_s) == 1:
        return 1.0
    return float(times_s[-1] - times_s[0]) / (len(times_s) - 1)
