"""How a plan's error is made up, and how the strongest cell is proved: each step against its own derivation."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from interpreted import interpreted
from lowalt.echo.fast import error_model, strongest_cell
from lowalt.echo.fast.error_model import COSINE_DEGREES, FINEST, SINGLE_ERROR, echo_plan
from lowalt.echo.fast.polynomials import smooth
from lowalt.echo.fast.strongest_cell import CERTAIN, UNCERTAIN

FAR_LIMIT = interpreted(strongest_cell.far_limit)
CERTIFY = interpreted(strongest_cell.certify)


@pytest.mark.parametrize("steps", [1, 2, 6])
def test_a_size_is_rounded_up_by_less_than_a_step_of_an_octave(steps):
    for value in np.geomspace(1e-8, 1e6, 97):
        found = error_model.round_up(value, steps)
        assert value <= found * (1 + 1e-12) and found < value * 2 ** (1 / steps) * (1 + 1e-12)
        assert steps * math.log2(found) == pytest.approx(round(steps * math.log2(found)), abs=1e-9)
    assert error_model.round_up(0.0, steps) == error_model.round_up(1e-9, steps) >= 1e-9
    assert (
        error_model.round_up(4.0, steps) == 4.0 and error_model.round_up(3.9) == 4.0 and error_model.round_up(2.5) < 3
    )


RADAR = SimpleNamespace(turns=33.0, kappa=1.06, transmit_h=5, receive_h=3, transmit_v=4, receive_v=7)


def asked(monkeypatch, **changes) -> tuple:
    """What a plan is computed for, as `echo_plan` rounds it."""
    given = {"radar": RADAR, "spread": 0.01, "size_m": 0.7, "points": 700, "error": 1e-5} | changes
    with monkeypatch.context() as patch:
        patch.setattr(error_model, "_echo_plan", lambda *arguments: arguments)
        return echo_plan(*given.values())


def test_a_plan_is_computed_for_sizes_that_are_no_smaller_than_the_target_s(monkeypatch):
    """eps = r^2 / r_ref^2 - 1 is at most 2 s + s^2 for a spread s; nodes in time may lie half a percent farther out."""
    for spread in np.geomspace(1e-6, 0.15, 30):
        turns, kappa, rate_h, rate_v, reach, size_m, *_ = asked(monkeypatch, spread=spread, size_m=10 * spread)
        assert (turns, kappa, rate_h, rate_v) == (33.0, 1.06, 6, 9)
        widest = 2 * 1.004 * spread + (1.004 * spread) ** 2
        assert widest <= reach <= 1.01 * math.sqrt(2) * (2 * spread + spread**2)
        assert 10 * spread <= size_m <= 10 * math.sqrt(2) * spread * 1.001
    assert asked(monkeypatch, spread=0.22)[4] == 0.5
    assert [asked(monkeypatch, points=points)[6] for points in (1, 512, 513, 1024, 1025)] == [1, 1, 2, 2, 3]
    for error in np.geomspace(1e-14, 1e-2, 30):
        rounded = asked(monkeypatch, error=error)[7]
        assert rounded <= error < 2 * rounded and math.log2(rounded) == round(math.log2(rounded))
    assert asked(monkeypatch, error=0.0)[7] == asked(monkeypatch, error=1e-15)[7] > 0.5e-15


@pytest.mark.parametrize("seed", range(6))
def test_a_plan_s_error_is_the_sum_of_its_functions_errors_as_the_phase_magnifies_them(seed):
    """The wave's phase is 4 pi turns a metre of range, there and back counted by turns; the arrays' is pi kappa / 2 an
    element and unit of cosine. A range that is off by a share costs two shares of 1 / r^2 and the arrays' phase."""
    rng = np.random.default_rng(seed)
    for _ in range(40):
        turns, kappa, rates = rng.uniform(5, 500), rng.uniform(0.9, 1.1), rng.integers(0, 40, 2)
        reach, size_m, strips = 2.0 ** rng.uniform(-12, -1), 2.0 ** rng.uniform(-8, 4), int(rng.integers(1, 9))
        error = 2.0 ** -rng.integers(4, 50)
        plan = error_model._echo_plan.__wrapped__(turns, kappa, *rates, reach, size_m, strips, error)
        wave, array = 4 * np.pi * turns * size_m, np.pi * kappa * rates.sum() / 2
        ranges = wave * smooth("excess", reach, 4)[1], smooth("inverse", reach, 3)[1]
        assert plan.near == (ranges[0] + (2 + array) * ranges[1] <= error / 3)
        unit = 2.0**-53
        # cos and sin / t share half of what ranges leave, |t| <= 1/2; the longest is taken where none is enough.
        waves = [smooth("cosine", 0.25, n)[1] + smooth("sine", 0.25, n)[1] / 2 for n in COSINE_DEGREES]
        number = next(
            (n for n, wrong in zip(COSINE_DEGREES, waves, strict=True) if wrong <= error / 3), COSINE_DEGREES[-1]
        )
        assert len(plan.functions.cosine) == len(plan.functions.sine) == number + 1
        kind = np.float32 if error > SINGLE_ERROR else np.float64
        assert plan.single == (kind is np.float32) and {each.dtype for each in plan.functions[2:]} == {np.dtype(kind)}
        rounding = (8 * array + 30 + strips) * unit + 101 * (2.0**-24 if plan.single else unit)
        inexact = ranges[0] + (2 + array) * ranges[1] if plan.near else 0.0
        assert plan.share == pytest.approx(inexact + waves[COSINE_DEGREES.index(number)] + rounding, rel=1e-12)
        lost = array * ranges[1] if plan.near else 0.0
        assert plan.peak == pytest.approx(lost + 8 * array * unit, rel=1e-12)
        assert plan.phase == pytest.approx(64 * np.pi * turns * unit, rel=1e-14)
        assert plan.fit == pytest.approx(max(error / 6, FINEST), rel=1e-14)
        np.testing.assert_array_equal(plan.functions.excess, smooth("excess", reach, 4)[0])
        np.testing.assert_array_equal(plan.functions.inverse, smooth("inverse", reach, 3)[0])
        np.testing.assert_array_equal(plan.functions.cosine, smooth("cosine", 0.25, number)[0].astype(kind))
        np.testing.assert_array_equal(plan.functions.sine, smooth("sine", 0.25, number)[0].astype(kind))


