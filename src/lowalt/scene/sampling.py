"""When the symbols of a look are sent, and which of them are received."""

from typing import NamedTuple

import numpy as np


class Sampling(NamedTuple):
    """times_s: (N,) s, start of each symbol; present: (N,) bool, which symbols are received."""

    times_s: np.ndarray
    present: np.ndarray
