"""How many nodes in slow time are enough: every step of the bound against its own derivation or a search."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from interpreted import interpreted
from lowalt.echo.fast.cell_kernel import PLACES
from lowalt.echo.slow_time import node_count, pose_series
from lowalt.echo.slow_time.node_count import RHO, Nodes

ON_ELLIPSE = interpreted(node_count._on_ellipse)
TILT = interpreted(node_count._tilt)
GROWTH = interpreted(node_count._growth)
CHOOSE = interpreted(node_count.choose)


def test_ellipses_go_from_a_narrow_one_to_a_wide_one_in_equal_ratios():
    assert len(RHO) == 24 and RHO[0] == pytest.approx(1.15) and RHO[-1] == pytest.approx(40)
    np.testing.assert_allclose(np.diff(np.log(RHO)), math.log(40 / 1.15) / 23)
    assert np.finfo(float).epsneg == node_count.ROUND


@pytest.mark.parametrize("rho", [1.2, 3.0, 20.0])
def test_series_on_an_ellipse_are_as_large_as_their_chebyshev_polynomials_there(rho):
    """T_k reaches (rho^k + rho^-k) / 2 on the axis, its imaginary part (rho^k - rho^-k) / 2 off it."""
    rng = np.random.default_rng(2)
    moves, sizes = rng.uniform(size=(2, 6))
    turn = np.exp(1j * np.linspace(0, 2 * np.pi, 16 * 720 + 1))
    time = (rho * turn + 1 / (rho * turn)) / 2
    values = np.stack([chebyshev.chebval(time, np.eye(6)[k]) for k in range(6)])
    wide, high = abs(values).max(1), abs(values.imag).max(1)
    found = ON_ELLIPSE(rho, moves, sizes)
    wanted = (moves[1:] @ wide[1:], moves[1:] @ high[1:], sizes @ wide, sizes[1:] @ high[1:])
    np.testing.assert_allclose(found, wanted, rtol=1e-5)


def test_no_complex_vector_is_tilted_more_than_its_bound_and_some_nearly_as_much():
    """V = a + j b: the imaginary part of V / sqrt(V.V), by a search over |a| and the angle of a and b; |b| = 1."""
    angle, length = np.linspace(0, np.pi, 101)[:, None], np.geomspace(1.05, 400, 60)
    root = np.sqrt(length**2 - 1 + 2j * length * np.cos(angle))
    along, across = (length + 1j * np.cos(angle)) / root, 1j * np.sin(angle) / root
    tilted, near = np.hypot(along.imag, across.imag).ravel(), root.real.ravel()
    bounds = np.array([TILT(1.0, each) for each in near])
    assert (tilted <= bounds * (1 + 1e-12)).all() and (bounds >= 1 / near).all()
    # A vector across the imaginary one is tilted by their ratio; beyond it the bound grows with the fourth power.
    assert (bounds <= 1 / near + 0.5 / near**5 + 1e-15).all()
    assert TILT(0.2, 0.5) == TILT(0.4, 1.0) and 0 < TILT(1e-9, 1.0) < 1.1e-9


def test_growth_on_an_ellipse_is_made_up_of_amplitude_gain_and_phase():
    """The reference's series gives its least and largest range there; the derivation is in the kernel's text.

    Amplitudes grow as the square of the ranges' ratio, gains as exp of their rate times the tilt. The range difference
    is e.m with |m| at most half the length of 2 ref + e over the least range; Im(e.m) is Im e times |m| and e times
    Im m, where Im m is a tilt and half the range difference's share of the unit vectors' distance.
    """
    rng = np.random.default_rng(5)
    for _ in range(200):
        moves = np.array([rng.uniform(20, 200), *rng.uniform(0, 2, 3)])
        sizes, rho = rng.uniform(0, 1.0, 4), rng.uniform(1.1, 2.0)
        turns, half, phases, rates = rng.uniform(1, 40, 4)
        stray, moved, reach, deep = ON_ELLIPSE(rho, moves, sizes)
        real, side = moves[0] - stray - reach, moved + deep
        found = GROWTH(rho, moves, sizes, turns, half, phases, rates)
        if real <= side:
            assert found == (np.inf, np.inf, np.inf)
            continue
        near, far = math.sqrt(real**2 - side**2), moves[0] + stray
        difference = reach * (2 * far + reach) / (2 * near)
        directions = reach / near + far * difference / near**2
        bent = TILT(side, near) + difference / (2 * near) * directions / 2
        radians = 2 * np.pi * turns * (deep * (2 * far + reach) / (2 * near) + reach * bent)
        radians += 2 * np.pi * phases * TILT(side, near)
        bare = rates * TILT(side, near) + 2 * math.log(far / near)
        assert found == pytest.approx((bare + radians, bare, half * difference), rel=1e-12)


def test_an_ellipse_that_may_hold_the_station_has_no_bound():
    moves, nothing = np.array([10.0, 1.0]), np.zeros(2)
    # The least range is as large as its imaginary part, 10 - (rho + 1 / rho) / 2 = (rho - 1 / rho) / 2, at rho = 10.
    assert GROWTH(10.0 + 1e-9, moves, nothing, 1.0, 1.0, 1.0, 1.0) == (np.inf, np.inf, np.inf)
    assert max(GROWTH(10.0 - 1e-6, moves, nothing, 1.0, 1.0, 1.0, 1.0)) < np.inf


MOVES, SIZES, KERNEL = np.array([100.0, 0.8, 0.02, 1e-4]), np.array([0.5, 0.03, 1e-3, 1e-6]), (1.1, 0.4, 0.3)
TURNS, CELLS, SLACK, PHASES, RATES, ORDERS = 33.0, 0.9, 0.02, 9.0, 57.0, 8


def chosen(target, top=400, ellipses=RHO):
    return CHOOSE(MOVES, SIZES, TURNS, CELLS, SLACK, PHASES, RATES, ORDERS, KERNEL, target, top, ellipses)


@pytest.mark.parametrize("target", [1e-2, 1e-5, 1e-9, 1e-13])
def test_the_degree_in_time_is_the_smallest_that_any_ellipse_allows(target):
    """4 M rho^-d / (rho - 1) by a search over degrees and ellipses; M: growth times the kernel's largest value."""
    errors = {}
    for rho in RHO:
        whole, _, v = GROWTH(rho, MOVES, SIZES, TURNS, CELLS, PHASES, RATES)
        if whole < np.inf:
            wide = max(1.0, v + SLACK)
            level = whole + math.log(KERNEL[0] + KERNEL[1] * wide + KERNEL[2] * wide**7)
            for degree in range(4, 400):
                errors[degree, rho] = math.log(4 / (rho - 1)) + level - degree * math.log(rho)
    enough = min(degree for (degree, _), error in errors.items() if error <= math.log(target))
    degree, error, *_ = chosen(target)
    assert degree == enough and error <= target
    assert math.log(error) in [pytest.approx(errors[enough, rho], abs=1e-9) for rho in RHO if (enough, rho) in errors]
    assert chosen(target, top=enough)[0] == enough and chosen(target, top=enough - 1) == (0, np.inf, np.inf, np.inf)


