"""Slow-time interpolation: its bound on complex ellipses, its weights, and the targets it is used for."""

from math import comb
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from lowalt.common.jit import LEAN
from lowalt.echo import Path, Rigid, echo_signal, method_text
from lowalt.echo.fast import driver
from lowalt.echo.radar import radar
from lowalt.echo.slow_time import interpolation as interpolate
from lowalt.echo.slow_time import node_count, pose_series
from test_echo import network, relative

SHARED = settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def turn(angle):
    """Matrices (N, 3, 3) about the vertical."""
    result = np.zeros((len(angle), 3, 3))
    result[:, 0, 0] = result[:, 1, 1] = np.cos(angle)
    result[:, 1, 0], result[:, 0, 1], result[:, 2, 2] = np.sin(angle), -np.sin(angle), 1.0
    return result


def flight(rng, symbols, points, away, size, speed=15.0, yaw=0.3, spin=0.0):
    """A body and a rotor of as many points each, on a straight path; rates in rad/s, the rotor `size` from the body."""
    times = 2.5e-3 * np.arange(symbols)
    heading = rng.normal(size=3)
    path = np.asarray(away) + times[:, None] * speed * heading / np.linalg.norm(heading)
    rotation = np.stack([turn(yaw * times), turn(spin * times)], axis=1)
    arm = np.einsum("nij,j->ni", rotation[:, 0], [0.0, 0.0, size])
    return Rigid(
        rotation, np.stack([path, path + arm], axis=1), rng.normal(scale=size / 2, size=(2 * points, 3)),
        np.repeat([0, 1], points),
    )  # fmt: skip


@SHARED
@given(
    seed=st.integers(0, 10_000), away=st.floats(40.0, 3000.0), size=st.floats(0.02, 3.0), speed=st.floats(0.0, 40.0),
    yaw=st.floats(0.0, 2.0), tolerance=st.sampled_from([1e-2, 1e-3, 1e-5, 1e-7, 1e-9]),
)  # fmt: skip
@example(seed=190, away=40.0, size=0.5, speed=21.0, yaw=2.0, tolerance=0.01)
def test_what_is_interpolated_keeps_its_bound(always_approximate, seed, away, size, speed, yaw, tolerance):
    net, rng = network(symbols=120), np.random.default_rng(seed)
    motion = flight(rng, 120, 40, (away, 0.3 * away, 40.0), size, speed, yaw, 400.0)
    arguments = (net, net.stations[0], motion, rng.exponential(size=80), motion.translation[0, 0])
    truth, result = echo_signal(*arguments, paths=[Path()]), echo_signal(*arguments, tolerance)
    assert relative(result.signal, truth.signal) <= min(result.bound, tolerance) + truth.bound
    assert (result.totals >= truth.totals * (1 - 1e-12)).all()
    if not result.method.slow[0]:
        assert (result.totals <= truth.totals * (1 + 1e-12) + tolerance * truth.totals.max()).all()
    assert (result.cell == truth.cell).all() or result.near_ties + truth.near_ties
    # Blades that turn by a radian a symbol are never interpolated; a body is, unless it is large.
    assert result.method.slow[0] in (0, 40) and (result.method.slow[0] == 40 or size > 0.3 or tolerance < 1e-6)


