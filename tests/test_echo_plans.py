"""Which symbols are computed by which plan, and in what order: decisions alone, with stand-ins that compute nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

from driven_echo import weights
from lowalt.echo import refine
from lowalt.echo.fast.error_model import SINGLE_ERROR, SPREAD_LIMIT
from lowalt.echo.fast.strongest_cell import CERTAIN, UNCERTAIN
from lowalt.echo.fast.workspace import Found
from lowalt.echo.pointwise.reference_range import RANGE
from lowalt.echo.slow_time import pose_series
from small_echo import pieces, prepared

EXACT, CHEAP = (SimpleNamespace(functions=SimpleNamespace(cosine=np.zeros(size))) for size in (11, 6))


class Sample:
    """A stand-in for `refine._Sample` that notes what it is asked for.

    Each symbol n gets the value n + 1 with bound `error`, and totals of twice as much; those of `open_at` stay open.
    """

    def __init__(self, count=20, **given):
        self.asked, self.count, self.lay, self.slow_parts = [], count, "layout", given.get("slow")
        self.spread, self.error = given.get("spread", 0.1), given.get("error", 0.0)
        self.worth, self.cheap = given.get("worth", np.inf), given.get("cheap", CHEAP)
        self.open_at, self.too_deep = given.get("open_at", {}), given.get("too_deep", ())

    def plan(self, error):
        self.asked.append(("plan", error))
        return self.cheap if error else EXACT

    def cells(self, plan):
        return None if any(plan is each for each in self.too_deep) else "cells"

    def saving(self, tolerance):
        return self.worth

    def peaks(self, symbols):
        return np.full(len(symbols), 60.0)

    def compute(self, symbols, plan, final, found):
        self.asked.append(("compute", symbols.tolist(), plan, final))
        found.values[symbols], found.totals[symbols] = symbols + 1.0, 2 * symbols + 2.0
        found.state[symbols] = [UNCERTAIN if n in self.open_at.get("exact", ()) else CERTAIN for n in symbols]
        found.bounds[symbols] = 0.0

    def compute_all(self, plan, error, found):
        self.asked.append(("all", plan, error))
        symbols = np.arange(self.count)
        found.values[:], found.bounds[:] = symbols + 1.0, self.error
        found.state[:] = [UNCERTAIN if n in self.open_at.get("cheap", ()) else CERTAIN for n in symbols]

    def method(self, error, plan, cheap, exact, general):
        return error, plan, cheap, exact, general


def decided(monkeypatch, sample, tolerance):
    """What `compute` returns with a stand-in, and what it asked of it."""
    monkeypatch.setattr(refine, "_Sample", lambda *_: sample)
    found, left, method, lay = refine.compute(None, None, np.empty((sample.count, 7)), (0.0, 0.0), tolerance)
    assert lay == "layout"
    return found, left.tolist(), method, sample.asked


def test_without_a_tolerance_all_symbols_go_through_the_exact_plan_and_what_stays_open_is_left(monkeypatch):
    sample = Sample(open_at={"exact": (3, 7)})
    _, left, method, asked = decided(monkeypatch, sample, None)
    assert asked == [("plan", 0.0), ("compute", list(range(20)), EXACT, True)]
    assert left == [3, 7] and method == (None, EXACT, 0, 18, 2)


@pytest.mark.parametrize("given", [{"spread": SPREAD_LIMIT}, {"spread": np.nan}, {"too_deep": (EXACT,)}])
def test_targets_too_near_or_too_deep_are_left_to_the_pointwise_kernel(monkeypatch, given):
    found, left, method, asked = decided(monkeypatch, Sample(**given), 1e-3)
    assert asked == [("plan", 0.0)] and left == list(range(20)) and method == (None, EXACT, 0, 0, 20)
    assert found.state.all() and not found.values.any()
    assert decided(monkeypatch, Sample(spread=SPREAD_LIMIT - 1e-9), None)[1] == []


@pytest.mark.parametrize(("count", "worth"), [(refine.PROBES, np.inf), (20, refine.PROBE_COST)])
def test_a_tolerance_that_saves_too_little_is_not_tried(monkeypatch, count, worth):
    _, left, method, asked = decided(monkeypatch, Sample(count, worth=worth), 1e-3)
    assert asked == [("plan", 0.0), ("compute", list(range(count)), EXACT, True)]
    assert left == [] and method == (None, EXACT, 0, count, 0)


def test_probes_tell_the_error_that_a_cheap_plan_may_make(monkeypatch):
    """Every third of 20 symbols; the largest over its total and the peak amplitudes'; half of the tolerance."""
    sample = Sample(error=0.019)
    _, left, method, asked = decided(monkeypatch, sample, 1e-3)
    error = 0.5 * 1e-3 * 19 / (38 + 60)
    assert asked[:2] == [("plan", 0.0), ("compute", [0, 3, 6, 9, 12, 15, 18], EXACT, True)]
    assert asked[2:] == [("plan", pytest.approx(error)), ("all", CHEAP, pytest.approx(error / 4))]
    assert left == [] and method == (pytest.approx(error), CHEAP, 20, 0, 0)
    assert decided(monkeypatch, Sample(9), 1e-3)[3][1][1] == [0, 2, 4, 6, 8]
    assert decided(monkeypatch, Sample(9, worth=refine.PROBE_COST + 1), 1e-3)[2][2] == 9


