"""Linear Gaussian processes driven by white noise, discretised exactly; the motion effects are made of them.

A process x' = F x + g n with white noise n of unit intensity moves over a step h by x <- exp(F h) x + w, and the
covariance of w is known in closed form; no step is too long for it, and none adds an error.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import expm, solve_continuous_lyapunov

from lowalt.common.jit import PLAIN


class Steps(NamedTuple):
    """A process of K states over one step: transition (K, K), and a root (K, K) of the added noise's covariance."""

    transition: np.ndarray
    root: np.ndarray


def root_of(covariance: np.ndarray) -> np.ndarray:
    """Return B (K, K) with B B^T = `covariance`, positive semidefinite to rounding.

    States of very different size are scaled alike first, so that the small ones keep their digits.
    """
    size = np.sqrt(np.diag(covariance))
    scale = np.where(size > 0, size, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    return scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))


def steps(drift: np.ndarray, noise: np.ndarray) -> Steps:
    """Return the exact discretisation over one unit of time of x' = drift x + noise n; (K, K) and (K,).

    Source: Van Loan 1978, "Computing integrals involving the matrix exponential", IEEE Trans. Automatic Control 23.
    """
    count = len(drift)
    # Short enough a part of the step that its exponentials neither grow nor cancel, then doubled.
    halvings = max(0, int(np.ceil(np.log2(max(np.linalg.norm(drift, 1), 1.0)))))
    block = np.zeros((2 * count, 2 * count))
    block[:count, :count] = -drift
    block[:count, count:] = np.outer(noise, noise)
    block[count:, count:] = drift.T
    found = expm(block / 2**halvings)
    transition = found[count:, count:].T
    covariance = transition @ found[:count, count:]
    for _ in range(halvings):
        covariance = covariance + transition @ covariance @ transition.T
        transition = transition @ transition
    return Steps(transition, root_of(0.5 * (covariance + covariance.T)))


def stationary(drift: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Return the covariance (K, K) at which a stable process stays. Source: the Lyapunov equation."""
    return solve_continuous_lyapunov(drift, -np.outer(noise, noise))


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