def test_few_nodes_are_four_at_least():
    assert chosen(1e12)[0] == 4 and chosen(1e12, top=3)[0] == 0


def test_sums_between_nodes_bend_by_an_eighth_of_their_second_derivative_and_the_squared_spacing():
    """Cauchy's estimate on circles inside the ellipse, the ellipse that gives least; nodes are at most pi / d apart."""
    degree, _, flat, bent = chosen(1e-9)
    curves, wider = [], []
    for rho in RHO:
        whole, bare, v = GROWTH(rho, MOVES, SIZES, TURNS, CELLS, PHASES, RATES)
        if whole < np.inf:
            # The circle about an end of [-1, 1] that touches the ellipse's vertex.
            curves.append(2 * math.exp(bare) / (0.5 * (rho + 1 / rho) - 1) ** 2)
            wider.append(curves[-1] * max(1.0, v + SLACK) ** 2)
    nodes = -np.cos(np.pi * np.arange(degree + 1) / degree)
    spacing = np.diff(nodes).max()
    assert flat == pytest.approx(min(curves) * spacing**2 / 8, rel=2e-2) and flat >= min(curves) * spacing**2 / 8
    assert bent == pytest.approx(min(wider) * spacing**2 / 8, rel=2e-2) and bent >= min(wider) * spacing**2 / 8
    assert flat * 8 / min(curves) == pytest.approx((2 * math.sin(np.pi / (2 * degree))) ** 2, rel=1e-12)


RADAR = SimpleNamespace(turns=31.0, cells=0.2, kappa=1.05, transmit_h=5, receive_h=3, transmit_v=4, receive_v=7)
TABLE = SimpleNamespace(half=1.7, kernels=np.empty((1, 1, 12)), sizes=(1.0, 0.2, 0.1))


def nodes(moves=MOVES, offsets=SIZES, stray=0.0, stray_ref=0.0, room=np.inf, choose=None, top=60):
    """`node_count.nodes` and what it asked `choose` for."""
    given = []

    def noted(*arguments):
        given.append(arguments)
        return choose or (7, 1e-7, 0.3, 0.4)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(node_count, "choose", noted)
        return node_count.nodes(RADAR, (moves, offsets, stray), stray_ref, TABLE, 1e-6, room, top), given


def test_nodes_are_chosen_for_the_radar_s_phases_and_the_table_s_width():
    """kappa / 4 turns and pi kappa / 2 radians an element beyond the first of each side; ranges over half."""
    found, [given] = nodes()
    moves, sizes, turns, cells, slack, phases, rates, orders, kernel, target, top, ellipses = given
    assert moves is MOVES and sizes is SIZES and (turns, orders, target, top) == (31.0, 12, 1e-6, 60)
    assert cells == pytest.approx(0.2 / 1.7) and slack == pytest.approx(0.5 / PLACES / 1.7) and kernel == TABLE.sizes
    assert phases == pytest.approx(1.05 / 4 * 15) and rates == pytest.approx(np.pi * 1.05 / 2 * 15)
    assert ellipses is RHO and found[:2] == (7, 1e-7) and found[4:] == (0.3, 0.4)
    assert nodes(choose=(0, np.inf, np.inf, np.inf))[0] is None


