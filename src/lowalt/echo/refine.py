"""Bound, compute, compare, and compute finer where cancellation ate the margin: how a tolerance is kept."""

from typing import NamedTuple

import numpy as np

from lowalt.echo.fast import driver, vector_loops
from lowalt.echo.fast.cell_kernel import Cells, cells
from lowalt.echo.fast.error_model import BLOCK, SINGLE, SPREAD_LIMIT, Plan, general_share, plan, round_up, rules
from lowalt.echo.fast.layout import layout
from lowalt.echo.fast.polynomials import folding
from lowalt.echo.fast.range_bounds import SIZE, SPREAD, segments, spans
from lowalt.echo.fast.strongest_cell import FINE
from lowalt.echo.radar import Radar
from lowalt.echo.scene import Scene
from lowalt.echo.slow_time import interpolation as interpolate
from lowalt.echo.slow_time import pose_series

LONGEST = 100
"""Most symbols of a segment."""


PROBES = 8
"""Symbols computed exactly first: their largest value bounds the sample's largest from below."""
TRYING = 20_000
"""What probes and a second pass cost, in points times symbols of the exact plan: less saved, and exact is cheaper."""
SAVED_SINGLE, SAVED = 0.4, 0.1
"""Share of the exact plan's price that plans in float32 and in float64 save, as measured."""


class Found(NamedTuple):
    """What is known of every symbol, each (N,): see `driver.run`."""

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
            np.zeros(count, np.complex128), np.zeros(count, np.int64), np.ones(count, np.int64), np.zeros(count),
            np.zeros(count), np.zeros(count, np.bool_), np.zeros(count),
        )  # fmt: skip


class Choice(NamedTuple):
    """What was decided for a sample, and by which bounds.

    error: what the cheap plan was to keep, relative to the sum of amplitudes (None: exact mode only); single: float32
    after the phase; orders: polynomial orders of cosine, sine and the cell kernel; near: ranges by polynomials, not
    roots; cheap, exact, general: symbols by kernel; slow: points interpolated in time, from how many nodes in all;
    spread: largest target radius over range; size_m: largest radius (m); general_share: error bound of the general
    kernel relative to its sums of amplitudes and of risks.
    """

    error: float | None
    single: bool
    orders: tuple[int, int, int]
    near: bool
    cheap: int
    exact: int
    general: int
    slow: tuple[int, int]
    spread: float
    size_m: float
    general_share: tuple[float, float]