def test_cosine_and_sine_round_as_often_as_horner_s_rule_does():
    """Order k of a series in t^2 rounds 2 k + 2 times, weighted by its coefficient at half a turn.

    The real and the imaginary part's roundings are at right angles to each other: together 85 at most.
    """
    for degree in COSINE_DEGREES:
        powers = 0.25 ** np.arange(degree + 1)
        often = 2 * np.arange(degree + 1) + 2
        terms = [abs(smooth(kind, 0.25, degree)[0]) * powers * often for kind in ("cosine", "sine")]
        assert 75 < math.hypot(terms[0].sum(), terms[1].sum() / 2) <= 85


def test_a_station_s_gains_are_those_of_its_own_sides():
    gains = error_model.array_gains(RADAR)
    for weights, rates, counts in ((gains.weights_h, gains.rates_h, (5, 3)), (gains.weights_v, gains.rates_v, (4, 7))):
        combs = [np.cos(np.pi * 1.06 / 2 * 0.31 * (2 * np.arange(count) - (count - 1))).mean() for count in counts]
        assert np.cos(rates * 0.31) @ weights == pytest.approx(combs[0] * combs[1], rel=1e-13)


def test_the_pointwise_kernel_s_error_grows_with_phase_points_and_elements():
    """Twenty roundings of the largest phase, 200 more, one a point; risks as the arrays' phase magnifies them."""
    share, risk = error_model.pointwise_bound(RADAR, 0.4, 70)
    assert share * 2.0**53 == pytest.approx(20 * 4 * np.pi * 33.0 * 0.4 + 270, rel=1e-13)
    assert risk * 2.0**53 == pytest.approx(40 * (1 + np.pi * 1.06 / 2 * 15), rel=1e-13)


def sine_from_below(x):
    """x - x^3 / 6 <= sin x."""
    return x - x**3 / 6


