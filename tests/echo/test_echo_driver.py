"""The fast kernel's results by the interpreter, against long sums over all points."""

import dataclasses

import numpy as np
import pytest

from driven_echo import MOTION, bare, computed, truth_of
from interpreted import interpreted
from lowalt.echo import refine
from lowalt.echo.fast import driver
from lowalt.echo.fast.range_bounds import SPREAD
from lowalt.echo.fast.strongest_cell import CERTAIN, UNCERTAIN
from lowalt.echo.fast.workspace import Found
from small_echo import NETWORK, pieces, places


@pytest.mark.parametrize("kind", ["parts", "points", "far points"])
def test_the_exact_plan_gives_the_strongest_of_all_cells(kind):
    """Values and totals to rounding; a lead that is proved and not more than an error or two below the true one."""
    motion = pieces(away=(3000.0, 2500.0, 300.0) if kind == "far points" else (90.0, 120.0, 40.0))
    motion = motion if kind == "parts" else places(motion).astype(float)
    found, *_, there = computed(motion)
    z, _, cells = truth_of(there, motion)
    at = np.arange(len(cells))
    best = abs(cells).argmax(1)
    order = np.sort(abs(cells), axis=1)
    totals = abs(z).sum(1).astype(float)
    assert (found.state == CERTAIN).all() and (found.cells == best).all() and not found.ties.any()
    assert (abs(found.values - cells[at, best]) <= found.bounds).all() and (found.bounds < 1e-11 * totals).all()
    assert abs(found.values - cells[at, best]).max() < 2e-13 * totals.max()
    np.testing.assert_allclose(found.totals, totals, rtol=2e-12)
    assert (found.totals >= totals * (1 - 1e-15)).all()
    lead = (order[:, -1] - order[:, -2]).astype(float)
    assert (found.gaps <= lead).all() and (found.gaps > 0.5 * lead).all()


@pytest.mark.parametrize("error", [0.0, 1e-3, 1e-7, 1e-12])
def test_every_plan_keeps_its_bound_over_several_strips(error):
    """300 points, more than a strip; three lengths of polynomials and single precision."""
    motion = pieces((120, 40, 140), symbols=2)
    found, _, approximation, there = computed(motion, error)
    z, _, cells = truth_of(there, motion)
    number = {0.0: 11, 1e-3: 6, 1e-7: 8, 1e-12: 11}[error]
    assert len(approximation.plan.functions.cosine) == number and approximation.plan.single == (error == 1e-3)
    away = abs(found.values - cells[np.arange(2), found.cells])
    assert (away <= found.bounds).all() and (found.totals >= abs(z).sum(1) * (1 - 1e-15)).all()
    assert (found.bounds <= (2 * error + 3e-12) * found.totals).all()
    strongest = abs(cells).argmax(1)
    assert (found.cells[found.state == CERTAIN] == strongest[found.state == CERTAIN]).all()


def test_a_lead_that_is_not_proved_is_left_to_a_finer_plan_if_there_is_one():
    """A bound as large as the strongest cell hides whether it leads; only the last plan takes it all the same."""
    change = bare(plan={"share": 0.02})
    loose, *_ = computed(MOTION, change=change, final=True)
    asked, *_ = computed(MOTION, change=change, final=False)
    proved, *_ = computed(MOTION, final=False)
    assert (proved.state == CERTAIN).all() and (proved.gaps > 0).all()
    assert (loose.state == CERTAIN).all() and (loose.gaps >= 0).all()
    assert ((asked.state == CERTAIN) == (loose.gaps > 0)).all()


def test_one_element_on_a_side_has_a_gain_of_degree_nought():
    """Whatever the direction, along a side with one element on either array nothing turns."""
    for sides in (((1, 2), (1, 5)), ((3, 1), (2, 1))):
        net = dataclasses.replace(NETWORK, transmit=sides[0], receive=sides[1])
        found, *_, there = computed(MOTION, net=net)
        cells = truth_of(there, MOTION)[2]
        assert (found.state == CERTAIN).all() and (found.cells == abs(cells).argmax(1)).all()
        assert (abs(found.values - cells[np.arange(2), found.cells]) <= found.bounds).all()


def test_a_symbol_whose_gains_turn_too_fast_leaves_those_after_it_alone(monkeypatch):
    """Segments of one symbol each; the first is said to be as wide as its range, so 16 elements turn too much."""
    monkeypatch.setattr(refine, "LONGEST", 1)
    for counts in ((30, 1), (1, 30)):
        net = dataclasses.replace(NETWORK, transmit=counts, receive=counts)
        found, *_ = computed(MOTION, net=net, extents={SPREAD: np.array([0.9, 0.02])})
        assert found.state.tolist() == [UNCERTAIN, CERTAIN]


def test_where_gains_turn_too_fast_for_a_polynomial_the_symbols_stay_open():
    """Array gains asked for to an error that no degree reaches; a symbol that is not computed keeps what it had."""
    found, *_ = computed(MOTION, change=lambda given: {"plan": given.plan._replace(fit=1e-300)})
    assert (found.state == UNCERTAIN).all() and not found.values.any() and not found.totals.any()


def test_only_the_symbols_asked_for_are_computed():
    motion = pieces(symbols=3)
    every, *_ = computed(motion)
    some, *_ = computed(motion, symbols=np.array([2]))
    assert some.state.tolist() == [UNCERTAIN, UNCERTAIN, CERTAIN] and some.values[2] == pytest.approx(
        every.values[2], rel=1e-12
    )
    assert some.cells[2] == every.cells[2] and not some.values[:2].any()


def test_a_cell_s_number_wraps_and_turns_by_its_own_phase():
    """exp(j pi (M - 1) m / M) of the number before wrapping: M cells later the kernel has the other sign for even M."""
    found = Found.empty(3)
    keep = interpreted(driver.keep)
    for n, cell in enumerate((5, 64 + 5, 7)):
        keep(found, n, cell, (0.3, -0.4), 64, n == 1, -0.5 if n == 2 else 0.25)
    assert found.cells.tolist() == [5, 5, 7] and found.ties.tolist() == [False, True, False]
    turned = (0.3 - 0.4j) * np.exp(1j * np.pi * 63 * np.array([5, 64 + 5, 7]) / 64)
    np.testing.assert_allclose(found.values, turned, rtol=1e-13)
    assert found.gaps.tolist() == [0.25, 0.25, 0.0]


@pytest.mark.parametrize("error", [1e-3, 1e-6])
def test_a_small_distant_target_s_ranges_are_polynomials_and_keep_the_bound(error):
    motion = pieces(symbols=2, away=(3000.0, 2500.0, 300.0), size=0.1)
    found, _, approximation, there = computed(motion, error)
    z, _, cells = truth_of(there, motion)
    assert approximation.plan.near
    assert (abs(found.values - cells[np.arange(2), found.cells]) <= found.bounds).all()
    assert (found.bounds <= 2 * error * found.totals).all() and (found.totals >= abs(z).sum(1)).all()
