"""Which symbols are computed by which plan, and in what order: decisions alone, with stand-ins that compute nothing."""

from types import SimpleNamespace

import numpy as np
import pytest

from driven_echo import weights
from lowalt.echo import refine
from lowalt.echo.fast.error_model import SPREAD_LIMIT
from lowalt.echo.fast.strongest_cell import CERTAIN, UNCERTAIN
from lowalt.echo.fast.workspace import Found
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


def test_a_sample_s_record_names_orders_and_bounds():
    sample, _ = sample_of(pieces())
    plan = sample.plan(1e-4)
    told = sample.method(1e-4, plan, 1, 2, 3)
    orders = (len(plan.functions.cosine) - 1, len(plan.functions.sine) - 1, sample.cells(plan).kernels.shape[2] - 1)
    assert told.orders == orders and (told.cheap, told.exact, told.general) == (1, 2, 3)
    assert (told.error, told.single, told.near) == (1e-4, plan.single, plan.near) and told.again == (0, 0, 0)
    assert (told.spread, told.size_m) == (sample.spread, sample.size_m)
    deep, _ = sample_of(pieces(size=40.0, away=(9e3, 1.2e4, 4e3)))
    assert deep.cells(deep.plan(0.0)) is None and deep.method(None, deep.plan(0.0), 0, 0, 3).orders[2] == 0