@pytest.mark.parametrize(
    ("count", "distance", "half"), [(64, 4.5, 0.3), (20, 3.2, 1.1), (300, 2.0, 1.9), (9, 4.5, 0.1)]
)
def test_each_far_moment_is_weighted_by_a_derivative_of_the_kernel(count, distance, half):
    """1 / (M sin(pi x / M)) and its derivatives over factorials, cosines taken as one: (pi / M)^k / (M sin^(k + 1))."""
    step = np.pi / count
    for order in range(4):
        far = np.zeros(4)
        far[order] = 1.7
        x = distance - half if order == 3 else distance
        wanted = 1.7 * step**order / (count * sine_from_below(step * x) ** (order + 1))
        assert FAR_LIMIT(far, distance, half, count) == pytest.approx(wanted, rel=2e-9)
        assert FAR_LIMIT(far, distance, half, count) > wanted
    assert FAR_LIMIT(np.zeros(4), half, half, count) == np.inf == FAR_LIMIT(np.zeros(4), half - 0.1, half, count)
    assert FAR_LIMIT(np.ones(4), half + 1e-3, half, count) < np.inf


def test_far_moments_are_sums_over_points_and_what_the_series_cuts_is_bounded():
    """Sum of z sin(pi u) y^k by the sine's series; orders that the moments do not reach weigh with sum |z| v^2."""
    rng = np.random.default_rng(8)
    v, z = rng.uniform(-1, 1, 9), rng.normal(size=9) + 1j * rng.normal(size=9)
    sines, half, error = rng.normal(size=(5, 8)), 1.3, 0.01
    powers = (z[:, None] * v[:, None] ** np.arange(8)).sum(0)
    total, second, far = abs(z).sum(), (abs(z) * v**2).sum(), np.full(4, np.nan)
    fill = interpreted(strongest_cell.far_moments)
    fill(sines, 3, np.stack([powers.real, powers.imag]), half, total, second, error, far)
    for k in range(3):
        reached = np.polynomial.polynomial.polyval(v, sines[3, : 8 - k])
        beyond = abs(sines[3, 8 - k :]).sum() * second
        wanted = half**k * (abs((z * v**k * reached).sum()) + beyond + error * total)
        assert far[k] == pytest.approx(wanted, rel=1e-12)
    assert far[3] == pytest.approx(half**3 * second, rel=1e-13)


def test_sums_of_cells_are_filled_between_the_first_and_the_last():
    rng = np.random.default_rng(9)
    kernels, moments, sums = rng.normal(size=(4, 9, 8)), rng.normal(size=(2, 8)), np.full((9, 2), np.nan)
    interpreted(strongest_cell.cell_sums)(kernels, 2, moments, 3, 6, sums)
    np.testing.assert_allclose(sums[3:7], (kernels[2] @ moments.T)[3:7], rtol=1e-12)
    assert np.isnan(sums[:3]).all() and np.isnan(sums[7:]).all()


def certified(strengths, size=0.0, centre=0.0, bound=0.0, **given):
    """(state, row, tie, lead, rows computed, far bounds) of cells of these strengths.

    given: `leak`, |sum z sin(pi u)|; `count` of subcarriers; `error`, `total` and `second` of `far_moments`.
    """
    kernels, sines = np.zeros((2, 9, 4)), np.zeros((2, 4))
    kernels[1, :, 0], sines[1, 0] = strengths, given.get("leak", 0.0)
    moments = np.zeros((2, 4))
    moments[0, 0] = 1.0
    table = SimpleNamespace(kernels=kernels, sines=sines, half=0.25)
    totals, count = (given.get("total", 0.0), given.get("second", 0.0)), given.get("count", 64)
    sums, far = np.full((9, 2), np.nan), np.full(4, np.nan)
    found = CERTIFY(table, 1, centre, moments, size, totals, given.get("error", 0.0), bound, count, sums, far)
    return *found, np.flatnonzero(~np.isnan(sums[:, 0])).tolist(), far


PEAK = (0.0, 0.0, 0.1, 0.4, 1.0, 0.3, 0.2, 0.0, 0.0)


def test_cells_within_one_and_a_half_of_the_target_s_size_and_a_little_more_are_computed_first():
    """0.6 cells and 1.5 times the distance of its farthest point, on either side of the target's place."""
    assert certified(PEAK, size=0.0)[4] == [4]
    assert certified(PEAK, size=0.26)[4] == [4] and certified(PEAK, size=0.27)[4] == [3, 4, 5]
    assert certified(PEAK, size=0.0, centre=0.41)[4] == [4, 5] and certified(PEAK, size=0.0, centre=-0.41)[4] == [3, 4]
    assert certified(PEAK, size=0.93)[4] == [3, 4, 5] and certified(PEAK, size=0.94)[4] == [2, 3, 4, 5, 6]
    assert certified(PEAK, size=9.0)[4] == list(range(9))


