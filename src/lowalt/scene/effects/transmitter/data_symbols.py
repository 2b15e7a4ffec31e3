"""Data of square QAM instead of QPSK.

Division by the known symbol raises the noise of weak symbols.

A subcarrier that carried a symbol s has noise of 1 / |s|^2 times the receiver's after the division.
On average that is 2.8 dB for 16-QAM and 4.3 dB for 64-QAM. An echo without noise is the same as
with QPSK.
"""

import numpy as np

SOURCE = (
    "3GPP TS 38.211, 5.1.4 and 5.1.5 (square QAM of mean power one); noise after division by the "
    "symbol: C. Sturm, W. Wiesbeck, Waveform design and signal processing aspects for fusion of "
    "wireless communications and radar sensing, Proc. IEEE 99(7), 2011"
)
DEFAULTS = {"order": 16}
IDLE = [{"order": 4}]
UNMODELLED = ("fmcw", "cw")


def constellation(order: int) -> np.ndarray:
    """Return all symbols (order,) complex128 of square QAM, of mean power one."""
    side = np.arange(1 - np.sqrt(order), np.sqrt(order), 2.0)
    points = (side[:, None] + 1j * side).ravel()
    return points / np.sqrt(np.mean(abs(points) ** 2))


def data(settings: dict, symbols: int, subcarriers: int, rng: np.random.Generator) -> np.ndarray:
    """Return random data (symbols, subcarriers) complex128.

    All points of the constellation are equally likely.
    """
    return constellation(settings["order"])[
        rng.integers(0, settings["order"], (symbols, subcarriers))
    ]