@settings(max_examples=60, deadline=None)
@given(
    seed=st.integers(0, 10_000), away=st.floats(15.0, 2000.0), size=st.floats(0.02, 4.0), speed=st.floats(0.0, 60.0),
    yaw=st.floats(0.0, 2.0), rho=st.floats(1.2, 8.0),
)  # fmt: skip
def test_the_bound_holds_on_the_whole_ellipse(seed, away, size, speed, yaw, rho):
    net, rng = network(symbols=200), np.random.default_rng(seed)
    seen, radio = net.stations[0], radar(net, net.stations[0])
    motion = flight(rng, 200, 1, (away, 0.2 * away, 30.0), size, speed, yaw)
    refs = np.zeros((200, 7))
    refs[:, :3] = motion.translation[:, 0] - np.array(seen.position_m)
    poses = pose_series.series(motion.rotation, motion.translation, refs, 0, np.array([0, 1]), pose_series.fit(200))
    points = rng.normal(size=(2, 20, 3)) * size / 3
    radii = np.linalg.norm(points, axis=2).max(axis=1)
    moves, sizes, _ = pose_series.series_sizes(*poses, np.arange(2), np.zeros((2, 3)), radii)
    phases, rates = radio.kappa / 4 * 36, np.pi * radio.kappa / 2 * 36
    whole, bare, most = node_count._growth(rho, moves, sizes, radio.turns, radio.cells, phases, rates)
    if not whole < np.inf:
        return
    angle = np.linspace(0, 2 * np.pi, 41)
    time = (rho * np.exp(1j * angle) + np.exp(-1j * angle) / rho) / 2
    values = np.stack([np.ones_like(time), time] + [np.cosh(k * np.arccosh(time)) for k in range(2, len(moves))], 1)
    place = values @ poses[0]
    offset = np.einsum("tk,kpi->tpi", values, poses[1])[:, :, None]
    offset = offset + np.einsum("tk,kpij,plj->tpli", values, poses[2], points)
    there = place[:, None, None] + offset
    reference_m, range_m = np.sqrt((place**2).sum(-1))[:, None, None], np.sqrt((there**2).sum(-1))
    excess = range_m - reference_m
    across = (radio.cosine * there[..., 1] - radio.sine * there[..., 0]) / range_m
    up = there[..., 2] / range_m

    def gain(cosine, count):
        orders = np.arange(2 * count - 1) - (count - 1)
        weight = np.convolve(np.ones(count), np.ones(count)) / count**2
        return (weight * np.exp(1j * np.pi * radio.kappa * cosine[..., None] * orders)).sum(-1)

    bared = (reference_m / range_m) ** 2 * gain(across, 16) * gain(up, 4)
    turned = radio.kappa / 4 * (30 * across + 6 * up) - radio.turns * excess
    level = np.log(abs(bared).max())
    assert level <= bare + 1e-9 and abs(excess).max() * radio.cells <= most * (1 + 1e-9)
    # In logarithms: on wide ellipses the factor itself is beyond all doubles.
    assert (np.log(abs(bared)) - 2 * np.pi * turned.imag).max() <= whole + 1e-9


def test_the_bound_is_not_too_loose():
    net = network()
    radio = radar(net, net.stations[0])
    motion = flight(np.random.default_rng(1), 400, 1, (150.0, 60.0, 60.0), 0.4)
    refs = np.zeros((400, 7))
    refs[:, :3] = motion.translation[:, 0] - np.array(net.stations[0].position_m)
    poses = pose_series.series(motion.rotation, motion.translation, refs, 0, np.array([0]), pose_series.fit(400))
    sizes = pose_series.series_sizes(*poses, np.array([0]), np.zeros((1, 3)), np.array([0.4]))
    # By radians: the tip turns through 0.4 x 0.15 m, the direction through 15 m in 160 m, over half the look.
    swing = 2 * np.pi * radio.turns * 0.4 * (0.15 + 0.5 * 15 / 160)
    assert 10 < swing < 20
    for target in (1e-3, 1e-9):
        degree, error, *_ = node_count.choose(
            *sizes[:2], radio.turns, 1.0, 0.01, radio.kappa * 9, np.pi * radio.kappa * 18, 8, (1.0, 0.1, 0.1), target,
            400, node_count.RHO,
        )  # fmt: skip
        assert error <= target and swing < degree < 3 * swing + 4 * np.log10(1 / target)


