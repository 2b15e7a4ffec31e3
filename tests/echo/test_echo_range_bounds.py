"""The extents that the echo's bounds use, against the distances of all points, one by one."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lowalt.echo.fast.range_bounds import END, MEAN, OMEGA, PSI, SIZE, SPREAD, START, cut_segments, fill_extents
from lowalt.echo.pointwise.reference_range import RANGE, X, Y, Z

SYMBOLS, PARTS, GROUPS, POINTS = 6, 3, 5, 40


def extents(spread_m):
    """Random groups of points in turned and stretched parts: the table of extents, and every point's distance (m)."""
    draws = np.random.default_rng(11)
    rotation = Rotation.random(SYMBOLS * PARTS, random_state=3).as_matrix().reshape(SYMBOLS, PARTS, 3, 3)
    rotation = rotation * draws.uniform(0.5, 2.0, (1, PARTS, 1, 3))
    translation = draws.normal(0, 5, (SYMBOLS, PARTS, 3))
    parts, centres = np.array([0, 0, 1, 2, 2]), draws.normal(0, 2, (GROUPS, 3))
    points = centres[:, None] + spread_m * draws.normal(0, 1, (GROUPS, POINTS, 3))
    stray = np.linalg.norm(points - centres[:, None], axis=-1)
    weights = draws.dirichlet(np.ones(GROUPS))
    lay = SimpleNamespace(
        parts=parts, centres=centres, radii=stray.max(1), weights=weights, strays=weights * stray.mean(1)
    )
    refs = np.zeros((SYMBOLS, 1 + max(RANGE, X, Y, Z)))
    refs[:, [X, Y, Z]] = draws.normal((300, 0, 0), 50, (SYMBOLS, 3))
    refs[:, RANGE] = np.linalg.norm(refs[:, [X, Y, Z]], axis=1)
    out = np.empty((SYMBOLS, 5))
    scene, radar = SimpleNamespace(rotation=rotation, translation=translation), SimpleNamespace(sine=0.6, cosine=0.8)
    worst = fill_extents.py_func(scene, 1, lay, refs, radar, out)
    moved = np.einsum("ngij,gkj->ngki", rotation[:, parts], points) + translation[:, parts][:, :, None]
    away = np.linalg.norm(moved - translation[:, 1][:, None, None], axis=-1)
    return out, worst, away, weights, refs


def test_extents_of_single_points_are_their_distances():
    out, worst, away, weights, refs = extents(spread_m=0.0)
    np.testing.assert_allclose(out[:, SIZE], away.max((1, 2)), rtol=1e-11)
    np.testing.assert_allclose(out[:, MEAN], (weights * away.mean(2)).sum(1), rtol=1e-11)
    np.testing.assert_allclose(out[:, SPREAD], away.max((1, 2)) / refs[:, RANGE], rtol=1e-11)
    np.testing.assert_allclose(out[:, PSI], (0.8 * refs[:, Y] - 0.6 * refs[:, X]) / refs[:, RANGE], rtol=1e-12)
    np.testing.assert_allclose(out[:, OMEGA], refs[:, Z] / refs[:, RANGE], rtol=1e-12)
    assert worst == out[:, SPREAD].max()


@pytest.mark.parametrize("spread_m", [0.01, 1.0])
def test_no_point_lies_beyond_the_extents(spread_m):
    out, _, away, weights, _ = extents(spread_m)
    assert (away.max((1, 2)) <= out[:, SIZE]).all() and ((weights * away.mean(2)).sum(1) <= out[:, MEAN]).all()
    # A bound that is never near the truth would serve as little: each point adds at most twice its stretched stray.
    assert (out[:, SIZE] <= away.max((1, 2)) + 2 * 2.0 * np.sqrt(3) * 5 * spread_m).all()


@pytest.mark.parametrize(("column", "centre", "half"), [(PSI, 2, 3), (OMEGA, 4, 5)])
def test_a_segment_is_a_fifth_and_a_radian_of_gain_phase_wider_than_the_target(column, centre, half):
    """A target 0.1 wide drifts by 0.01 a symbol in one direction cosine; the other's rate is too small to matter."""
    symbols, drift, rate = 40, 0.01, 40.0
    # Points at most `turn` from the reference's direction: 2 d / (2 - d) of a spread d.
    turn = 0.05
    extents = np.zeros((symbols, 5))
    extents[:, SPREAD] = 2 * turn / (2 + turn)
    extents[:, column] = drift * np.arange(symbols)
    rates = (rate, 1e-3) if column == PSI else (1e-3, rate)
    out = np.zeros((symbols, 6))
    count = cut_segments.py_func(extents, *rates, 100, out)
    # (0.1 + 0.01 k) 40 <= 1.2 x 0.1 x 40 + 1 holds up to k = 4, so five symbols make a segment.
    assert count == 8 and out[:count, START].tolist() == list(range(0, 40, 5))
    assert out[:count, END].tolist() == list(range(5, 41, 5))
    np.testing.assert_allclose(out[:count, centre], drift * (out[:count, START] + 2), atol=1e-12)
    np.testing.assert_allclose(out[:count, half], turn + 2 * drift, atol=2e-9)
    assert (out[:count, half] >= turn + 2 * drift).all()
    # As wide as they like, segments end where they are longest.
    assert cut_segments.py_func(extents, 1e-3, 1e-3, 16, out) == 3 and out[:3, END].tolist() == [16, 32, 40]


