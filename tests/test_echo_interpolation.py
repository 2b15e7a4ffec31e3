"""Slow points carried from nodes to symbols: against sums written out."""

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from driven_echo import amplitudes, weights
from lowalt.echo import Rigid, refine
from lowalt.echo.fast.range_bounds import SIZE, SPREAD
from lowalt.echo.fast.strip import MULTIPLE
from lowalt.echo.fast.workspace import SlowMoments
from lowalt.echo.pointwise.reference_range import CELL, RANGE, REST, TURN
from lowalt.echo.slow_time import interpolation, node_count, pose_series
from small_echo import NETWORK, TAU, places, prepared
from test_echo_slow import turn

COUNT = 40


def arm(time):
    """Where the third part stands from the first at times from -1 to 1 (m)."""
    return np.outer(time, [0.01, 0.0, 0.02]) + np.array([0.2, -0.3, 0.1])


def flight() -> Rigid:
    """Two slow parts and a fast one between them, their points mixed; places and angles are polynomials of time."""
    rng, time = np.random.default_rng(3), np.linspace(-1, 1, COUNT)
    path = np.array([60.0, 80.0, 30.0]) + np.outer(time, [0.3, -0.2, 0.1]) + np.outer(time**2, [0.02, 0.03, 0.0])
    rotation = np.stack([turn(0.01 * time), turn(900.0 * time), turn(0.02 * time)], axis=1)
    apart = np.stack([0 * path, 0 * path + np.array([0.1, 0.2, 0.3]), arm(time)], axis=1)
    return Rigid(
        rotation,
        path[:, None] + apart,
        rng.normal(0, 0.2, (120, 3)),
        np.r_[0, rng.permutation(np.repeat([0, 1, 2], [39, 40, 40])), 2][:120],
    )


MOTION = flight()
WEIGHTS = weights(120)


@pytest.fixture
def cheap(monkeypatch):
    """Let interpolation be tried however few points there are."""
    monkeypatch.setattr(pose_series, "INTERPOLATION_COST", 1)


def slow_scene():
    """The prepared scene, the sample of `refine`, and its slow parts."""
    there = prepared(MOTION, WEIGHTS)
    sample = refine._Sample(there.scene, there.radio, there.refs, there.aims)
    return there, sample, interpolation.slow_parts(there.scene, there.radio, there.lay)


def test_slow_parts_are_named_with_their_points_and_groups(cheap):
    there, _, slow = slow_scene()
    assert slow.parts.tolist() == [0, 2] and (slow.mask == (MOTION.part != 1)).all()
    groups = [group for group, part in enumerate(there.lay.parts) if part != 1]
    assert slow.rows.tolist() == [int(there.lay.parts[group] == 2) for group in groups]
    np.testing.assert_array_equal(slow.centres, there.lay.centres[groups])
    np.testing.assert_array_equal(slow.radii, there.lay.radii[groups])


@pytest.mark.parametrize(("cost", "worth"), [(80 * COUNT, True), (80 * COUNT + 1, False), (120 * COUNT + 1, False)])
def test_interpolation_must_save_points_and_symbols(monkeypatch, cost, worth):
    """Slow points times symbols are compared with its cost, symbols of a block at most."""
    there, *_ = slow_scene()
    monkeypatch.setattr(pose_series, "INTERPOLATION_COST", cost)
    assert (interpolation.slow_parts(there.scene, there.radio, there.lay) is not None) == worth
    monkeypatch.setattr(pose_series, "BLOCK", COUNT - 1)
    assert (interpolation.slow_parts(there.scene, there.radio, there.lay) is not None) == (cost <= 80 * (COUNT - 1))


def test_a_part_with_fewer_points_than_two_vectors_and_points_without_parts_are_not_interpolated(cheap):
    asked = []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pose_series, "candidates", lambda *given: asked.append(given[2:]) or np.array([False] * 3))
        there, _, slow = slow_scene()
    assert slow is None and asked == [(COUNT, there.radio.turns, 2 * MULTIPLE)]
    alone = prepared(places(MOTION).astype(float)[:, :5])
    assert interpolation.slow_parts(alone.scene, alone.radio, alone.lay) is None


def test_a_subset_of_points_keeps_what_belongs_to_each():
    there, mask = prepared(MOTION, WEIGHTS), MOTION.part == 1
    some = interpolation.subset(there.scene, mask)
    np.testing.assert_array_equal(some.points, MOTION.points[mask])
    np.testing.assert_array_equal(some.rcs_m2, WEIGHTS[mask])
    np.testing.assert_array_equal(some.root_rcs, np.sqrt(WEIGHTS[mask]))
    assert (some.part == 1).all() and some.rotation is there.scene.rotation


