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
    """All approximations of a sample.

    plan: its polynomials; gains: array gains as sums of cosines; cells: the cell kernels; fold: the
    weights of `polynomials.folding`.
    """

    plan: EchoPlan
    gains: ArrayGains
    cells: CellPolynomials
    fold: np.ndarray


class Symbols(NamedTuple):
    """The symbols to compute.

    index: (B,) of each in the sample; refs, extents: the rows (B, 7) and (B, 5) of its tables of
    reference ranges and of extents; segments: (S, 6), those that B symbols fall into.
    """

    index: np.ndarray  # type: ignore[assignment]  # a tuple's own method of this name is not used
    refs: np.ndarray
    extents: np.ndarray
    segments: np.ndarray


class Found(NamedTuple):
    """The results of every symbol, each (N,).

    values, cells: the strongest cell's value and index; state: of `strongest_cell`; totals: sum of
    |amplitudes|; bounds: of the value's error; ties: whether there is a near-tie; gaps: certified
    lead over every other cell.
    """

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
            values=np.zeros(count, np.complex128),
            cells=np.zeros(count, np.int64),
            state=np.ones(count, np.int64),
            totals=np.zeros(count),
            bounds=np.zeros(count),
            ties=np.zeros(count, np.bool_),
            gaps=np.zeros(count),
        )


class Workspace(NamedTuple):
    """Work arrays of the driver.

    taylor: Taylor terms of a gain (3, rates); moments: (2, orders); coefficients, typed: of the
    gains, (2, TOP + 1), in float64 and in the strip's type; sums: of cells, (2 SIDE + 1, 2); far:
    bounds for far cells (4,); offsets, strip: a strip's arrays; share: every point's share (padded
    L,) of the sum of amplitudes, in the strip's type.
    """

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
    kind: type = np.float64
    if approximation.plan.single:
        kind = np.float32
    gains = approximation.gains
    rates = max(len(gains.horizontal.rates), len(gains.vertical.rates))
    orders = approximation.cells.kernels.shape[2]
    share = amplitude
    total = amplitude.sum()
    if total > 0:
        share = amplitude / total
    return Workspace(
        taylor=np.empty((3, rates)),
        moments=np.empty((2, orders)),
        coefficients=np.empty((2, TOP + 1)),
        typed=np.empty((2, TOP + 1), kind),
        sums=np.empty((2 * SIDE + 1, 2)),
        far=np.empty(4),
        offsets=Offsets(*(np.empty(STRIP_ROOM) for _ in Offsets._fields)),
        strip=Strip(*(np.empty(STRIP_ROOM, kind) for _ in Strip._fields)),
        share=share.astype(kind),
    )