def test_a_bound_of_far_cells_is_taken_at_the_nearest_cell_not_computed():
    """Only cell 0 is computed, about a place at `centre`; the nearest others are at -1 and 1."""
    for centre, gap in ((0.0, 1.0), (0.3, 0.7), (-0.35, 0.65)):
        far = np.array([0.5, 0.0, 0.0, 0.0])
        limit = FAR_LIMIT(far, gap, 0.25, 64)
        state, row, tie, lead, rows, told = certified(PEAK, centre=centre, leak=0.5)
        assert (state, row, tie, rows) == (CERTAIN, 4, False, [4]) and told[0] == 0.5
        assert lead == pytest.approx(1 - limit, rel=1e-12)
    # In a band of six cells none is farther than three cells, which is half of it.
    lone = (0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0)
    *_, lead, rows, _ = certified(lone, size=2.0, leak=0.5, count=6)
    assert rows == [1, 2, 3, 4, 5, 6, 7] and lead == pytest.approx(1 - FAR_LIMIT(far, 3.0, 0.25, 6), rel=1e-12)
    *_, lead, rows, _ = certified(lone, size=2.0, leak=0.5, count=64)
    assert lead == pytest.approx(1 - FAR_LIMIT(far, 4.0, 0.25, 64), rel=1e-12)


def test_where_near_cells_do_not_exclude_the_others_all_nine_are_computed_and_may_prove_it():
    """A leak that leaves cells at a distance of 1 open, but not those at 5."""
    leak = 0.5 / FAR_LIMIT(np.array([1.0, 0, 0, 0]), 5.0, 0.25, 64)
    assert FAR_LIMIT(np.array([leak, 0, 0, 0]), 1.0, 0.25, 64) > 1
    state, row, tie, lead, rows, _ = certified(PEAK, leak=leak)
    assert (state, row, tie, rows) == (CERTAIN, 4, False, list(range(9))) and lead == pytest.approx(0.5, rel=1e-12)
    state, row, tie, lead, rows, _ = certified(PEAK, leak=2.1 * leak)
    assert (state, row, tie, lead, rows) == (UNCERTAIN, 0, False, 0.0, list(range(9)))
    # Of nine cells the nearest one that is not computed is five away from a place in the middle, less off it.
    for centre in (0.3, -0.3):
        told = certified(PEAK, leak=leak, centre=centre)
        assert told[3] == pytest.approx(1 - FAR_LIMIT(np.array([leak, 0, 0, 0]), 4.7, 0.25, 64), rel=1e-12)


def test_an_error_of_the_sums_takes_twice_its_size_from_the_lead():
    """The strongest may be too strong by it and any other too weak; far cells' sums too."""
    assert certified(PEAK, size=0.3, bound=0.1)[3] == pytest.approx(1 - 0.4 - 0.2, rel=1e-12)
    assert certified(PEAK, bound=0.49)[:2] == (CERTAIN, 4) and certified(PEAK, bound=0.51)[0] == UNCERTAIN
    leak = 0.5 / FAR_LIMIT(np.array([1.0, 0, 0, 0]), 5.0, 0.25, 64)
    assert (
        certified(PEAK, leak=leak, bound=0.249)[0] == CERTAIN
        and certified(PEAK, leak=leak, bound=0.251)[0] == UNCERTAIN
    )
    # The error of the sums with sines is relative to the amplitudes' sum, that of their series to sum |z| v^2.
    assert certified(PEAK, error=0.01, total=3.0)[5][0] == pytest.approx(0.03)
    assert certified(PEAK, second=2.0)[5][3] == pytest.approx(2.0 * 0.25**3)


def test_two_cells_alike_to_a_trillionth_are_a_tie():
    for apart, tie in ((0.0, True), (0.9e-12, True), (1.2e-12, False), (1e-9, False)):
        strengths = (0.0, 0.0, 0.0, 0.5 - 0.5 * apart, 0.5, 0.0, 0.0, 0.0, 0.0)
        state, row, found, lead, *_ = certified(strengths, centre=-0.5)
        assert (state, found) == (CERTAIN, tie) and row == (3 if apart == 0.0 else 4)
        assert lead == pytest.approx(0.5 * apart, abs=1e-16)