def climb(scene: Scene, radar: Radar, refs: np.ndarray, aims, tolerance: float | None):
    """Return (found, symbols left for the general kernel, choice): first cheap, then exact where a bound asks for it.

    A symbol is computed again where its bound exceeds the tolerance times the largest value, where its strongest cell
    is not certain to that bound, and where far cells could not be excluded.
    """
    sample = _Sample(scene, radar, refs, aims)
    found = Found.empty(len(refs))
    everyone = np.arange(len(refs))
    exact = sample.plan(0.0)
    if not sample.spread < SPREAD_LIMIT or sample.table(exact) is None:
        return found, everyone, sample.choice(None, exact, 0, 0, len(refs))
    chosen, error, cheap = exact, None, 0
    if tolerance is not None and len(refs) > PROBES and sample.gain(tolerance) > TRYING:
        probes = everyone[:: -(-len(refs) // PROBES)]
        sample.run(probes, exact, True, found)
        share = abs(found.values[probes]).max() / (found.totals[probes].max() + sample.peaks(probes).max())
        error = 0.5 * tolerance * share
        chosen = sample.plan(error)
        if (chosen.fits[2].size < exact.fits[2].size or sample.halves) and sample.table(chosen) is not None:
            sample.whole(chosen, error / 4, found)
            good = (found.state == FINE) & (found.bounds <= tolerance * _floor_of_largest(found))
            cheap = int(good.sum())
            everyone = np.flatnonzero(~good)
        else:
            chosen, error = exact, None
    if len(everyone):
        sample.run(everyone, exact, True, found)
    left = np.flatnonzero(found.state)
    return found, left, sample.choice(error, chosen, cheap, len(everyone) - len(left), len(left))


def _floor_of_largest(found: Found) -> float:
    """What the largest |value| is at least, whatever the errors."""
    done = found.state == FINE
    return float((abs(found.values) - found.bounds)[done].max()) if done.any() else 0.0


class _Sample:
    """One sample's layout and spans, and the runs of the fast kernel on it."""

    def __init__(self, scene: Scene, radar: Radar, refs: np.ndarray, aims) -> None:
        self.scene, self.radar, self.refs, self.aims = scene, radar, refs, aims
        self.peak = radar.scale * radar.transmit_h * radar.transmit_v * radar.receive_h * radar.receive_v
        self.lay = layout(scene, self.peak)
        self.span = np.empty((len(refs), 5))
        self.first = int(scene.part[0]) if len(scene.part) else 0
        self.halves: interpolate.Split | None = None
        self.slow, self.nodes = 0, 0
        self.spread = spans(
            scene.rotation, scene.translation, self.first, self.lay.parts, self.lay.centres, self.lay.radii, refs,
            radar.sine, radar.cosine, self.span,
        )  # fmt: skip
        self.size_m = float(self.span[:, SIZE].max())

    def plan(self, error: float) -> Plan:
        """The plan that keeps `error` (0: the exact mode)."""
        return plan(self.radar, min(self.spread, SPREAD_LIMIT), self.size_m, len(self.lay.amplitude), error)

    def peaks(self, symbols: np.ndarray) -> np.ndarray:
        """Sum of amplitudes at the arrays' peak gain, a bound for every symbol."""
        return self.lay.total / (self.refs[symbols, 3] * (1 - self.span[symbols, SPREAD])) ** 2

    def gain(self, tolerance: float) -> float:
        """Price, in points times symbols of the exact plan, that a tolerance may save; finds the slow parts."""
        self.halves = interpolate.split(self.scene, self.radar, self.lay)
        symbols = len(self.refs)
        saved = (SAVED_SINGLE if 0.5 * tolerance > SINGLE else SAVED) * symbols * len(self.lay.amplitude)
        return saved + (np.count_nonzero(self.halves.mask) * symbols - pose_series.WORTH if self.halves else 0)

    def whole(self, chosen: Plan, allowed: float, found: Found) -> None:
        """Compute all symbols into `found`, what moves slowly enough interpolated in time where `allowed`, an error
        relative to the sum of peak amplitudes, permits it."""
        halves, everyone = self.halves, np.arange(len(self.refs))
        if halves is None:
            self.run(everyone, chosen, False, found)
            return
        quick = interpolate.subset(self.scene, ~halves.mask)
        rest = quick, layout(quick, self.peak)
        finest = self.plan(0.0)
        for symbols in np.array_split(everyone, -(-len(everyone) // pose_series.BLOCK)):
            part = slice(symbols[0], symbols[-1] + 1)
            there = self.scene._replace(rotation=self.scene.rotation[part], translation=self.scene.translation[part])
            carried = interpolate.interpolated(
                there, self.radar, self.refs[part], self.aims, halves, self.table(chosen), finest,
                (self.spread, self.size_m), allowed, self.peak,
            )  # fmt: skip
            if carried is None:
                self.run(symbols, chosen, False, found)
            else:
                self.slow, self.nodes = int(halves.mask.sum()), self.nodes + carried[1]
                self.run(symbols, chosen, False, found, rest, carried[0])

    def run(
        self, symbols: np.ndarray, chosen: Plan, final: bool, found: Found, points=None, carried=interpolate.NOTHING
    ) -> None:  # fmt: skip
        """Compute `symbols` into `found` with the plan chosen; `final`: close calls between cells stand.

        points: (scene, layout) of those to be computed, all unless said; carried: what the others add.
        """
        scene, lay = points or (self.scene, self.lay)
        refs, span = self.refs, self.span
        if len(symbols) < len(refs):
            refs, span = refs[symbols], span[symbols]
        table = rules(self.radar)
        segs = np.empty((len(symbols), 6))
        count = segments(span, table[1][0], table[3][0], LONGEST, segs)
        widest = max(len(rates) for rates in table[1::2])
        kernels = self.table(chosen)
        rooms, work, small = driver.rooms_for(widest, kernels.kernels.shape[2], lay.amplitude, chosen.single)
        driver.run(
            scene, lay, self.radar, self.first, refs, span, segs[:count], symbols, self.aims, table, tuple(kernels),
            chosen.fits, folding(),
            (chosen.fit, chosen.share, chosen.peak, 2.0**-24 if chosen.single else 2.0**-53,
             BLOCK if chosen.single else vector_loops.TILE, chosen.near, float(final)),
            tuple(carried), rooms, work, small, tuple(found),
        )  # fmt: skip

    def table(self, chosen: Plan) -> Cells | None:
        """The cell kernel as the plan wants it; None where the target is too deep for it."""
        return cells(self.radar.subcarriers, round_up(self.size_m * self.radar.cells, 6), chosen.fit)

    def choice(self, error, chosen: Plan, cheap: int, exact: int, general: int) -> Choice:
        """The record of what was done."""
        share = general_share(self.radar, self.size_m, len(self.lay.amplitude))
        table = self.table(chosen)
        orders = (*(len(c) - 1 for c in chosen.fits[2:]), table.kernels.shape[2] - 1 if table else 0)
        return Choice(
            error, chosen.single, orders, chosen.near, cheap, exact, general, (self.slow, self.nodes), self.spread,
            self.size_m, share,
        )  # fmt: skip
