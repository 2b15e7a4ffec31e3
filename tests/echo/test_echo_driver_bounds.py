"""Each part of the fast kernel's error bound, alone, and moments at nodes in time; by the interpreter."""

from types import SimpleNamespace

import numpy as np
import pytest

from driven_echo import MOTION, SMALL, bare, computed, sums_of
from interpreted import interpreted
from lowalt.echo import refine
from lowalt.echo.fast import driver, segment
from lowalt.echo.fast.error_model import SINGLE_BLOCK
from lowalt.echo.fast.range_bounds import MEAN, SIZE, cut_segments
from lowalt.echo.fast.strip import STRIP
from lowalt.echo.fast.workspace import workspace
from small_echo import pieces


def test_each_kind_of_error_adds_its_own_part_to_the_bound():
    """Relative to the sum of amplitudes, to that of peak amplitudes, and to amplitudes times distances."""
    total, _, peaks = sums_of(MOTION)
    none, *_ = computed(MOTION, change=bare())
    assert (none.bounds < 1e-12 * total).all()
    share, *_ = computed(MOTION, change=bare(plan={"share": SMALL}))
    np.testing.assert_allclose(share.totals, total * (1 + SMALL), rtol=1e-9)
    np.testing.assert_allclose(share.bounds, total * (1 + SMALL) * SMALL, rtol=1e-7)
    peak, *_ = computed(MOTION, change=bare(plan={"peak": SMALL}))
    np.testing.assert_allclose(peak.totals, total + peaks * SMALL, rtol=1e-9)
    np.testing.assert_allclose(peak.bounds, peaks * SMALL, rtol=1e-7)
    table, *_ = computed(MOTION, change=bare(cells={"error": SMALL}))
    np.testing.assert_allclose(table.bounds, total * SMALL, rtol=1e-7)
    for size, mean in ((0.5, 100.0), (100.0, 0.5)):
        phase, *_ = computed(MOTION, change=bare(plan={"phase": SMALL}), extents={SIZE: size, MEAN: mean})
        wanted = total * 0.5 if size == 0.5 else peaks * 0.5
        np.testing.assert_allclose(phase.bounds, wanted * SMALL, rtol=1e-7)


@pytest.mark.parametrize("error", [0.0, 1e-3])
def test_roundings_of_the_moments_weigh_as_the_cell_kernels_weight_them(error):
    """c_0 with the sum of |z|, the other c_k with that of |z| v^2, c_1 with the root of both sums' product."""
    total, second, _ = sums_of(MOTION)
    _, _, approximation, _ = computed(MOTION, error, change=bare())
    *_, rounding = interpreted(driver.precision)(approximation.plan, 32, approximation.cells.kernels.shape[2])
    big = 1e5
    for sizes, weight in (((big, 0, 0), total), ((0, big, 0), np.sqrt(total * second)), ((0, 0, big), second)):
        more, *_ = computed(MOTION, error, change=bare(cells={"sizes": tuple(map(float, sizes))}))
        none, *_ = computed(MOTION, error, change=bare(cells={"sizes": (0.0, 0.0, 0.0)}))
        tight = 1e-9 if error == 0.0 else 3e-2
        np.testing.assert_allclose(more.bounds - none.bounds, big * rounding * weight, rtol=tight)


@pytest.mark.parametrize(
    ("single", "padded", "orders"), [(False, 32, 8), (True, 32, 12), (True, 1024, 16), (False, 2**22, 8)]
)
def test_a_moment_rounds_as_often_as_powers_products_and_sums_do(single, padded, orders):
    """3 k + 1 roundings of a power v^k and its argument, one of its product, one for each of the block's points.

    In double, sums of strips add less than a rounding in a million points; seven more are spare at most.
    """
    plan = SimpleNamespace(single=single)
    unit, block, rounding = interpreted(driver.precision)(plan, padded, orders)
    assert unit == (np.finfo(np.float32) if single else np.finfo(float)).epsneg
    assert block == (SINGLE_BLOCK if single else STRIP)
    needed = 3 * (orders - 1) + 2 + min(block, -(-padded // -(-padded // STRIP))) + padded / 2**20
    assert needed <= rounding / unit <= needed + 7


def test_totals_are_upper_bounds_by_as_many_roundings_as_a_strip_has_points():
    """A sum of |z| rounds once a point and twenty times in each; that of |z| v^2 four times more."""
    motion = pieces((100, 30, 170), symbols=1)
    total, second, _ = sums_of(motion)
    none, *_ = computed(motion, change=bare(cells={"sizes": (0.0, 0.0, 0.0)}))
    assert 160 < (none.totals / total - 1)[0] * 2.0**53 < 240
    more, _, approximation, _ = computed(motion, change=bare(cells={"sizes": (0.0, 0.0, 1e30)}))
    rounding = interpreted(driver.precision)(approximation.plan, 304, approximation.cells.kernels.shape[2])[2]
    assert 160 < (more.bounds / (1e30 * rounding * second) - 1)[0] * 2.0**53 < 240


def test_an_error_of_the_gains_counts_relative_to_the_peak_amplitudes():
    """Gains fitted to 1e-5: both errors and their product, bounded for each segment by `segment.fit_gains`."""
    total, _, peaks = sums_of(MOTION)
    found, sample, approximation, there = computed(
        MOTION, change=lambda given: bare()(given) | {"plan": bare()(given)["plan"]._replace(fit=1e-5)}
    )
    gains, work, segments = approximation.gains, workspace(approximation, there.lay.amplitude), np.empty((2, 6))
    count = cut_segments(sample.extents, gains.rates_h[0], gains.rates_v[0], refine.LONGEST, segments)
    fits = [
        interpreted(segment.fit_gains)(row, there.aims, gains, 1e-5, 2.0**-53, approximation.fold, work)[2]
        for row in segments[:count]
    ]
    assert count == 1 and 1e-7 < fits[0] < 2.1e-5
    np.testing.assert_allclose(found.totals, total + peaks * fits[0], rtol=1e-5)
    assert (abs(found.totals - total) <= 1.01 * peaks * fits[0]).all()
    np.testing.assert_allclose(found.bounds, peaks * fits[0], rtol=1e-6)
