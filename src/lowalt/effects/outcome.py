"""What detection makes of a look: the outcome of a chain of effects."""

from typing import NamedTuple

import numpy as np


class Outcome(NamedTuple):
    """Signal (N,), chosen cells (N,), and magnitude of the strongest cell minus that of the second (N,)."""

    signal: np.ndarray
    cell: np.ndarray
    gap: np.ndarray


def largest_of(outcome: Outcome) -> float:
    """Return the largest magnitude of an outcome's signal (its units)."""
    return float(abs(outcome.signal).max())
