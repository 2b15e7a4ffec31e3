"""Bounds that decide how an echo is computed, and polynomials of its loops: by direct sums and closed forms."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.echo import refine
from lowalt.echo.fast import driver, strongest_cell
from lowalt.echo.fast.cell_kernel import PLACES, cell_polynomials
from lowalt.echo.fast.error_model import pointwise_bound
from lowalt.echo.fast.range_bounds import norm
from lowalt.echo.fast.strongest_cell import CERTAIN, UNCERTAIN
from lowalt.echo.pointwise import results
from lowalt.echo.pointwise.results import far_bound
from lowalt.echo.pointwise.terms import cell_sum
from lowalt.echo.radar import Exact, constants


def test_a_sum_that_may_be_off_by_half_its_size_proves_no_strongest_cell(monkeypatch):
    """One point at a whole cell: all other cells are empty, so only the error of the cells' sums is left to decide."""
    for name in ("cell_sums", "strongest_of"):
        monkeypatch.setattr(strongest_cell, name, getattr(strongest_cell, name).py_func)
    certify, table = strongest_cell.certify.py_func, cell_polynomials(64, 0.1, 1e-9)
    powers = np.zeros((2, table.kernels.shape[2]))
    powers[0, 0] = 1.0
    found = {}
    for bound in (0.0, 0.4, 0.6, 1.2):
        sums, far = np.empty((9, 2)), np.empty(4)
        found[bound] = certify(table, PLACES // 2, 0.0, powers, 0.0, (1.0, 0.0), 1e-9, bound, 64, sums, far)
    assert [found[bound][0] for bound in found] == [CERTAIN, CERTAIN, UNCERTAIN, UNCERTAIN]
    assert found[0.4][1] == 4 and found[0.4][3] == pytest.approx(0.2, abs=1e-6) and not found[0.4][2]
    assert found[0.6][3] == 0.0
    # An error of half the amplitudes in the far cells' sums leaves a lead of less than 1 - 0.5 / pi.
    sums, far = np.empty((9, 2)), np.empty(4)
    state, which, tie, lead = certify(table, PLACES // 2, 0.0, powers, 0.0, (1.0, 0.0), 0.5, 0.0, 64, sums, far)
    assert (state, which, tie) == (CERTAIN, 4, False) and 0.5 < lead < 1 - 0.5 / np.pi


@pytest.mark.parametrize("place", [0.0, 0.3, -0.45])
def test_the_bound_of_far_cells_of_one_point_is_the_strongest_of_them(place):
    """z sin(pi u) / (M sin(pi (j - u) / M)), largest in the nearest of the cells beyond; nothing at a whole cell."""
    count, low, high = 40, -2, 2
    bound = far_bound(np.array([2.0 - 1.0j]), np.array([place]), low, high, count)
    beyond = np.array([low - 1, high + 1])
    truth = abs((2 - 1j) * math.sin(math.pi * place) / (count * np.sin(math.pi * (beyond - place) / count)))
    assert bound == pytest.approx(truth.max(), rel=1e-8, abs=1e-13)


@pytest.mark.parametrize("side", ["transmit_h", "receive_h", "transmit_v", "receive_v"])
def test_an_element_more_on_any_side_adds_the_same_to_the_risk_of_a_direction(side):
    """Roundings of a direction cosine turn the array's phase by pi kappa / 2 an element beyond the first of a side."""
    counts = dict(transmit_h=3, receive_h=5, transmit_v=2, receive_v=7)
    seen = SimpleNamespace(turns=30.0, kappa=1.1, **counts)
    more = SimpleNamespace(**vars(seen) | {side: counts[side] + 1})
    (share, risk), found = pointwise_bound(seen, 0.5, 40), pointwise_bound(more, 0.5, 40)
    unit, each = 40 * 2.0**-53, np.pi * 1.1 / 2
    assert risk / unit == pytest.approx(1 + each * (2 + 4 + 1 + 6), rel=1e-14)
    assert found[0] == share and (found[1] - risk) / unit == pytest.approx(each, rel=1e-12)


def test_a_plan_saves_a_part_of_the_exact_one_and_more_where_single_precision_is_enough():
    sample = SimpleNamespace(scene=None, radar=None, lay=SimpleNamespace(amplitude=np.ones(30)), refs=np.ones((20, 7)))
    loose, tight = refine._Sample.saving(sample, 1e-2), refine._Sample.saving(sample, 1e-9)
    assert 0 < tight < loose < 20 * 30


def test_the_norm_of_a_pose_is_bounded_by_the_rows_of_its_square():
    for matrix in np.random.default_rng(3).normal(size=(20, 3, 3)):
        bound = norm.py_func(matrix[None, None], 0, 0)
        assert bound == pytest.approx(np.sqrt(abs(matrix @ matrix.T).sum(axis=1).max()), rel=1e-13)
        assert bound >= np.linalg.norm(matrix, 2) * (1 - 1e-13)


def test_constants_of_a_radar_are_pairs_in_the_order_of_their_rows():
    rows = np.arange(16.0).reshape(8, 2)
    assert constants(rows) == Exact(*map(tuple, rows.tolist()))


def test_cells_are_added_by_eights_before_all_of_them_are_computed(monkeypatch):
    """Three points of which nothing is in the two cells next to them, so that the strongest cell lies beyond."""
    count, places = 64, np.array([0.25, 0.5, 0.75])
    cells = np.array(
        [[cell_sum(np.array([1.0 + 0j]), np.array([u]), j, count) for u in places] for j in range(-32, 32)]
    )
    amplitudes = np.linalg.svd(cells[32:34])[2][-1].conj()
    sums = np.full((count, 2), np.nan)
    monkeypatch.setattr(results, "strongest_of", results.strongest_of.py_func)
    value, cell, _, lead = results.strongest.py_func(amplitudes, places, 0, count, sums)
    truth = abs(cells @ amplitudes)
    assert truth[32:34].max() < 1e-12 * truth.max() and cell == (truth.argmax() - 32) % count
    assert abs(value) == pytest.approx(truth.max(), rel=1e-12) and 0 <= lead <= np.diff(np.sort(truth)[-2:]) + 1e-12
    # Cells 0 and 1 with eight more on either side are enough: the bound excludes the other 46.
    assert np.isfinite(sums).all(axis=1).sum() == 2 + 2 * 8


@pytest.mark.parametrize("count", [6, 8, 11])
def test_waves_are_computed_from_all_coefficients_of_their_polynomials_in_order(monkeypatch, count):
    """The loops take coefficients as a tuple of known length; each plan has one of three lengths."""
    given = []
    monkeypatch.setattr(driver.vector_loops, "amplitudes", lambda *arguments: given.append(arguments))
    cosine, sine = np.arange(1.0, count + 1), -np.arange(1.0, count + 1)
    driver.add_amplitudes.py_func("strip", "share", 3, SimpleNamespace(cosine=cosine, sine=sine), 16)
    assert given == [("strip", "share", 3, tuple(cosine), tuple(sine), 16)]
