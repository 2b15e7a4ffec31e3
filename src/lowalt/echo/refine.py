"""How a tolerance is kept: bound the error, compute, compare, and compute finer where cancellation needs it."""

from typing import NamedTuple

import numpy as np

from lowalt.echo.fast import driver
from lowalt.echo.fast.cell_kernel import CellPolynomials, cell_polynomials
from lowalt.echo.fast.error_model import (
    SINGLE_ERROR,
    SPREAD_LIMIT,
    EchoPlan,
    array_gains,
    echo_plan,
    pointwise_bound,
    round_up,
)  # fmt: skip
from lowalt.echo.fast.layout import Layout, layout
from lowalt.echo.fast.polynomials import folding
from lowalt.echo.fast.range_bounds import SIZE, SPREAD, cut_segments, fill_extents
from lowalt.echo.fast.strongest_cell import CERTAIN
from lowalt.echo.fast.workspace import Approximation, Found, Symbols, workspace
from lowalt.echo.pointwise.reference_range import RANGE
from lowalt.echo.radar import Radar
from lowalt.echo.scene import EchoScene

LONGEST = 100
"""Most symbols of a segment."""
PROBES = 8
"""Symbols computed exactly first: their largest value is a lower bound of the sample's largest."""
PROBE_COST = 20_000
"""Cost of the probes and of a second pass, in points x symbols of the exact plan. A cheaper plan must save more."""
SAVED_SINGLE, SAVED = 0.4, 0.1
"""Share of the exact plan's cost that plans in float32 and in float64 save, as measured."""


class Method(NamedTuple):
    """How a sample was computed, and which bounds allowed it.

    error: the error that the cheap plan had to keep, relative to the sum of amplitudes (None: exact mode only); single:
    float32 after the phase; orders: polynomial orders of cosine, sine and the cell kernel; near: ranges by polynomials,
    not roots; cheap, exact, general: symbols by the cheap plan, by the exact plan and by the pointwise kernel; spread:
    largest target radius over range; size_m: largest radius (m); pointwise_bound: error bound of the pointwise kernel
    relative to its sums of amplitudes and of risks; again: symbols computed again so that complex64 is rounded
    correctly, and how many of them that leaves open.
    """

    error: float | None
    single: bool
    orders: tuple[int, int, int]
    near: bool
    cheap: int
    exact: int
    general: int
    spread: float
    size_m: float
    pointwise_bound: tuple[float, float]
    again: tuple[int, int] = (0, 0)


