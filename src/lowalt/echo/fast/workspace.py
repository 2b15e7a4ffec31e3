"""Tuples of inputs and work arrays for the driver of the fast kernel.

The driver is compiled without reference counting and cannot allocate, so all its arrays are
allocated here.
"""

from typing import NamedTuple

import numpy as np

from lowalt.echo.fast.cell_kernel import SIDE, CellPolynomials
from lowalt.echo.fast.error_model import ArrayGains, EchoPlan
from lowalt.echo.fast.polynomials import TOP
from lowalt.echo.fast.strip import STRIP_ROOM, Offsets, Strip


class Approximation(NamedTuple):
    """All approximations: the plan's polynomials, the array gains as sums of cosines, the cell
    kernels, and the weights of `polynomials.folding`."""

    plan: EchoPlan
    gains: ArrayGains
    cells: CellPolynomials
    fold: np.ndarray


class Symbols(NamedTuple):
    """The symbols to compute: index (B,) of each in the sample, and the rows of its tables:
    reference ranges (B, 7), extents (B, 5), and the segments (S, 6) that B symbols fall into."""

    index: np.ndarray  # type: ignore[assignment]  # a tuple's own method of this name is not used
    refs: np.ndarray
    extents: np.ndarray
    segments: np.ndarray


class Found(NamedTuple):
    """The results of every symbol, each (N,): the strongest cell's value and index;
    `strongest_cell`'s state; sum of |amplitudes|; bound of the value's error; whether there is a
    near-tie; certified lead over every other cell."""

    values: np.ndarray
    cells: np.ndarray
    state: np.ndarray
    totals: np.ndarray
    bounds: np.ndarray
    ties: np.ndarray
    gaps: np.ndarray

    @classmethod
    def empty(cls, count: int) -> "Found":
        """Return room for `count` symbols, none of them computed."""
        return cls(
            np.zeros(count, np.complex128),
            np.zeros(count, np.int64),
            np.ones(count, np.int64),
            np.zeros(count),
            np.zeros(count),
            np.zeros(count, np.bool_),
            np.zeros(count),
        )


class Workspace(NamedTuple):
    """Work arrays: Taylor terms of a gain (3, rates); moments (2, orders); gain coefficients (2,
    TOP + 1), in float64 and in the strip's type; cell sums (2 SIDE + 1, 2); bounds for far cells
    (4,); a strip's arrays; and every point's share (padded L,) of the sum of amplitudes, in the
    strip's type."""

    taylor: np.ndarray
    moments: np.ndarray
    coefficients: np.ndarray
    typed: np.ndarray
    sums: np.ndarray
    far: np.ndarray
    offsets: Offsets
    strip: Strip
    share: np.ndarray


def workspace(approximation: Approximation, amplitude: np.ndarray) -> Workspace:
    """Return work arrays for an approximation and the points' amplitudes (padded L,).

    The strip's arrays are separate allocations of odd length, because rows of one array would be a
    multiple of 4096 bytes apart, and loads would wait for unrelated stores (4K aliasing).
    """
    kind = np.float32 if approximation.plan.single else np.float64
    gains = approximation.gains
    rates = max(len(gains.horizontal.rates), len(gains.vertical.rates))
    total = amplitude.sum()
    return Workspace(
        np.empty((3, rates)),
        np.empty((2, approximation.cells.kernels.shape[2])),
        np.empty((2, TOP + 1)),
        np.empty((2, TOP + 1), kind),
        np.empty((2 * SIDE + 1, 2)),
        np.empty(4),
        Offsets(*(np.empty(STRIP_ROOM) for _ in Offsets._fields)),
        Strip(*(np.empty(STRIP_ROOM, kind) for _ in Strip._fields)),
        (amplitude / total if total > 0 else amplitude).astype(kind),
    )