def test_symbols_whose_bound_is_above_the_tolerance_or_whose_cell_is_open_are_computed_again(monkeypatch):
    """The largest value less its bound is 20 - 0.01: a bound of 0.01 keeps a tolerance of 0.01 / 19.99."""
    sample = Sample(error=0.01, open_at={"cheap": (4, 19), "exact": (4,)})
    _, left, method, asked = decided(monkeypatch, sample, 0.01 / 18.99 * (1 + 1e-12))
    assert asked[-1] == ("compute", [4, 19], EXACT, True) and left == [4] and method[1:] == (CHEAP, 18, 1, 1)
    _, left, method, asked = decided(monkeypatch, Sample(error=0.01), 0.01 / 19.99 * (1 - 1e-12))
    assert asked[-1] == ("compute", list(range(20)), EXACT, True) and method[2:] == (0, 20, 0)


def test_a_plan_without_shorter_polynomials_is_taken_for_slow_parts_alone(monkeypatch):
    _, _, method, asked = decided(monkeypatch, Sample(cheap=EXACT), 1e-3)
    assert asked[-1] == ("compute", list(range(20)), EXACT, True) and method == (None, EXACT, 0, 20, 0)
    _, _, method, asked = decided(monkeypatch, Sample(cheap=EXACT, slow="parts"), 1e-3)
    assert asked[-1][0] == "all" and method[1:] == (EXACT, 20, 0, 0)
    _, _, method, asked = decided(monkeypatch, Sample(too_deep=(CHEAP,)), 1e-3)
    assert asked[-1][0] == "compute" and method == (None, EXACT, 0, 20, 0)


def test_the_least_that_the_largest_value_can_be_counts_certain_symbols_alone():
    found = Found.empty(3)
    found.values[:], found.bounds[:], found.state[:] = [3j, -5.0, 9.0], [0.1, 2.5, 0.0], [CERTAIN, CERTAIN, UNCERTAIN]
    assert refine._least_largest(found) == pytest.approx(2.9)
    found.state[:] = UNCERTAIN
    assert refine._least_largest(found) == 0.0


def sample_of(motion):
    """A sample of the small scene."""
    there = prepared(motion, weights(len(motion.points)))
    return refine._Sample(there.scene, there.radio, there.refs, there.aims), there


def test_a_sample_knows_its_peaks_and_what_a_tolerance_saves(monkeypatch):
    """Peak amplitudes at the nearest point; shares of points times symbols; slow points less their cost."""
    sample, there = sample_of(pieces())
    nearest_m = there.refs[:, RANGE] - sample.extents[:, 3]
    np.testing.assert_allclose(sample.peaks(np.array([2, 0])), there.lay.total / nearest_m[[2, 0]] ** 2, rtol=1e-12)
    cells = 28 + 4
    assert sample.saving(2.1 * SINGLE_ERROR) == pytest.approx(0.4 * 3 * cells)
    assert sample.saving(1.9 * SINGLE_ERROR) == pytest.approx(0.1 * 3 * cells) and sample.slow_parts is None
    monkeypatch.setattr(refine, "slow_parts", lambda *_: SimpleNamespace(mask=np.arange(28) < 11))
    assert sample.saving(1e-9) == pytest.approx(0.1 * 3 * cells + 11 * 3 - pose_series.INTERPOLATION_COST)
    assert (sample.slow, sample.nodes, sample.first) == (0, 0, 0) and sample.peak == there.peak
    assert sample.size_m == sample.extents[:, 3].max() and sample.spread == sample.extents[:, 2].max()


