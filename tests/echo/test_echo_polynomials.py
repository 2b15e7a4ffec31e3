"""The echo's polynomials and their error bounds by the interpreter, against sums and series written out."""

import math
from fractions import Fraction

import numpy as np
import pytest
from numpy.polynomial import chebyshev, polynomial
from scipy.special import jv

from interpreted import interpreted
from lowalt.echo.fast import cell_kernel, polynomials
from lowalt.echo.fast.polynomials import EXTRA, TOP

TAIL = interpreted(polynomials.tail)
DEGREE_FOR = interpreted(polynomials.degree_for)
ECONOMISED = interpreted(polynomials.economised)


@pytest.mark.parametrize("degree", [0, 1, 5, 12, 30, 40])
def test_a_tail_is_two_series_of_coefficients_each_bounded_by_a_geometric_one(degree):
    """4 (B/2)^p / p! from p = degree + 1 on, for the series cut, and B^p / p! from degree + 9 on, for Taylor's."""
    for band in (0.01, 0.3, 1.0, 0.2 * (degree + 2), 0.85 * (degree + 2)):
        series = 0.0
        for first, base, weight in ((degree + 1, band / 2, 4), (degree + 1 + EXTRA, band, 1)):
            ratio = base / (first + 1)
            series += weight * base**first / math.factorial(first) * sum(ratio**k for k in range(400))
        assert TAIL(band, degree) == pytest.approx(series, rel=1e-12)
        # A cosine of any phase has the Chebyshev coefficients 2 J_p(B) at most.
        assert TAIL(band, degree) >= 2 * abs(jv(np.arange(degree + 1, degree + 60), band)).sum()


def test_a_tail_whose_series_hardly_falls_is_no_bound():
    """Nine tenths is the largest ratio of a term to the last one, in either series."""
    for degree in (0, 4, 20):
        for ratio_at_one in (2 * (degree + 2), degree + EXTRA + 2):
            other = min(2 * (degree + 2), degree + EXTRA + 2)
            assert TAIL(0.9 * ratio_at_one * (1 + 1e-12), degree) == np.inf
            assert (TAIL(0.9 * ratio_at_one * (1 - 1e-12), degree) < np.inf) == (ratio_at_one == other)


def test_the_degree_is_the_smallest_that_keeps_the_error():
    for band in np.geomspace(1e-3, 20, 40):
        for error in (1e-2, 1e-6, 1e-14):
            degree = DEGREE_FOR(band, error)
            enough = [TAIL(band, each) <= error for each in range(TOP + 1)]
            assert degree == (enough.index(True) if any(enough) else TOP + 1)
    assert DEGREE_FOR(1e-30, 1e-2) == 0 and DEGREE_FOR(50.0, 1e-2) == TOP + 1
    for degree in (0, 7, TOP):
        assert DEGREE_FOR(1.0, TAIL(1.0, degree)) == degree


