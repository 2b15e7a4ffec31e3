"""The cube of a sample at one station: the range cells of all symbols, and what is true of the target."""

from typing import NamedTuple

import numpy as np

TRUTH = ("range_m", "radial_mps", "psi", "omega", "cell")
"""What is true of the target's middle at each symbol: range (of a link, the mean of both ways), speed away from the
station, the direction cosines along the array's horizontal and vertical axis, and the range cell."""


class Cube(NamedTuple):
    """cells: (N, M) complex64, range cells of c / (2 M df) metres, zeros where no symbol was received; chosen: (N,)
    int64, the cell that the receiver chose, -1 where no symbol was received; truth: (N, 5) float64, columns `TRUTH`;
    others: the same of each companion in the beam, in the order in which records name them."""

    cells: np.ndarray
    chosen: np.ndarray
    truth: np.ndarray
    others: tuple[np.ndarray, ...] = ()

    @property
    def signal(self) -> np.ndarray:
        """The signal (N,) complex64 of the chosen cells."""
        found = self.cells[np.arange(len(self.cells)), self.chosen]
        return np.where(self.chosen < 0, np.complex64(0), found)