def compute(
    scene: EchoScene, radar: Radar, refs: np.ndarray, aims: tuple[float, float], tolerance: float | None
) -> tuple[Found, np.ndarray, Method, Layout]:
    """Return (found, symbols left for the pointwise kernel, method, layout): the cheap plan, then the exact one.

    A symbol is computed again where its bound exceeds the tolerance times the largest value, where its strongest cell
    is not certain to that bound, and where far cells could not be excluded.
    """
    sample = _Sample(scene, radar, refs, aims)
    found = Found.empty(len(refs))
    symbols = np.arange(len(refs))
    exact = sample.plan(0.0)
    if not sample.spread < SPREAD_LIMIT or sample.cells(exact) is None:
        return found, symbols, sample.method(None, exact, 0, 0, len(refs)), sample.lay
    chosen, error, cheap = exact, None, 0
    if tolerance is not None and len(refs) > PROBES and sample.saving(tolerance) > PROBE_COST:
        probes = np.arange(0, len(refs), -(-len(refs) // PROBES))
        sample.compute(probes, exact, True, found)
        share = abs(found.values[probes]).max() / (found.totals[probes].max() + sample.peaks(probes).max())
        error = 0.5 * tolerance * share
        chosen = sample.plan(error)
        shorter = chosen.functions.cosine.size < exact.functions.cosine.size
        if shorter and sample.cells(chosen) is not None:
            sample.compute(symbols, chosen, False, found)
            good = (found.state == CERTAIN) & (found.bounds <= tolerance * _least_largest(found))
            cheap = int(good.sum())
            symbols = np.flatnonzero(~good)
        else:
            chosen, error = exact, None
    if len(symbols):
        sample.compute(symbols, exact, True, found)
    left = np.flatnonzero(found.state)
    return found, left, sample.method(error, chosen, cheap, len(symbols) - len(left), len(left)), sample.lay


def _least_largest(found: Found) -> float:
    """Return a lower bound of the largest |value| that holds for all errors within their bounds."""
    done = found.state == CERTAIN
    return float((abs(found.values) - found.bounds)[done].max()) if done.any() else 0.0


class _Sample:
    """One sample's layout and extents, and the calls of the fast kernel on it."""

    def __init__(self, scene: EchoScene, radar: Radar, refs: np.ndarray, aims: tuple[float, float]) -> None:
        self.scene, self.radar, self.refs, self.aims = scene, radar, refs, aims
        self.peak = radar.scale * radar.transmit_h * radar.transmit_v * radar.receive_h * radar.receive_v
        self.lay = layout(scene, self.peak)
        self.extents = np.empty((len(refs), 5))
        self.first = int(scene.part[0]) if len(scene.part) else 0
        self.spread = fill_extents(scene, self.first, self.lay, refs, radar, self.extents)
        self.size_m = float(self.extents[:, SIZE].max())

    def plan(self, error: float) -> EchoPlan:
        """Return the plan that keeps `error` (0: the exact mode)."""
        return echo_plan(self.radar, min(self.spread, SPREAD_LIMIT), self.size_m, len(self.lay.amplitude), error)

    def peaks(self, symbols: np.ndarray) -> np.ndarray:
        """Return the sum of amplitudes at the arrays' peak gain, an upper bound for each of the symbols."""
        return self.lay.total / (self.refs[symbols, RANGE] * (1 - self.extents[symbols, SPREAD])) ** 2

    def saving(self, tolerance: float) -> float:
        """Return the cost that a tolerance may save, in points x symbols of the exact plan."""
        share = SAVED_SINGLE if 0.5 * tolerance > SINGLE_ERROR else SAVED
        return share * len(self.refs) * len(self.lay.amplitude)

    def approximation(self, chosen: EchoPlan) -> Approximation:
        """Return everything that replaces a function in the chosen plan."""
        return Approximation(chosen, array_gains(self.radar), self._kernels(chosen), folding())

    def compute(self, symbols: np.ndarray, chosen: EchoPlan, final: bool, found: Found) -> None:
        """Compute `symbols` into `found` by the plan chosen; `final`: leads that are not proved are accepted."""
        refs, extents = self.refs, self.extents
        if len(symbols) < len(refs):
            refs, extents = refs[symbols], extents[symbols]
        approximation = self.approximation(chosen)
        gains = approximation.gains
        segments = np.empty((len(symbols), 6))
        count = cut_segments(extents, gains.rates_h[0], gains.rates_v[0], LONGEST, segments)
        driver.run(
            self.scene, self.lay, self.radar, self.first, Symbols(symbols, refs, extents, segments[:count]), self.aims,
            approximation, final, workspace(approximation, self.lay.amplitude), found,
        )  # fmt: skip

    def cells(self, chosen: EchoPlan) -> CellPolynomials | None:
        """Return the cell kernels that the plan needs; None where the target is too deep for them."""
        return cell_polynomials(self.radar.subcarriers, round_up(self.size_m * self.radar.cells, 6), chosen.fit)

    def _kernels(self, chosen: EchoPlan) -> CellPolynomials:
        """The cell kernels of a plan that computes by them: none is chosen for a target that is too deep."""
        found = self.cells(chosen)
        assert found is not None
        return found

    def method(self, error: float | None, chosen: EchoPlan, cheap: int, exact: int, general: int) -> Method:
        """Return the record of how the sample was computed."""
        bound = pointwise_bound(self.radar, self.size_m, len(self.lay.amplitude))
        functions, cells = chosen.functions, self.cells(chosen)
        orders = (
            len(functions.cosine) - 1, len(functions.sine) - 1, cells.kernels.shape[2] - 1 if cells else 0,
        )  # fmt: skip
        return Method(
            error, chosen.single, orders, chosen.near, cheap, exact, general, self.spread, self.size_m,
            bound,
        )  # fmt: skip
