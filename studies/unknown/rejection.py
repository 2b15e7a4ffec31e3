"""Scores that say how well a window fits the classes that a network knows.

A score is high for a window of a known class. A window is kept where its score is at least a threshold.
"""

import numpy as np
from scipy.special import logsumexp

KEPT = 0.95
"""Share of the known windows that a threshold keeps."""


def probability(logits: np.ndarray, known: int) -> np.ndarray:
    """Return the largest probability (n,) of the first `known` classes, of logits (n, classes).

    Source: Hendrycks and Gimpel, A baseline for detecting misclassified and out-of-distribution examples, 2017.
    """
    return np.exp(logits[:, :known].max(1) - logsumexp(logits, axis=1))


def energy(logits: np.ndarray, known: int) -> np.ndarray:
    """Return the negative free energy (n,) of the first `known` classes at temperature 1, of logits (n, classes).

    Source: Liu et al., Energy-based out-of-distribution detection, 2020, Eq. 4.
    """
    return logsumexp(logits[:, :known], axis=1)


def no_extra(logits: np.ndarray, known: int) -> np.ndarray:
    """Return the log odds (n,) that a window is of one of the first `known` classes and not of the extra one."""
    return logsumexp(logits[:, :known], axis=1) - logits[:, known]


def level(known: np.ndarray, of_known: np.ndarray, kept: float = KEPT) -> float:
    """Return the largest threshold that keeps at least the share `kept` of known windows.

    known (n,): their scores; of_known (n,): how often each counts.
    """
    order = np.argsort(-known, kind="stable")
    reached = np.cumsum(of_known[order])
    place = np.searchsorted(reached, kept * reached[-1] * (1 - 1e-12))
    return float(known[order[min(place, len(known) - 1)]])