def test_a_sample_s_record_names_orders_and_bounds():
    sample, _ = sample_of(pieces())
    plan = sample.plan(1e-4)
    sample.slow, sample.nodes = 5, 7
    told = sample.method(1e-4, plan, 1, 2, 3)
    orders = (len(plan.functions.cosine) - 1, len(plan.functions.sine) - 1, sample.cells(plan).kernels.shape[2] - 1)
    assert told.orders == orders and (told.cheap, told.exact, told.general, told.slow) == (1, 2, 3, (5, 7))
    assert (told.error, told.single, told.near) == (1e-4, plan.single, plan.near) and told.again == (0, 0, 0)
    assert (told.spread, told.size_m) == (sample.spread, sample.size_m)
    deep, _ = sample_of(pieces(size=40.0, away=(9e3, 1.2e4, 4e3)))
    assert deep.cells(deep.plan(0.0)) is None and deep.method(None, deep.plan(0.0), 0, 0, 3).orders[2] == 0


def carried_by(monkeypatch, answers, block=3):
    """What `compute_all` asks for over seven symbols, and the sample. answers: of `interpolated`, in turn."""
    sample, there = sample_of(pieces(symbols=7))
    calls, asked = [], []
    monkeypatch.setattr(pose_series, "BLOCK", block)
    sample.slow_parts = SimpleNamespace(mask=np.arange(28) < 8)
    sample.compute = lambda symbols, plan, final, found, *more: calls.append((symbols.tolist(), plan, final, *more))
    monkeypatch.setattr(refine, "interpolated", lambda *given: asked.append(given) or answers[len(asked) - 1])
    sample.compute_all("plan" if not answers else sample.plan(1e-4), 1e-5, "found")
    return calls, asked, sample, there


def test_symbols_are_carried_in_blocks_and_those_that_cannot_be_are_computed_from_all_points(monkeypatch):
    """Seven symbols in blocks of at most three: 3, 2 and 2; nodes add up, points do not."""
    calls, asked, sample, there = carried_by(monkeypatch, [("moments", 9), None, ("more", 4)])
    plan = sample.plan(1e-4)
    assert [call[0] for call in calls] == [[0, 1, 2], [3, 4], [5, 6]] and all(call[2] is False for call in calls)
    assert len(calls[1]) == 3 and calls[0][4] == "moments" and calls[2][4] == "more"
    scene, lay = calls[0][3]
    assert len(scene.points) == 20 and lay.total < there.lay.total and (sample.slow, sample.nodes) == (8, 13)
    for given, part in zip(asked, (slice(0, 3), slice(3, 5), slice(5, 7)), strict=True):
        here, radar, refs, aims, slow, exact, size, allowed, peak = given
        np.testing.assert_array_equal(here.translation, there.scene.translation[part])
        np.testing.assert_array_equal(here.rotation, there.scene.rotation[part])
        np.testing.assert_array_equal(refs, there.refs[part])
        assert radar is there.radio and aims is there.aims and slow is sample.slow_parts
        assert size == (sample.spread, sample.size_m) and allowed == 1e-5 and peak == there.peak
        assert exact.plan == sample.plan(0.0) and exact.cells is sample.cells(plan)


def test_without_slow_parts_all_symbols_are_computed_at_once(monkeypatch):
    sample, _ = sample_of(pieces(symbols=7))
    calls = []
    sample.compute = lambda *given: calls.append(given)
    sample.compute_all(CHEAP, 1e-5, "found")
    [(symbols, plan, final, found)] = calls
    assert symbols.tolist() == list(range(7)) and plan is CHEAP and final is False and found == "found"