def carried(allowed=1e-9, size=None, **changes):
    """What `interpolated` returns, the scene, the table of cells, and the truth about the slow points."""
    there, sample, slow = slow_scene()
    exact = sample.approximation(sample.plan(0.0))
    with pytest.MonkeyPatch.context() as patch:
        for name, value in changes.items():
            module = node_count if name == "nodes" else interpolation.driver if name == "moments_at" else pose_series
            patch.setattr(module, name, value)
        found = interpolation.interpolated(
            there.scene, there.radio, there.refs, there.aims, slow, exact, size or (sample.spread, sample.size_m),
            allowed, there.peak,
        )  # fmt: skip
    z, cells = amplitudes(there, MOTION)
    square = there.refs[:, RANGE] ** 2
    plain = (z * np.exp(1j * TAU * there.refs[:, [TURN]]) * square[:, None])[:, slow.mask]
    v = ((cells - there.refs[:, [CELL]] - there.refs[:, [REST]]) / exact.cells.half)[:, slow.mask]
    return found, there, exact, sample, (plain, v)


@pytest.mark.parametrize("allowed", [1e-4, 1e-9])
def test_moments_between_nodes_are_those_of_all_slow_points_within_their_error(cheap, allowed):
    """Kernel k weights moment k; the promised error covers any weights no larger than the table's."""
    (slow, count), there, exact, _, (plain, v) = carried(allowed)
    total = there.peak * np.sqrt(WEIGHTS[MOTION.part != 1]).sum()
    assert 5 <= count < COUNT and (slow.errors < 20 * allowed * total).all()
    kernels, orders = exact.cells.kernels.reshape(-1, exact.cells.kernels.shape[2]), slow.moments.shape[2]
    wanted = np.stack([(plain * v**k).sum(1) for k in range(orders)], axis=1)
    away = abs(((slow.moments[:, 0] + 1j * slow.moments[:, 1]) - wanted) @ kernels.T)
    assert (away <= slow.errors[:, None]).all()
    truth = np.stack([abs(plain).sum(1), (abs(plain) * v**2).sum(1)], axis=1)
    assert (slow.sums >= truth * (1 - 1e-12)).all() and slow.sums[:, 0] == pytest.approx(
        truth[:, 0].astype(float), rel=0.5
    )


def told(**fields) -> node_count.Nodes:
    """Nodes of degree 6 without any error but those given."""
    return node_count.Nodes(
        **({"degree": 6, "error": 0.0, "phase": 0.0, "gain": 0.0, "flat": 0.0, "bent": 0.0} | fields)
    )


def test_each_kind_of_error_adds_its_own_part_to_that_of_carried_moments(cheap):
    """Interpolation, poses' phase and gain, and the nodes' own errors, carried on six times as large at most."""
    total = prepared(MOTION, WEIGHTS).peak * np.sqrt(WEIGHTS[MOTION.part != 1]).sum()
    (none, count), *_ = carried(nodes=lambda *_: told())
    assert count == 7 and (none.errors < 1e-9 * total).all()
    (some, _), *_ = carried(nodes=lambda *_: told(error=0.25))
    np.testing.assert_allclose(some.errors - none.errors, 0.25 * total, rtol=1e-9)
    (some, _), *_, sample, _ = carried(nodes=lambda *_: told(gain=0.25))
    np.testing.assert_allclose(some.errors - none.errors, 0.25 * total / (1 - sample.spread) ** 2, rtol=2e-2)
    assert (some.errors - none.errors > 0.25 * total * (1 + 1.5 * sample.spread * 0.3)).all()
    (some, _), *_ = carried(nodes=lambda *_: told(phase=0.25))
    np.testing.assert_allclose(some.errors - none.errors, 0.25 * none.sums[:, 0], rtol=1e-9)
    (some, _), *_ = carried(nodes=lambda *_: told(flat=0.5, bent=0.125))
    np.testing.assert_allclose(some.sums - none.sums, np.tile([0.5 * total, 0.125 * total], (COUNT, 1)), rtol=1e-9)


def filled(errors, sums=0.0):
    """A stand-in for the kernel that fills moments with polynomials of the nodes' places in time."""

    def fill(*given):
        symbols, out = given[4], given[-1]
        time = -np.cos(np.pi * np.arange(len(symbols.index)) / (len(symbols.index) - 1))
        out.moments[:] = time[:, None, None] ** 3 + np.arange(out.moments[0].size).reshape(out.moments[0].shape)
        out.sums[:, 0], out.sums[:, 1] = abs(time) + sums, 2 * time**2
        out.errors[:] = errors * (1 + time)
        return True

    return fill