def test_errors_of_the_poses_turn_the_phase_by_the_range_and_by_the_directions_and_a_tenth_more():
    """A place off by s moves the range by s, there and back as turns count it; a direction off by s over the least
    range turns offsets, there and back, and the arrays. The least range is what the series leave of the reference's."""
    least, reach = 2 * MOVES[0] - MOVES.sum() - SIZES.sum(), SIZES.sum()
    phases, rates = 1.05 / 4 * 15, np.pi * 1.05 / 2 * 15
    rounding = 2 * (len(MOVES) + 2) * 2.0**-53
    for stray, stray_ref in ((0.0, 0.0), (1e-6, 0.0), (0.0, 1e-5), (3e-7, 2e-6)):
        found, _ = nodes(stray=stray, stray_ref=stray_ref)
        place = stray + rounding * reach
        direction = (stray_ref + rounding * MOVES.sum() + place) / least
        turned = 31.0 * (place + 2 * reach * direction) + phases * direction
        assert found.phase == pytest.approx(1.1 * 2 * np.pi * turned, rel=1e-12)
        assert found.gain == pytest.approx(1.1 * (rates + 2) * direction, rel=1e-12)
        assert nodes(stray=stray, stray_ref=stray_ref, room=found.phase)[0] is not None
        assert nodes(stray=stray, stray_ref=stray_ref, room=found.phase * (1 - 1e-12))[0] is None
    assert isinstance(found, Nodes) and nodes(stray=np.nan)[0] is None


def test_a_target_whose_series_may_reach_the_station_is_not_interpolated():
    """The other orders of the reference and the offsets together are as long as the reference is far."""
    offsets = np.array([60.0, 40.0 - 0.8201 + 1e-9])
    assert nodes(offsets=offsets)[0] is None and nodes(offsets=offsets - 1e-6)[0] is not None


@pytest.mark.parametrize(("count", "orders"), [(4, 2), (12, 4), (33, 9), (500, 9)])
def test_poses_are_fitted_by_least_squares_in_a_quarter_as_many_orders_as_symbols_and_nine_at_most(count, orders):
    project, values = pose_series.fit.__wrapped__(count)
    times = np.linspace(-1, 1, count)
    assert project.shape == values.shape == (orders, count)
    np.testing.assert_allclose(values, [np.cos(k * np.arccos(times)) for k in range(orders)], atol=1e-12)
    some = np.random.default_rng(1).normal(size=count)
    np.testing.assert_allclose(project @ some, np.linalg.lstsq(values.T, some, rcond=None)[0], atol=1e-12)


@pytest.mark.parametrize("degree", [4, 5, 40])
def test_weights_from_nodes_are_lagrange_s_and_those_between_two_neighbours(degree):
    polynomial, linear, values = pose_series.weights.__wrapped__(21, degree)
    nodes_at, symbols = -np.cos(np.pi * np.arange(degree + 1) / degree), np.linspace(-1, 1, 21)
    assert polynomial.shape == linear.shape == (21, degree + 1)
    np.testing.assert_allclose(values, [[np.cos(k * np.arccos(x)) for k in range(6)] for x in nodes_at], atol=1e-12)
    for row, x in enumerate(symbols):
        wanted = [np.prod([(x - b) / (a - b) for b in nodes_at if b != a]) for a in nodes_at]
        np.testing.assert_allclose(polynomial[row], wanted, atol=1e-11)
        hat = [max(0.0, 1 - abs(x - a) / abs(nearest_towards(nodes_at, i, x) - a)) for i, a in enumerate(nodes_at)]
        np.testing.assert_allclose(linear[row], hat, atol=1e-12)
    assert linear.flags.c_contiguous and polynomial[0].tolist() == [1.0] + [0.0] * degree


def nearest_towards(nodes_at, index, x):
    """The neighbour of a node on the side where x stands."""
    other = index + (1 if x >= nodes_at[index] else -1)
    return nodes_at[other] if 0 <= other < len(nodes_at) else nodes_at[index] + (5.0 if x >= nodes_at[index] else -5.0)


def test_a_column_is_projected_and_what_it_leaves_is_told_and_kept():
    rng = np.random.default_rng(6)
    project, back = rng.normal(size=(2, 3, 11))
    values, found = rng.normal(size=11), np.full((3, 4), np.nan)
    truth = project @ values
    left = values - back.T @ truth
    worst = interpreted(pose_series._column)(project, back, values, found, 2)
    np.testing.assert_allclose(found[:, 2], truth, atol=1e-13)
    np.testing.assert_allclose(values, left, atol=1e-13)
    assert worst == abs(values).max() and np.isnan(found[:, [0, 1, 3]]).all()