@pytest.mark.parametrize("symbols", [1, 4])
def test_points_without_parts_are_as_far_as_they_stand(symbols):
    draws = np.random.default_rng(2)
    translation, weights = draws.normal(0, 5, (symbols, 7, 3)), draws.dirichlet(np.ones(7))
    refs = np.full((symbols, 1 + max(RANGE, X, Y, Z)), 100.0)
    lay = SimpleNamespace(parts=None, centres=None, radii=None, weights=weights, strays=None)
    scene = SimpleNamespace(rotation=np.empty((0, 0, 3, 3)), translation=translation)
    out, radar = np.empty((symbols, 5)), SimpleNamespace(sine=0.6, cosine=0.8)
    fill_extents.py_func(scene, 3, lay, refs, radar, out)
    away = np.linalg.norm(translation - translation[:, 3][:, None], axis=2)
    np.testing.assert_allclose(out[:, SIZE], away.max(1), rtol=1e-11)
    np.testing.assert_allclose(out[:, MEAN], away @ weights, rtol=1e-11)


@pytest.mark.parametrize("seed", range(6))
def test_segments_are_as_long_as_the_width_of_their_first_symbol_allows(seed):
    """A segment takes symbols while the union of their intervals, times the rate, is within the first one's room."""
    draws = np.random.default_rng(seed)
    extents = np.zeros((60, 5))
    extents[:, SPREAD] = draws.uniform(0.0, 0.1, 60)
    extents[draws.integers(0, 60, 2), SPREAD] = (1.0, 1.7)
    for column in (PSI, OMEGA):
        extents[:, column] = np.cumsum(draws.normal(0, 0.01, 60))
    rates, longest, out = draws.uniform(10, 60, 2), int(draws.integers(4, 20)), np.full((60, 6), np.nan)
    count = cut_segments.py_func(extents, *rates, longest, out)
    # Seen from the reference, a point s ranges away from it stands within 2 s / (2 - s) of its direction cosine.
    reach = np.where(extents[:, SPREAD] < 1, 2 * extents[:, SPREAD] / (2 - extents[:, SPREAD]), 2.0)
    low, high = extents[:, [PSI, OMEGA]] - reach[:, None], extents[:, [PSI, OMEGA]] + reach[:, None]
    assert np.isnan(out[count:]).all() and out[0, START] == 0 and out[count - 1, END] == 60
    assert (out[1:count, START] == out[: count - 1, END]).all()
    for start, end, *rest in out[:count]:
        start, end = int(start), int(end)
        room = 1.2 * (high[start] - low[start]) * rates + 1.0

        def wide(last, start=start):
            """Gain phase over the intervals of symbols from the first one of the segment up to `last`."""
            return (high[start:last].max(0) - low[start:last].min(0)) * rates

        assert 0 < end - start <= longest and (wide(end) <= room).all()
        assert end == 60 or end - start == longest or (wide(end + 1) > room).any()
        centre, half = (high[start:end].max(0) + low[start:end].min(0)) / 2, wide(end) / rates / 2
        np.testing.assert_allclose(rest[0::2], centre, atol=1e-14)
        np.testing.assert_allclose(rest[1::2], half * (1 + 1e-9) + 1e-9, rtol=1e-13)


def test_a_target_at_the_station_is_as_wide_as_any_and_extents_are_rounded_up():
    """No direction is known there; sizes are a trillionth larger than computed, whatever was rounded in them."""
    translation = np.zeros((2, 2, 3))
    translation[:, 1] = (3.0, 0.0, 4.0)
    lay = SimpleNamespace(parts=None, centres=None, radii=None, weights=np.array([0.5, 0.5]), strays=None)
    scene = SimpleNamespace(rotation=np.empty((0, 0, 3, 3)), translation=translation)
    refs = np.zeros((2, 7))
    refs[1, [X, Y, Z]], refs[1, RANGE] = (60.0, 80.0, 75.0), 125.0
    out = np.full((2, 5), np.nan)
    worst = fill_extents.py_func(scene, 0, lay, refs, SimpleNamespace(sine=0.6, cosine=0.8), out)
    assert worst == np.inf and out[0, :3].tolist() == [0.0, 0.0, np.inf]
    assert out[1, :2].tolist() == pytest.approx([(0.8 * 80 - 0.6 * 60) / 125, 0.6], rel=1e-15)
    assert (out[:, SIZE] / 5 - 1).tolist() == pytest.approx([1e-12] * 2, rel=1e-3)
    assert (out[:, MEAN] / 2.5 - 1).tolist() == pytest.approx([1e-12] * 2, rel=1e-3)
    assert out[1, SPREAD] == pytest.approx(5 / 125, rel=1e-11)
