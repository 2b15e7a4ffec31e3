"""Keeps a tolerance: bound the error, compute, compare, and recompute where terms cancel."""

from typing import NamedTuple

import numpy as np

from lowalt.echo.echo_input import EchoInput
from lowalt.echo.fast import driver, error_model
from lowalt.echo.fast.cell_kernel import CellPolynomials, cell_polynomials
from lowalt.echo.fast.layout import EchoSample, layout
from lowalt.echo.fast.polynomials import folding
from lowalt.echo.fast.range_bounds import SIZE, SPREAD, cut_segments, fill_extents
from lowalt.echo.fast.strongest_cell import CERTAIN
from lowalt.echo.fast.workspace import Approximation, Found, Symbols, workspace
from lowalt.echo.pointwise.reference_range import RANGE
from lowalt.echo.radar import Radar

LONGEST = 100
"""Largest number of symbols in a segment."""
PROBES = 8
"""Number of symbols computed exactly first.

Their largest value is a lower bound of the sample's largest value.
"""
PROBE_COST = 20_000
"""Cost of the probes and of a second pass, in points x symbols of the exact plan.

A cheaper plan must save more.
"""
SAVED_SINGLE = 0.4
SAVED = 0.1
"""Measured share of the exact plan's cost that a cheaper plan saves, in float32 and in float64."""


class Method(NamedTuple):
    """Record of how a sample was computed and which error bounds were proved.

    single: float32 after the phase; orders: polynomial orders of cosine, sine and the cell kernel;
    cheap, exact, general: symbols by the cheap plan, by the exact plan and by the pointwise kernel;
    pointwise_bound: error bound of the pointwise kernel relative to its sums of amplitudes and of
    risks; again: number of symbols recomputed for correct rounding to complex64, and how many of
    them remain undecided.
    """

    single: bool
    orders: tuple[int, int, int]
    cheap: int
    exact: int
    general: int
    pointwise_bound: tuple[float, float]
    again: tuple[int, int] = (0, 0)


def compute(
    scene: EchoInput,
    radar: Radar,
    refs: np.ndarray,
    aims: tuple[float, float],
    tolerance: float | None,
) -> tuple[Found, np.ndarray, Method, EchoSample]:
    """Run the cheap plan, then the exact one.

    Returns what was found, the symbols left for the pointwise kernel, the method and the sample.
    The exact plan recomputes a symbol if its error bound exceeds the tolerance times the largest
    value, if the bound leaves its strongest cell undecided, or if far cells could not be excluded.
    """
    run = _Run(scene, radar, refs, aims)
    found = Found.empty(len(refs))
    symbols = np.arange(len(refs))
    exact = run.plan(0.0)
    if not run.spread < error_model.SPREAD_LIMIT or run.cells(exact) is None:
        return found, symbols, run.method(exact, 0, 0, len(refs)), run.sample
    chosen = exact
    cheap = 0
    if tolerance is not None and len(refs) > PROBES and run.saving(tolerance) > PROBE_COST:
        probes = np.arange(0, len(refs), -(-len(refs) // PROBES))
        run.compute(probes, exact, True, found)
        most = found.totals[probes].max() + run.peaks(probes).max()
        share = abs(found.values[probes]).max() / most
        chosen = run.plan(0.5 * tolerance * share)
        if chosen.cosine.size < exact.cosine.size and run.cells(chosen) is not None:
            run.compute(symbols, chosen, False, found)
            good = (found.state == CERTAIN) & (found.bounds <= tolerance * _least_largest(found))
            cheap = int(good.sum())
            symbols = np.flatnonzero(~good)
        else:
            chosen = exact
    if len(symbols):
        run.compute(symbols, exact, True, found)
    left = np.flatnonzero(found.state)
    return found, left, run.method(chosen, cheap, len(symbols) - len(left), len(left)), run.sample


def _least_largest(found: Found) -> float:
    """Return a lower bound of the largest true |value|, given the error bounds."""
    done = found.state == CERTAIN
    if not done.any():
        return 0.0
    least = abs(found.values[done]) - found.bounds[done]
    return float(least.max())


class _Run:
    """Calls of the fast kernel for one sample, with the table of extents."""

    def __init__(
        self, scene: EchoInput, radar: Radar, refs: np.ndarray, aims: tuple[float, float]
    ) -> None:
        peak = radar.scale * radar.transmit_h * radar.transmit_v * radar.receive_h * radar.receive_v
        self.sample = EchoSample(scene, layout(scene, peak), radar, scene.first, aims)
        self.refs = refs
        self.points = len(self.sample.lay.amplitude)
        self.extents = np.empty((len(refs), 5))
        self.spread = fill_extents(self.sample, refs, self.extents)
        self.size_m = float(self.extents[:, SIZE].max())

    def plan(self, error: float) -> error_model.EchoPlan:
        """Return the plan for an error bound of `error` (0: exact mode)."""
        return error_model.echo_plan(self.sample.radar, self.points, error)

    def peaks(self, symbols: np.ndarray) -> np.ndarray:
        """Return for each symbol an upper bound: the sum of amplitudes at the arrays' peak gain."""
        nearest_m = self.refs[symbols, RANGE] * (1 - self.extents[symbols, SPREAD])
        return self.sample.lay.total / nearest_m**2

    def saving(self, tolerance: float) -> float:
        """Return the cost that a tolerance may save, in points x symbols of the exact plan."""
        share = SAVED
        if 0.5 * tolerance > error_model.SINGLE_ERROR:
            share = SAVED_SINGLE
        return share * len(self.refs) * self.points

    def cells(self, chosen: error_model.EchoPlan) -> CellPolynomials | None:
        """Return the cell kernels of a plan; None if the target extends over too many cells."""
        radar = self.sample.radar
        deep = error_model.round_up(self.size_m * radar.cells, 6)
        return cell_polynomials(radar.subcarriers, deep, chosen.fit)

    def compute(
        self, symbols: np.ndarray, chosen: error_model.EchoPlan, final: bool, found: Found
    ) -> None:
        """Compute `symbols` into `found` by the plan `chosen`.

        final: whether strongest cells that are not proved are accepted.
        """
        refs = self.refs
        extents = self.extents
        if len(symbols) < len(refs):
            refs = refs[symbols]
            extents = extents[symbols]
        gains = error_model.array_gains(self.sample.radar)
        cells = self.cells(chosen)
        assert cells is not None  # `compute` checked the plan's cell kernels before
        segments = np.empty((len(symbols), 6))
        rates = (gains.horizontal.rates[0], gains.vertical.rates[0])
        count = cut_segments(extents, *rates, LONGEST, segments)
        approximation = Approximation(chosen, gains, cells, folding())
        chunk = Symbols(symbols, refs, extents, segments[:count])
        work = workspace(approximation, self.sample.lay.amplitude)
        driver.run(self.sample, chunk, approximation, final, work, found)

    def method(self, chosen: error_model.EchoPlan, cheap: int, exact: int, general: int) -> Method:
        """Return the record of how the sample was computed."""
        cells = self.cells(chosen)
        degree = len(chosen.cosine) - 1
        cell_degree = cells.kernels.shape[2] - 1 if cells else 0
        orders = (degree, degree, cell_degree)
        bound = error_model.pointwise_bound(self.sample.radar, self.size_m, self.points)
        return Method(chosen.single, orders, cheap, exact, general, bound)
