"""The layout of points in memory, against sorts and sums written out."""

from types import SimpleNamespace

import numpy as np
import pytest

from interpreted import interpreted
from lowalt.echo.fast import layout
from lowalt.echo.fast.strip import MULTIPLE, strip_size


@pytest.mark.parametrize("sizes", [(5,), (16, 1), (200, 30, 90)])
@pytest.mark.parametrize("mixed", [False, True])
def test_points_lie_by_part_and_coordinate_in_groups_within_strips(monkeypatch, sizes, mixed):
    """Groups of successive points of one part that begin anew at each strip: boxes, radii and shares."""
    monkeypatch.setattr(layout, "_group", interpreted(layout._group))
    rng, count = np.random.default_rng(1), sum(sizes)
    part = np.repeat(np.arange(len(sizes)), sizes)
    part = rng.permutation(part) if mixed else part
    scene = SimpleNamespace(
        rotation=np.zeros((1, len(sizes), 3, 3)), translation=np.zeros((1, len(sizes), 3)), part=part,
        points=rng.normal(size=(count, 3)), root_rcs=rng.uniform(1, 2, count), rcs_m2=rng.uniform(1, 4, count),
    )  # fmt: skip
    lay = layout.layout(scene, 3.0)
    order = sorted(range(count), key=lambda point: (part[point], point))
    padded = -(-count // MULTIPLE) * MULTIPLE
    for array, wanted in ((lay.amplitude, 3.0 * scene.root_rcs), (lay.root, scene.root_rcs), (lay.rcs, scene.rcs_m2)):
        assert array.tolist() == [*wanted[order].tolist(), *[0.0] * (padded - count)]
    for axis, array in enumerate((lay.x, lay.y, lay.z)):
        assert array.tolist() == [*scene.points[order, axis].tolist(), *[0.0] * MULTIPLE]
    strip = strip_size.py_func(padded)
    starts = [i for i in range(count) if i % strip == 0 or part[order[i]] != part[order[i - 1]]]
    assert lay.starts.tolist() == [*starts, count] and lay.parts.tolist() == [part[order[i]] for i in starts]
    assert lay.total == pytest.approx(3.0 * scene.root_rcs.sum(), rel=1e-14)
    for group, (low, high) in enumerate(zip(lay.starts, lay.starts[1:], strict=False)):
        some, share = scene.points[order[low:high]], scene.root_rcs[order[low:high]] / scene.root_rcs.sum()
        centre = (some.min(0) + some.max(0)) / 2
        away = np.linalg.norm(some - centre, axis=1)
        np.testing.assert_allclose(lay.centres[group], centre, rtol=1e-15)
        found = lay.radii[group], lay.weights[group], lay.strays[group]
        assert found == pytest.approx((away.max(), share.sum(), share @ away), rel=1e-13, abs=1e-15)
    assert len(lay.centres) == len(lay.radii) == len(lay.weights) == len(lay.strays) == len(starts)


def test_points_without_parts_lie_as_they_come():
    """No point counts: then amplitudes have no share, and there is still one vector of room."""
    scene = SimpleNamespace(
        rotation=np.zeros((0, 0, 3, 3)), translation=np.zeros((2, 3, 3)), part=np.zeros(0, int),
        points=np.zeros((0, 3)), root_rcs=np.array([1.0, 2.0, 5.0]), rcs_m2=np.array([1.0, 4.0, 25.0]),
    )  # fmt: skip
    lay = layout.layout(scene, 2.0)
    assert lay.amplitude.tolist() == [2.0, 4.0, 10.0, *[0.0] * 13] and lay.weights.tolist() == [1 / 8, 2 / 8, 5 / 8]
    assert lay.total == 16.0 and len(lay.parts) == len(lay.starts) == len(lay.x) == len(lay.radii) == 0
    assert lay.root[:3].tolist() == [1.0, 2.0, 5.0] and lay.rcs[:4].tolist() == [1.0, 4.0, 25.0, 0.0]
    dark = layout.layout(SimpleNamespace(**vars(scene) | {"root_rcs": np.zeros(3), "rcs_m2": np.zeros(3)}), 2.0)
    assert dark.total == 0.0 and dark.weights.tolist() == [0.0, 0.0, 0.0]
