"""The cube of a sample at one station: the range cells of all symbols, and the ground truth."""

from typing import NamedTuple

import numpy as np

TRUTH = ("range_m", "radial_mps", "psi", "omega", "cell", "observed_cell", "observed_mps")
"""What is true of the target's middle at each symbol.

The geometric truth: range (of a link, the mean of both ways), speed away from the station, the
direction cosines along the array's horizontal and vertical axis, and the nearest range cell. The
observed truth, where the effects of the scene (clock and carrier offsets, the range-Doppler
coupling of FMCW) let the echo appear: the range cell with its fraction, 0 to M, and the folded
speed at the effective carrier. Both cells are -1 where no symbol was received."""


class Cube(NamedTuple):
    """The range cells of all symbols of a sample at one station.

    cells: (N, M) complex64, range cells of c / (2 M df) metres, zeros where no symbol was received;
    chosen: (N,) int64, the cell that the receiver chose, -1 where no symbol was received; truth:
    (N, 7) float64, columns `TRUTH`; others: the same of each companion in the beam, in the order in
    which records name them.
    """

    cells: np.ndarray
    chosen: np.ndarray
    truth: np.ndarray
    others: tuple[np.ndarray, ...] = ()

    @property
    def signal(self) -> np.ndarray:
        """The signal (N,) complex64 of the chosen cells."""
        found = self.cells[np.arange(len(self.cells)), self.chosen]
        return np.where(self.chosen < 0, np.complex64(0), found)
