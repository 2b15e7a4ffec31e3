"""The extents that the echo's bounds use, against the distances of all points, one by one."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from lowalt.echo.fast.range_bounds import MEAN, OMEGA, PSI, SIZE, SPREAD, fill_extents
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
