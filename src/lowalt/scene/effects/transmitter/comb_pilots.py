"""Comb pilots: only every K-th subcarrier carries known symbols; ranges repeat after M / K cells.

The range cells of a comb are as long as those of the whole band; there are M / K of them, and
farther echoes fold into them. A cell is the mean of M / K subcarriers, so its noise is 10 lg K
decibels higher than that of the whole band.
"""

import numpy as np
from scipy import fft

from lowalt.files.errors import InputError
from lowalt.scene.checks import CheckedScene

SOURCE = (
    "3GPP TS 38.211, 7.4.1.5 and 7.4.1.7 (reference signals on combs); C. Sturm, W. Wiesbeck, "
    "Proc. IEEE 99(7), 2011"
)
DEFAULTS = {"spacing": 4, "offset": 0}
IDLE = [{"spacing": 1}]
UNMODELLED = ("fmcw", "cw")


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a comb that does not divide the band, or too large an offset."""
    count = scene.network.subcarriers
    spacing = settings["spacing"]
    offset = settings["offset"]
    if count % spacing or count == spacing:
        raise InputError(
            f"effects.comb_pilots.spacing: {spacing}, expected a proper divisor of {count} "
            "subcarriers"
        )
    if offset >= spacing:
        raise InputError(
            f"effects.comb_pilots.offset: {offset}, expected less than spacing, {spacing}"
        )


def range_cells(settings: dict, response: np.ndarray) -> np.ndarray:
    """Return the range cells (N, M / K) of responses (N, M) whose pilots alone are known."""
    spacing = settings["spacing"]
    offset = settings["offset"]
    cells = fft.ifft(response[:, offset::spacing], axis=1)
    # The transform takes the comb's first subcarrier for subcarrier 0; this is the phase of its own
    # frequency in every range cell.
    cell_numbers = np.arange(cells.shape[1])
    return cells * np.exp(2j * np.pi * offset * cell_numbers / response.shape[1])
