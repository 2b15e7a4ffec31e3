"""Linear Gaussian processes driven by white noise, discretised exactly; the motion effects are made of them.

A process x' = F x + g n with white noise n of unit intensity moves over a step h by x <- exp(F h) x + w, and the
covariance of w is known in closed form; no step is too long for it, and none adds an error. All operations are ones
that IEEE 754 fixes, in one written order, so every processor draws the same walks.
"""

from typing import NamedTuple

import numpy as np

from lowalt.common import portable
from lowalt.common.jit import PLAIN

_ORDER = 24
"""Orders of the exponential's Taylor series; of norms up to 2 the rest is below 2^25 / 25! = 2e-18."""
_LEAST = 1e-15
"""Pivots of a covariance of unit variances that are smaller than this are roundings of zero."""


class Steps(NamedTuple):
    """A process of K states over one step: transition (K, K), and a root (K, K) of the added noise's covariance."""

    transition: np.ndarray
    root: np.ndarray


def root_of(covariance: np.ndarray) -> np.ndarray:
    """Return B (K, K) with B B^T = `covariance`, positive semidefinite to rounding.

    States of very different size are scaled alike first, so that the small ones keep their digits. Source: Cholesky's
    decomposition, the largest pivot first, so that those left out are the smallest: Higham 2002, section 10.3.
    """
    size = np.sqrt(np.diag(covariance))
    scale = np.where(size > 0, size, 1.0)
    rest, root = covariance / (scale[:, None] * scale), np.zeros_like(covariance)
    for column in range(len(rest)):
        place = int(np.argmax(np.diag(rest)))
        if rest[place, place] <= _LEAST:
            break
        root[:, column] = rest[:, place] / np.sqrt(rest[place, place])
        rest = rest - root[:, None, column] * root[None, :, column]
        rest[place], rest[:, place] = 0.0, 0.0
    return scale[:, None] * root


@PLAIN
def exponential(matrix):
    """Return the exponential of a matrix (K, K) whose largest column sum of sizes is at most 2."""
    result = np.eye(len(matrix))
    for order in range(_ORDER, 0, -1):
        before = result.copy()
        for i in range(len(matrix)):
            for j in range(len(matrix)):
                total = matrix[i, 0] * before[0, j]
                for k in range(1, len(matrix)):
                    total += matrix[i, k] * before[k, j]
                result[i, j] = (1.0 if i == j else 0.0) + total / order
    return result


@PLAIN
def _eliminate(table):
    """Turn the first K columns of table (K, K + 1) into the identity by elimination with pivots."""
    for place in range(len(table)):
        pivot = place
        for row in range(place + 1, len(table)):
            pivot = row if abs(table[row, place]) > abs(table[pivot, place]) else pivot
        for column in range(table.shape[1]):
            table[place, column], table[pivot, column] = table[pivot, column], table[place, column]
        largest = table[place, place]
        for column in range(table.shape[1]):
            table[place, column] /= largest
        for row in range(len(table)):
            share = 0.0 if row == place else table[row, place]
            for column in range(table.shape[1]):
                table[row, column] -= share * table[place, column]


def solved(matrix: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return x with matrix x = right, (K, K) and (K,), by elimination with pivots of rows that are scaled alike."""
    scale = np.abs(matrix).max(axis=1)
    table = np.concatenate([matrix, right[:, None]], axis=1) / scale[:, None]
    _eliminate(table)
    return table[:, -1]


def steps(drift: np.ndarray, noise: np.ndarray) -> Steps:
    """Return the exact discretisation over one unit of time of x' = drift x + noise n; (K, K) and (K,).

    Source: Van Loan 1978, "Computing integrals involving the matrix exponential", IEEE Trans. Automatic Control 23.
    """
    count = len(drift)
    # Compute a part of the step so short that its exponentials neither grow nor cancel, then double it repeatedly.
    halvings = max(0, int(np.frexp(portable.total(np.abs(drift), axis=0).max())[1]))
    block = np.zeros((2 * count, 2 * count))
    block[:count, :count] = -drift
    block[:count, count:] = noise[:, None] * noise
    block[count:, count:] = drift.T
    found = exponential(block / 2**halvings)
    transition = found[count:, count:].T
    covariance = portable.product(transition, found[:count, count:])
    for _ in range(halvings):
        covariance = covariance + portable.product(portable.product(transition, covariance), transition.T)
        transition = portable.product(transition, transition)
    return Steps(transition, root_of(0.5 * (covariance + covariance.T)))


def stationary(drift: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Return the covariance (K, K) at which a stable process stays. Source: the Lyapunov equation."""
    one = np.eye(len(drift))
    # F P + P F^T = -g g^T, all K^2 equations at once.
    matrix = (drift[:, None, :, None] * one[None, :, None] + one[:, None, :, None] * drift[None, :, None]).reshape(
        one.size, one.size
    )
    found = solved(matrix, -(noise[:, None] * noise).ravel()).reshape(one.shape)
    return 0.5 * (found + found.T)


@PLAIN
def _walk(transition, root, normal, out):
    """Fill out (B, N, K), whose first row is set, with B independent walks."""
    count = out.shape[2]
    for b in range(out.shape[0]):
        for n in range(1, out.shape[1]):
            for i in range(count):
                total = 0.0
                for j in range(count):
                    total += transition[b, i, j] * out[b, n - 1, j] + root[b, i, j] * normal[b, n - 1, j]
                out[b, n, i] = total


def walk(processes: list[Steps], start: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return B walks (B, N, K) from `start` (B, K), driven by standard normals (B, N - 1, K)."""
    out = np.empty((len(start), normal.shape[1] + 1, start.shape[1]))
    out[:, 0] = start
    transition = np.ascontiguousarray([process.transition for process in processes])
    _walk(transition, np.ascontiguousarray([process.root for process in processes]), normal, out)
    return out


def step_s(times_s: np.ndarray) -> float:
    """Return the step (s) between equally spaced times (N,) s; 1 where there is only one."""
    return float(times_s[-1] - times_s[0]) / (len(times_s) - 1) if len(times_s) > 1 else 1.0
