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
from lowalt.echo.pointwise import sums as sums_of_points
from lowalt.echo.pointwise.sums import far_bound
from lowalt.echo.pointwise.terms import cell_sum
from lowalt.echo.radar import Exact, constants, radar
from lowalt.echo.slow_time.node_count import _growth, choose, nodes
from lowalt.echo.slow_time.pose_series import series_sizes
from test_echo import network


def test_sizes_of_a_series_of_poses_are_those_of_plain_sums():
    """Two groups of points on two parts; numbers of both signs, so that no sign or entry can be lost."""
    rng = np.random.default_rng(7)
    reference, offset = rng.normal(size=(3, 3)), rng.normal(size=(3, 2, 3))
    turned, left = rng.normal(size=(3, 2, 3, 3)), abs(rng.normal(size=5))
    rows, centres, radii = np.array([1, 0]), rng.normal(size=(2, 3)), np.array([0.3, 0.7])
    moves, sizes, stray = series_sizes(reference, offset, turned, left, rows, centres, radii)
    assert moves == pytest.approx(np.linalg.norm(reference, axis=1), rel=1e-14)
    places = np.linalg.norm(offset[:, rows] + np.einsum("kgij,gj->kgi", turned[:, rows], centres), axis=2)
    matrix = turned[:, rows]
    squared = abs(matrix @ matrix.swapaxes(-1, -2)).sum(axis=-1).max(axis=-1)
    assert sizes == pytest.approx((places + np.sqrt(squared) * radii).max(axis=1), rel=1e-14)
    reach = np.linalg.norm(centres, axis=1) + radii
    assert stray == pytest.approx((left[1 + rows] + left[3 + rows] * reach).max(), rel=1e-14)


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


def test_the_growth_of_an_amplitude_on_an_ellipse_is_that_of_a_range_along_the_line_of_sight():
    """A point that moves straight away: its largest range over its smallest, squared, is nearly the bound."""
    rho, reference = 3.0, np.array([100.0, 4.0])
    turns = np.exp(1j * np.linspace(0, 2 * np.pi, 9))
    ranges = abs(reference[0] + reference[1] * 0.5 * (rho * turns + 1 / (rho * turns)))
    whole, bare, v = _growth(rho, reference, np.zeros(2), 0.0, 0.0, 0.0, 0.0)
    least = 2 * np.log(ranges.max() / ranges.min())
    assert least <= bare <= 1.02 * least and whole == bare and v == 0.0


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


def test_a_plan_saves_a_part_of_the_exact_one_and_more_where_single_precision_is_enough(monkeypatch):
    monkeypatch.setattr(refine, "slow_parts", lambda *_: None)
    sample = SimpleNamespace(scene=None, radar=None, lay=SimpleNamespace(amplitude=np.ones(30)), refs=np.ones((20, 7)))
    loose, tight = refine._Sample.saving(sample, 1e-2), refine._Sample.saving(sample, 1e-9)
    assert 0 < tight < loose < 20 * 30


def test_smaller_parts_leave_a_smaller_error_of_their_series():
    """Nothing is left of either series but roundings, which grow with a part's reach."""
    seen, table = radar(network(), network().stations[0]), cell_polynomials(256, 0.5, 1e-9)
    found = [
        nodes(seen, (np.array([100.0, 0.01]), size * np.array([1.0, 1e-3]), 0.0), 0.0, table, 1e-6, 1.0, 60)
        for size in (1e-3, 1e-2, 0.1)
    ]
    phases = [each.phase for each in found]
    assert 0 < phases[0] <= phases[1] < phases[2] < 1e-9


def test_the_norm_of_a_pose_is_bounded_by_the_rows_of_its_square():
    for matrix in np.random.default_rng(3).normal(size=(20, 3, 3)):
        bound = norm.py_func(matrix[None, None], 0, 0)
        assert bound == pytest.approx(np.sqrt(abs(matrix @ matrix.T).sum(axis=1).max()), rel=1e-13)
        assert bound >= np.linalg.norm(matrix, 2) * (1 - 1e-13)


def test_constants_of_a_radar_are_pairs_in_the_order_of_their_rows():
    rows = np.arange(16.0).reshape(8, 2)
    assert constants(rows) == Exact(*map(tuple, rows.tolist()))


def test_where_no_degree_in_time_is_enough_none_is_chosen():
    moves, sizes = np.array([100.0, 0.01, 1e-5]), np.array([0.5, 1e-3, 1e-6])
    arguments = (moves, sizes, 30.0, 1.0, 0.02, 1.0, 1.0, 8, (1.0, 1.0, 1.0))
    ellipses = np.array([1.5, 3.0, 8.0])
    best, error, flat, bent = choose(*arguments, 1e-6, 40, ellipses)
    assert 4 <= best <= 40 and 0 < error <= 1e-6 and 0 < flat < np.inf and 0 < bent < np.inf
    assert choose(*arguments, 1e-6, best - 1, ellipses) == (0, np.inf, np.inf, np.inf)


@pytest.mark.parametrize(("slack", "wide"), [(0.0, 1.0), (0.5, 1.0), (1.0, 1.0), (3.0, 3.0)])
def test_a_place_counts_as_a_cell_polynomial_s_whole_width_at_least(slack, wide):
    """Points that stay at the reference's range have v = 0, so |v| is `slack` alone, and sums of v^2 bend with it."""
    moves, sizes = np.array([100.0, 0.01, 1e-5]), np.array([0.5, 1e-3, 1e-6])
    ellipses = np.array([1.5, 3.0, 8.0])
    *_, flat, bent = choose(moves, sizes, 30.0, 0.0, slack, 1.0, 1.0, 8, (1.0, 1.0, 1.0), 1e-6, 40, ellipses)
    assert bent == pytest.approx(wide**2 * flat, rel=1e-12)


def test_coefficients_of_high_orders_weigh_as_the_powers_of_a_place_beyond_the_polynomials_width():
    """A bound falls by rho a degree; what stands before it is c_0, c_1 |v| or the others' sum times |v|^7."""
    rho, moves, sizes, first = 3.0, np.array([100.0, 0.01]), np.array([0.5, 1e-3]), []
    for kernel in ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)):
        degree, error, *_ = choose(moves, sizes, 3.0, 0.0, 2.5, 1.0, 1.0, 8, kernel, 1e-6, 40, np.array([rho]))
        first.append(error * rho**degree)
    assert first == pytest.approx(first[0] * np.array([1.0, 2.5, 2.5**7]), rel=1e-12)


def test_cells_are_added_by_eights_before_all_of_them_are_computed(monkeypatch):
    """Three points of which nothing is in the two cells next to them, so that the strongest cell lies beyond."""
    count, places = 64, np.array([0.25, 0.5, 0.75])
    cells = np.array(
        [[cell_sum(np.array([1.0 + 0j]), np.array([u]), j, count) for u in places] for j in range(-32, 32)]
    )
    amplitudes = np.linalg.svd(cells[32:34])[2][-1].conj()
    sums = np.full((count, 2), np.nan)
    monkeypatch.setattr(sums_of_points, "strongest_of", sums_of_points.strongest_of.py_func)
    value, cell, _, lead = sums_of_points.strongest.py_func(amplitudes, places, 0, count, sums)
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