@pytest.mark.parametrize("degree", [4, 7, 30, 200, 480])
def test_weights_carry_polynomials_exactly_and_nothing_grows(degree):
    polynomial, linear, _ = pose_series.weights(500, degree)
    nodes = -np.cos(np.pi * np.arange(degree + 1) / degree)
    symbols = np.linspace(-1, 1, 500)
    for order in (0, 1, degree // 2, degree):
        taken = np.cos(order * np.arccos(np.clip(nodes, -1, 1)))
        assert abs(polynomial @ taken - np.cos(order * np.arccos(symbols))).max() < 1e-11
    assert abs(polynomial).sum(axis=1).max() <= interpolate.LEBESGUE
    assert (linear >= 0).all() and abs(linear @ nodes - symbols).max() < 1e-12
    assert abs(linear.sum(axis=1) - 1).max() < 1e-12


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_a_part_may_turn_by_a_given_phase_at_its_farthest_point(axis):
    """Part 1's centre is 3 m from the hinge along one axis, its points within 1 m of it; part 0 does not turn."""
    rotation, centres = np.tile(np.eye(3), (2, 2, 1, 1)), np.zeros((2, 3))
    centres[1, axis] = -3.0
    lay = SimpleNamespace(
        parts=np.array([0, 1]), starts=np.array([0, 5, 12]), centres=centres, radii=np.array([9.0, 1.0])
    )
    turns, steps = 33.0, 100
    limit = pose_series.SWING / (np.pi * turns * steps * (3.0 + 1.0))
    for entry in np.ndindex(3, 3):
        for share, kept in ((0.999, True), (1.001, False)):
            rotation[1, 1] = np.eye(3)
            rotation[(1, 1, *entry)] += share * limit
            found = pose_series.candidates.py_func(rotation, lay, steps, turns, 5)
            assert found.tolist() == [True, kept]
    rotation[1] = rotation[0]
    assert pose_series.candidates.py_func(rotation, lay, steps, turns, 6).tolist() == [False, True]


def test_what_a_series_leaves_of_poses_is_the_norm_of_its_axes_largest_residuals(monkeypatch):
    monkeypatch.setattr(pose_series, "_column", pose_series._column.py_func)
    rng, count, chosen = np.random.default_rng(3), 40, np.array([2, 0])
    project, back = fits = pose_series.fit(count)
    rotation, translation = 3 * rng.normal(size=(count, 3, 3, 3)), 3 * rng.normal(size=(count, 3, 3))
    refs = 3 * rng.normal(size=(count, 7))
    reference, offset, turned, left = pose_series.series.py_func(rotation, translation, refs, 1, chosen, fits)
    apart = translation[:, chosen] - translation[:, 1][:, None]
    rest = []
    for values, found in ((refs[:, :3], reference), (apart, offset), (rotation[:, chosen], turned)):
        truth = np.tensordot(project, values, axes=1)
        np.testing.assert_allclose(found, truth, atol=1e-12)
        rest.append(abs(values - np.tensordot(back.T, truth, axes=1)).max(axis=0))
    expected = [np.linalg.norm(rest[0]), *np.linalg.norm(rest[1], axis=1), *np.linalg.norm(rest[2], axis=(1, 2))]
    np.testing.assert_allclose(left, expected, rtol=1e-10)


def test_moments_move_with_the_place_they_are_about():
    rng = np.random.default_rng(4)
    z, v, away, turned = rng.normal(size=9) + 1j * rng.normal(size=9), rng.uniform(-1, 1, 9), -0.3, 0.2
    old = z @ v[:, None] ** np.arange(8)
    found = np.ones((2, 8))
    LEAN(driver.add_slow.py_func)(np.stack([old.real, old.imag]), turned, away, 3.0, found)
    truth = 3 * np.exp(-2j * np.pi * turned) * z @ (v[:, None] + away) ** np.arange(8)
    assert abs(found[0] + 1j * found[1] - (1 + 1j) - truth).max() < 1e-13
    assert abs(truth[2] - 3 * np.exp(-2j * np.pi * turned) * sum(
        comb(2, i) * away ** (2 - i) * old[i] for i in range(3))) < 1e-13  # fmt: skip


def test_long_looks_are_cut_into_blocks(always_approximate):
    net, rng = network(symbols=1200), np.random.default_rng(2)
    motion = flight(rng, 1200, 50, (300.0, 50.0, 60.0), 0.3, spin=500.0)
    arguments = (net, net.stations[0], motion, 1.0, motion.translation[0, 0])
    truth, result = echo_signal(*arguments), echo_signal(*arguments, 1e-6)
    points, nodes = result.method.slow
    assert truth.method.slow == (0, 0) and points == 50 and 3 * 5 <= nodes < 300 and result.method.cheap == 1200
    assert relative(result.signal, truth.signal) <= result.bound <= 1e-6
    assert f"slow time: 50, from {nodes} nodes" in method_text(result)


def test_a_body_that_trembles_is_not_interpolated(always_approximate):
    net, rng = network(symbols=200), np.random.default_rng(3)
    motion = flight(rng, 200, 60, (200.0, 50.0, 60.0), 0.3)
    shaken = motion._replace(rotation=motion.rotation @ turn(1e-7 * rng.normal(size=200))[:, None])
    arguments = (net, net.stations[0], shaken, 1.0, motion.translation[0, 0])
    truth, result = echo_signal(*arguments), echo_signal(*arguments, 1e-6)
    assert result.method.slow == (0, 0) and relative(result.signal, truth.signal) <= result.bound <= 1e-6
    still = echo_signal(net, net.stations[0], motion, 1.0, motion.translation[0, 0], 1e-6)
    assert still.method.slow[0] == 120
    # A tenth of a micrometre is far below a tolerance of 1e-2.
    assert echo_signal(*arguments, 1e-2).method.slow[0] == 120


def test_small_targets_are_computed_exactly_and_large_ones_are_not():
    net, rng = network(), np.random.default_rng(5)
    for points, tried in ((15, False), (600, True)):
        motion = flight(rng, 400, points, (200.0, 50.0, 60.0), 0.3, spin=500.0)
        result = echo_signal(net, net.stations[0], motion, 1.0, motion.translation[0, 0], 1e-6)
        assert (result.method.cheap > 0) == tried and (result.method.slow[0] > 0) == tried