def test_moments_are_carried_by_polynomials_and_sums_along_lines(cheap):
    (slow, _), _, exact, _, _ = carried(nodes=lambda *_: told(), moments_at=filled(0.5))
    time = np.linspace(-1, 1, COUNT)
    wanted = time[:, None, None] ** 3 + np.arange(slow.moments[0].size).reshape(slow.moments[0].shape)
    np.testing.assert_allclose(slow.moments, wanted, atol=1e-12)
    at = -np.cos(np.pi * np.arange(7) / 6)
    np.testing.assert_allclose(
        slow.sums, np.stack([np.interp(time, at, abs(at)), np.interp(time, at, 2 * at**2)], 1), atol=1e-13
    )
    # The largest error at any node, times the bound of the interpolation's norm.
    np.testing.assert_allclose(slow.errors, interpolation.LEBESGUE * 0.5 * 2, rtol=1e-9)
    assert 1 + 2 / np.pi * np.log(2500) <= interpolation.LEBESGUE
    (more, _), *_ = carried(nodes=lambda *_: told(), moments_at=filled(0.0, 1e9))
    # Roundings of a sum over nodes, of three for each order that is shifted, and eight more at most.
    often = more.errors / (2.0**-53 * 6 * sum(exact.cells.sizes) * (1e9 + 1))
    assert (often >= 7 + 3 * exact.cells.kernels.shape[2]).all() and (
        often <= 7 + 3 * exact.cells.kernels.shape[2] + 8.01
    ).all()


def test_nodes_are_asked_for_with_what_the_block_allows(cheap):
    """At most as many as save the cost of fitting; the reference's own residual; the error for both kinds."""
    asked = []
    found, there, exact, _, _ = carried(3e-7, nodes=lambda *given: asked.append(given))
    assert found is None
    radar, sizes, stray, table, target, room, top = asked[0]
    assert radar is there.radio and table is exact.cells and (target, room, top) == (3e-7, 3e-7, COUNT - 1)
    assert len(sizes) == 3 and stray < 1e-9 and sizes[0][0] == pytest.approx(there.refs[:, RANGE].mean(), rel=1e-2)
    asked.clear()
    for cost, top in ((80 * 36, 4), (80 * 36 + 1, None), (80 * 3 + 1, 36)):
        carried(nodes=lambda *given: asked.append(given), INTERPOLATION_COST=cost)
        assert (asked.pop()[-1] if asked else None) == top


def test_a_target_nearer_between_symbols_than_the_plan_allows_is_not_carried(cheap):
    """The plan is made for the largest radius over range and radius of the symbols, and 0.4 % more."""
    noted, there_of = [], interpolation._at_nodes
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(interpolation, "_at_nodes", lambda *given: noted.append(there_of(*given)) or noted[-1])
        assert carried()[0] is not None
    spread, size_m = noted[0][3][:, SPREAD].max(), noted[0][3][:, SIZE].max()
    for share, kept in ((1.0039, True), (1.0041, False)):
        assert (carried(size=(spread / share, size_m))[0] is not None) == kept
        assert (carried(size=(spread, size_m / share))[0] is not None) == kept
    assert carried(moments_at=lambda *_: False)[0] is None


def test_the_slow_points_stand_at_the_nodes_where_their_series_say(cheap):
    there, _, slow = slow_scene()
    fits = pose_series.fit(COUNT)
    poses = pose_series.series(there.scene.rotation, there.scene.translation, there.refs, 0, slow.parts, fits)
    at = np.array([-1.0, -0.3, 0.2, 1.0])
    values = chebyshev.chebvander(at, len(poses[0]) - 1)
    scene, lay, refs, extents = interpolation._at_nodes(there.scene, there.radio, slow, poses, values, there.peak)
    path = np.array([60.0, 80.0, 30.0]) + np.outer(at, [0.3, -0.2, 0.1]) + np.outer(at**2, [0.02, 0.03, 0.0])
    np.testing.assert_allclose(refs[:, :3], path - [4.0, -7.0, 25.0], atol=1e-9)
    np.testing.assert_allclose(refs[:, RANGE], np.linalg.norm(path - [4.0, -7.0, 25.0], axis=1), rtol=1e-12)
    assert not refs[:, RANGE + 1 :].any() and not scene.translation[:, 0].any() and not scene.rotation[:, 0].any()
    np.testing.assert_allclose(scene.rotation[:, 1:], np.stack([turn(0.01 * at), turn(0.02 * at)], 1), atol=1e-9)
    np.testing.assert_allclose(scene.translation[:, 2], arm(at), atol=1e-9)
    assert (scene.part == np.where(MOTION.part[slow.mask] == 0, 1, 2)).all()
    assert lay.total == pytest.approx(there.peak * np.sqrt(WEIGHTS[slow.mask]).sum()) and extents.shape == (4, 5)
    away = np.linalg.norm(places(scene), axis=2).max(1).astype(float)
    assert (extents[:, 3] >= away * (1 - 1e-12)).all() and (extents[:, 3] < 2 * away).all()


def test_no_points_at_all_have_no_rows():
    assert [array.shape[0] for array in interpolation.NO_SLOW_POINTS] == [0, 0, 0]
    assert isinstance(interpolation.NO_SLOW_POINTS, SlowMoments) and NETWORK.symbols == 3
