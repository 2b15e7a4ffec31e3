"""The strongest cell of the pointwise kernel by the interpreter, and the bound of the cells that are not computed."""

import math

import numpy as np
import pytest

from interpreted import interpreted
from lowalt.echo.pointwise import arg_max, results
from small_echo import TAU

STRONGEST = interpreted(results.strongest)
FAR_BOUND = interpreted(results.far_bound)


@pytest.mark.parametrize("seed", range(8))
def test_the_bound_of_far_cells_is_their_expansion_about_the_middle_of_the_points(seed):
    """g(x) = 1 / (M sin(pi x / M)): first two terms at the nearest cell beyond, and the largest |g''| for the rest."""
    rng = np.random.default_rng(seed)
    count, size = int(rng.integers(12, 80)), int(rng.integers(1, 9))
    u, z = rng.uniform(-2.4, 2.4, size) + rng.integers(-3, 4), rng.normal(size=size) + 1j * rng.normal(size=size)
    low, high = math.floor(u.min()) - int(rng.integers(0, 3)), math.ceil(u.max()) + int(rng.integers(0, 3))
    middle, half = (u.min() + u.max()) / 2, np.ptp(u) / 2
    away = min(abs(np.array([low - 1, high + 1]) - middle).min(), count / 2)
    c, step = z * np.sin(np.pi * u), np.pi / count
    terms_of = [
        abs(c.sum()) / (count * math.sin(step * away)),
        abs((c * (u - middle)).sum()) * step * abs(math.cos(step * away)) / (count * math.sin(step * away) ** 2),
        (abs(c) * (u - middle) ** 2).sum() / 2 * 2 * step**2 / (count * math.sin(step * (away - half)) ** 3),
    ]
    bound = FAR_BOUND(z, u, low, high, count)
    assert bound == pytest.approx(sum(terms_of) + 1e-14 * abs(z).sum(), rel=3e-9) and bound > sum(terms_of)
    beyond = np.arange(high + 1, low + count)
    numbers = np.arange(count) - (count - 1) / 2
    truth = abs(np.cos(TAU * np.multiply.outer(beyond[:, None] - u, numbers) / count).mean(-1) @ z)
    assert (truth <= bound * (1 + 1e-12)).all()


def test_far_cells_as_near_as_the_points_have_no_bound():
    assert FAR_BOUND(np.ones(2), np.array([-0.5, 1.5]), 0, 0, 50) == np.inf
    assert FAR_BOUND(np.ones(2), np.array([-0.5, 1.4]), 0, 1, 50) < np.inf
    # Half a band is the farthest that a cell can be: points spread as far as that have none either.
    assert FAR_BOUND(np.ones(2), np.array([-3.0, 3.0]), -9, 9, 6) == np.inf


def all_cells(z, u, base, count):
    """|value| and value of all cells of a band by plain sums over subcarriers, the cells' own phases included."""
    numbers, j = np.arange(count) - (count - 1) / 2, (np.arange(count) - base)
    kernel = np.exp(1j * TAU * np.multiply.outer(j[:, None] - u, numbers) / count).mean(-1)
    values = (kernel @ z) * np.exp(1j * TAU * (count - 1) / 2 * (np.arange(count)) / count)
    # The kernel changes sign with each band for even M, and so does the phase of the cell's number.
    return abs(values), values


@pytest.mark.parametrize("count", [1, 2, 5, 6, 40, 41])
def test_the_strongest_cell_is_that_of_all_of_them(count):
    rng = np.random.default_rng(count)
    for _ in range(12):
        size = int(rng.integers(1, 6))
        u, z = rng.uniform(-1.5, 1.5, size), rng.normal(size=size) + 1j * rng.normal(size=size)
        base = int(rng.integers(-100, 100))
        work = np.full((count, 2), np.nan)
        value, cell, tie, lead = STRONGEST(z, u, base, count, work)
        strengths, _ = all_cells(z, u, base, count)
        order = np.sort(strengths)
        assert cell == strengths.argmax() and not tie
        assert abs(value) == pytest.approx(order[-1], rel=1e-11)
        turned = sum(
            z * np.cos(TAU * np.multiply.outer((cell - base) - u, np.arange(count) - (count - 1) / 2) / count).mean(-1)
        )
        own = np.exp(1j * np.pi * (count - 1) * cell / count)
        assert abs(value - complex(turned * own)) < 1e-11
        if count > 1:
            assert lead <= (order[-1] - order[-2]) * (1 + 1e-12) + 1e-14 and lead > -1e-14
        rows = (~np.isnan(work[:, 0])).sum()
        low, high = math.floor(u.min()), math.ceil(u.max())
        assert rows in (min(high - low + 1, count), min(high - low + 17, count), count)


def test_cells_about_the_points_are_computed_first_and_no_more_where_they_are_enough():
    work = np.full((64, 2), np.nan)
    _, cell, tie, lead = STRONGEST(np.array([1.0 + 0j, 0.5]), np.array([0.1, 2.0]), 5, 64, work)
    assert (cell, tie) == (5, False) and (~np.isnan(work[:, 0])).sum() == 3 and lead > 0.2
    # Two equal cells of an even band are a tie; one cell alone is none.
    assert STRONGEST(np.array([1.0 + 0j]), np.array([0.5]), 5, 64, work)[1:3] == (5, True)
    assert STRONGEST(np.array([1.0 + 0j]), np.array([0.5]), 5, 1, np.empty((1, 2)))[1:3] == (0, False)


def test_the_largest_and_second_largest_sum_are_found_and_the_first_of_equals_wins():
    strongest_of = interpreted(arg_max.strongest_of)
    rng = np.random.default_rng(3)
    for _ in range(50):
        rows = rng.normal(size=(9, 2))
        first, last = sorted(rng.integers(0, 9, 2).tolist())
        strengths = np.hypot(*rows[first : last + 1].T)
        best, second, which = strongest_of(rows, first, last)
        order = np.sort(strengths)
        assert best == pytest.approx(order[-1], rel=1e-14) and which == first + strengths.argmax()
        assert second == (pytest.approx(order[-2], rel=1e-14) if len(order) > 1 else -1.0)
    same = np.array([[0.0, 0.0], [3.0, 4.0], [5.0, 0.0], [0.0, 0.0]])
    assert strongest_of(same, 0, 3) == (5.0, 5.0, 1) and strongest_of(same, 2, 3) == (5.0, 0.0, 2)
    assert strongest_of(np.zeros((2, 2)), 0, 1) == (0.0, 0.0, 0)