def test_folding_cuts_a_power_s_chebyshev_series():
    """x^p as Chebyshev polynomials has binomial coefficients over 2^(p - 1); those above the degree are left out."""
    fold = polynomials.folding()
    assert fold.shape == (TOP + 1, EXTRA, TOP + 1)
    x = np.cos(np.linspace(0, np.pi, 60))
    for degree in (0, 1, 2, 7, 20, 33, TOP):
        for j in range(EXTRA):
            p = degree + 1 + j
            kept = np.zeros(degree + 1)
            for k in range(p % 2, degree + 1, 2):
                kept[k] = float(Fraction(math.comb(p, (p - k) // 2), 2 ** (p - (k > 0))))
            powers = chebyshev.cheb2poly(kept)
            size = abs(powers).sum()
            assert abs(fold[degree, j, : len(powers)] - powers).max() <= 1e-13 * size
            assert not fold[degree, j, len(powers) :].any() and not fold[degree, j, degree + 1 :].any()
    assert abs(polynomial.polyval(x, fold[3, 0]) - (x**4 - chebyshev.chebval(x, [0, 0, 0, 0, 1 / 8]))).max() < 1e-14


@pytest.mark.parametrize("degree", [0, 1, 2, 3, 6, 9, 22])
def test_an_economised_sum_of_cosines_is_its_taylor_series_with_high_orders_folded_back(degree):
    """Taylor orders up to degree + 8 by factorials; what is above the degree goes through Chebyshev polynomials."""
    weights, rates, phase, centre, half = np.array([0.5, -0.2, 0.3]), np.array([2.5, 1.1, 0.0]), 0.4, -0.7, 1.3
    room, out = np.full((3, 5), np.nan), np.full(TOP + 1, np.nan)
    ECONOMISED(weights, rates, phase, centre, half, degree, polynomials.folding(), room, out)
    taylor = np.zeros(degree + EXTRA + 1)
    for p in range(len(taylor)):
        waves = np.cos(rates * centre + phase + p * np.pi / 2)
        taylor[p] = (weights * (rates * half) ** p * waves).sum() / math.factorial(p)
    truth = taylor[: degree + 1].copy()
    for p in range(degree + 1, len(taylor)):
        cut = chebyshev.cheb2poly(chebyshev.poly2cheb(np.eye(p + 1)[p])[: degree + 1])
        truth[: len(cut)] += taylor[p] * cut
    np.testing.assert_allclose(out[: degree + 1], truth, atol=1e-14)
    assert not out[degree + 1 :].any()
    s = np.linspace(-1, 1, 50)
    found = polynomial.polyval(s, out[: degree + 1])
    wave = (weights * np.cos(rates * (centre + half * s)[:, None] + phase)).sum(1)
    assert abs(found - wave).max() <= TAIL(2.5 * half, degree) + 1e-14


@pytest.mark.parametrize("counts", [(1, 1), (1, 4), (3, 1), (5, 2), (4, 4), (16, 7)])
def test_an_array_s_gain_is_a_sum_of_cosines_of_falling_rates(counts):
    """sin(T x) sin(R x) / (T R sin^2 x), x = pi kappa / 2 times the cosine: over its peak, rates from the top."""
    weights, rates = polynomials.array_rule(*counts, 1.07)
    across = np.linspace(-0.9, 0.93, 41)
    x = np.pi * 1.07 / 2 * across
    combs = [np.cos(np.multiply.outer(x, 2 * np.arange(count) - (count - 1))).mean(-1) for count in counts]
    np.testing.assert_allclose(np.cos(np.multiply.outer(across, rates)) @ weights, combs[0] * combs[1], atol=1e-14)
    top = sum(counts) - 2
    assert len(weights) == len(rates) == top // 2 + 1 and rates[0] == pytest.approx(np.pi * 1.07 / 2 * top)
    assert weights.sum() == pytest.approx(1) and (np.diff(rates) < 0).all() and rates.flags.c_contiguous
    assert rates[-1] == (0.0 if top % 2 == 0 else pytest.approx(np.pi * 1.07 / 2))


@pytest.mark.parametrize("count", [1, 2, 3, 20, 31, 32, 33, 90])
def test_the_cell_rule_has_the_moments_of_all_subcarriers(count):
    """Numbers m - (M - 1) / 2 with equal weights; a Gauss rule of n nodes has all even moments below the 2 n-th."""
    weights, rates = polynomials.cell_rule(count)
    nodes = min(count, 32)
    assert len(weights) == (nodes + 1) // 2 and weights.sum() == pytest.approx(1, rel=1e-14)
    numbers = 2 * np.pi / count * (np.arange(count) - (count - 1) / 2)
    for order in range(2, min(2 * nodes, 12), 2):
        assert (weights * rates**order).sum() == pytest.approx((numbers**order).mean(), rel=1e-11)
    assert (np.diff(rates) < 0).all() and (weights > 0).all() and (rates >= 0).all()
    assert (rates[-1] == 0.0) == (nodes % 2 == 1)


def test_values_at_the_nodes_and_chebyshev_coefficients_are_each_other_s_inverse():
    nodes, matrix = polynomials._nodes()
    assert len(nodes) == 96 and nodes[0] == pytest.approx(np.cos(np.pi / 192)) and (np.diff(nodes) < 0).all()
    values = np.cos(np.arange(96) * np.arccos(nodes)[:, None])
    assert abs(matrix @ values - np.eye(96)).max() < 1e-15


FUNCTIONS = {
    "inverse": (0.3, lambda x: (1 + x) ** -0.5), "excess": (0.3, lambda x: 1 / (1 + np.sqrt(1 + x))),
    "cosine": (0.25, lambda x: np.cos(2 * np.pi * np.sqrt(x))),
    "sine": (0.25, lambda x: np.sin(2 * np.pi * np.sqrt(x)) / np.sqrt(x)),
}  # fmt: skip


@pytest.mark.parametrize("kind", FUNCTIONS)
def test_a_function_s_series_and_the_error_of_each_stop_are_those_of_its_chebyshev_coefficients(kind):
    """The error of stopping is the sum of the sizes of all later coefficients, and never less than rounding."""
    reach, function = FUNCTIONS[kind]
    low, middle, wide = (0.0, reach / 2, reach / 2) if kind in ("cosine", "sine") else (-reach, 0.0, reach)
    coefficients, errors = polynomials._expansion.__wrapped__(kind, reach)
    truth = chebyshev.chebinterpolate(lambda s: function(middle + wide * s), 60)
    np.testing.assert_allclose(coefficients[:61].astype(float), truth, atol=1e-13)
    sizes = abs(truth) * (abs(truth) > 1e-13)
    for degree in range(10):
        assert errors[degree] == pytest.approx(sizes[degree + 1 :].sum() + 2e-16, rel=1e-3, abs=3e-13)
    assert len(errors) == len(coefficients) == 96 and (np.diff(errors) <= 0).all() and errors[-1] == 2e-16
    # What is left from some degree on is the noise of the transform itself, and counts as nothing.
    assert errors[60] == 2e-16
    for degree in (0, 3, 4, 7):
        powers, bound = polynomials.smooth.__wrapped__(kind, reach, degree)
        x = np.linspace(low + 1e-9, reach, 70)
        wanted = chebyshev.chebval((x - middle) / wide, truth[: degree + 1])
        assert len(powers) == degree + 1 and powers.dtype == np.float64 and bound == errors[degree]
        np.testing.assert_allclose(polynomial.polyval(x, powers), wanted, atol=1e-13)
        assert abs(polynomial.polyval(x, powers) - function(x)).max() <= bound + 1e-13


@pytest.mark.parametrize("count", [11, 40])
@pytest.mark.parametrize("degree", [3, 7, 19])
def test_cell_kernels_and_sines_are_tabulated_at_all_places(count, degree):
    """Each row is the Chebyshev series, cut at the degree, of a cosine sum about its place; sizes are largest sums."""
    half = 0.8
    table = cell_kernel._cell_polynomials.__wrapped__(count, half, degree)
    assert table.kernels.shape == (33, 9, degree + 1) and table.sines.shape == (33, degree + 1) and table.half == half
    numbers = 2 * np.pi / count * (np.arange(count) - (count - 1) / 2)
    allowed = TAIL(np.pi * half, degree)
    assert table.error == pytest.approx(allowed, rel=1e-14)
    for place in (0, 1, 16, 31, 32):
        for row, cell in enumerate(range(-4, 5)):

            def kernel(v, place=place, cell=cell):
                return np.cos(np.multiply.outer(cell - ((place - 16) / 32 + half * v), numbers)).mean(-1)

            series = chebyshev.chebinterpolate(kernel, 50)[: degree + 1]
            found = chebyshev.poly2cheb(table.kernels[place, row])
            # Folding leaves out what Taylor orders beyond the eighth would fold back, and no more.
            rest = (np.pi * half) ** (degree + 9) / math.factorial(degree + 9) * 2 + 1e-13
            np.testing.assert_allclose(np.pad(found, (0, degree + 1 - len(found))), series, atol=rest)
        wave = chebyshev.chebinterpolate(lambda v, place=place: np.sin(np.pi * ((place - 16) / 32 + half * v)), 50)
        found = chebyshev.poly2cheb(table.sines[place])
        np.testing.assert_allclose(np.pad(found, (0, degree + 1 - len(found))), wave[: degree + 1], atol=rest)
    size = abs(table.kernels).reshape(-1, degree + 1)
    assert table.sizes == pytest.approx((size[:, 0].max(), size[:, 1].max(), size[:, 2:].sum(1).max()), rel=1e-14)
    assert table.kernels.flags.c_contiguous and table.sines.flags.c_contiguous


def test_a_table_s_degree_is_one_less_than_a_multiple_of_four_and_enough():
    """Moments come four at a time; the depth grows by half the distance of two places."""
    for deep in (0.01, 0.3, 1.1, 2.0):
        for error in (1e-2, 1e-7, 1e-14):
            table = cell_kernel.cell_polynomials(64, deep, error)
            orders = table.kernels.shape[2]
            assert orders % 4 == 0 and table.half == deep + 1 / 64
            needed = DEGREE_FOR(np.pi * table.half, error) + 1
            assert needed <= orders < needed + 4
    assert cell_kernel.cell_polynomials(64, 0.3, 1e-300) is None
