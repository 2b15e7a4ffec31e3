"""A symbol's response as a series in time: its orders, those left out, and the loop from moments to subcarriers."""

import numpy as np
import pytest

from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.effects import (
    arrivals,
    interpolation,
    moment_loops,
    response,
    spread_loops,
    time_series,
    time_series_loops,
    waveform,
)
from lowalt.effects import response_tables as tables
from lowalt.effects.catalogue import called
from lowalt.effects.chain import Chain
from lowalt.effects.channel import symbol_motion
from lowalt.effects.received import Scene, observe
from test_effects_bounds import network, target


@pytest.mark.parametrize(("count", "reach"), [(1, 0.7), (2, 0.7), (63, 0.7), (64, 0.2), (64, 3.0)])
def test_moments_become_subcarriers_as_in_the_plain_sum(count, reach):
    rng = np.random.default_rng(count)
    table = tables.table(reach, count, 1e-14)
    planes, own = rng.normal(size=(3, 2, len(table))), np.exp(1j * rng.normal(size=3))
    whole, cells = np.array([0, 7, 1000]), rng.normal(size=3)
    found = np.full((3, count), 1.0 + 0j)
    half = (count + 1) // 2
    work = np.empty((4, half)), np.empty((2, half)), np.empty((2, count))
    none = np.empty((0, count), complex)
    spread_loops.spread(planes, table, own, whole, cells, *work, False, none, found)
    off = np.arange(count) - 0.5 * (count - 1)
    delay = np.exp(-2j * np.pi * (whole + cells)[:, None] * off / count)
    truth = own[:, None] * ((planes[:, 0] + 1j * planes[:, 1]) @ table) * delay
    assert abs(found - 1.0 - truth).max() < 1e-11
    # A result that holds nothing yet is filled, with zeros where all moments are zero.
    planes[1], empty = 0.0, np.full((3, count), np.nan + 0j)
    spread_loops.spread(planes, table, own, whole, cells, *work, True, none, empty)
    assert abs(empty[::2] - truth[::2]).max() < 1e-11 and (empty[1] == 0.0).all()
    # With data, the result is the tones of symbols that carry them.
    data, tones = np.exp(2j * np.pi * rng.random((3, count))), np.full((3, count), np.nan + 0j)
    spread_loops.spread(planes, table, own, whole, cells, *work, True, data, tones)
    assert abs(tones - waveform.tones_of(empty, data)).max() < 1e-11


@pytest.mark.parametrize("paths", [0, 1])
def test_tones_are_those_of_the_subcarriers_over_one_path_and_over_several(paths):
    rng, radio = np.random.default_rng(12), network(subcarriers=33)
    places = np.array([100.0, 60.0, 40.0]) + rng.uniform(-1.0, 1.0, (radio.symbols, 5, 3))
    images = [response.ImagePath(places * [1.0, 1.0, -1.0], 0.5 - 0.2j)] * paths
    rays = response.OneWayFactors(
        radio, radio.stations[0], places, places[0, 0], images, squint=False, wavefront=False, error=1e-12
    )  # fmt: skip
    found = rays.moments(rays.paired(rng.uniform(1.0, 2.0, 5)))
    data = np.exp(2j * np.pi * rng.random((radio.symbols, 33)))
    truth = waveform.tones_of(rays.spectrum(found), data)
    np.testing.assert_allclose(rays.tones(found, data), truth, rtol=0, atol=1e-13 * abs(truth).max())


def test_orders_are_those_of_the_polynomial_through_the_instants():
    rng = np.random.default_rng(2)
    terms, at = rng.normal(size=(4, 5, 2, 3)), np.linspace(-1.0, 1.0, 7)
    nodes = np.cos(np.pi * (np.arange(4) + 0.5) / 4)
    values = np.tensordot(interpolation.polynomials(4, nodes).T, terms, 1)
    found = time_series.orders([[[value]] for value in values])
    assert np.stack([order[0][0] for order in found]) == pytest.approx(terms)
    assert interpolation.polynomials(4, at)[3] == pytest.approx(4 * at**3 - 3 * at)


def moving(tolerance: float | None, prefix: bool):
    """The chain of a rotor that turns by a quarter of a radian in a symbol, and what is asked of it."""
    radio = network(subcarrier_spacing_hz=15e3, subcarriers=64)
    cloud, row = target([[0.1, 0, 0], [-0.1, 0.02, 0], [0, 0.1, 0.05]], rotor=True, x_m=120.0, rate_hz=600.0)
    names = ("symbol_motion", "cyclic_prefix") if prefix else ("symbol_motion",)
    settings = {"symbol_motion": {}, "cyclic_prefix": {"prefix_s": 3e-7}}
    scene = Scene(radio, 3, tolerance, tuple(called({name: settings[name] for name in names})))
    view = observe(scene, radio.stations[0], cloud, row)
    return Chain(list(scene.effects), view, lambda name: scene.stream(name, row, "A"), 1.0), frozenset(names)


@pytest.mark.parametrize("prefix", [False, True])
@pytest.mark.parametrize("error", [1e-3, 1e-6, 1e-9])
def test_orders_left_out_change_no_cell_by_more_than_is_allowed(error, prefix, monkeypatch):
    chain, on = moving(None, prefix)
    truth, kept, all_of_them = chain.cells(on), [], time_series.kept
    monkeypatch.setattr(time_series, "kept", lambda *given: (kept.append(all_of_them(*given)), kept[-1])[1])
    chain.error = error
    change = abs(chain.cells(on) - truth).max() / chain.peaks.sum(axis=1).max()
    assert change <= error and kept[0] < symbol_motion.count(chain.view, 1e-13)
    # The order after the last one matters.
    monkeypatch.setattr(time_series, "kept", lambda *given: kept[0] - 1)
    assert abs(chain.cells(on) - truth).max() / chain.peaks.sum(axis=1).max() > 1e-3 * error


def test_series_and_instants_one_by_one_agree():
    chain, on = moving(None, True)
    view, given = chain.view, (chain.target, chain.view, on, 1.0, slice(None))
    still, samples = arrivals.arriving(*given)
    whole = arrivals.waveform.transmit(still, chain.sending.aired) + samples
    by_sample = arrivals._at_instants(*given, symbol_motion.every_sample(view))
    assert abs(whole - by_sample).max() < 1e-11 * abs(by_sample).max()


def test_no_range_differs_within_a_symbol_by_more_than_its_bound():
    chain, _ = moving(None, False)
    view = chain.view
    later = view.at(view.times_s + 0.6 * symbol_motion.duration_s(view))
    station = np.asarray(view.station.position_m)
    moved = abs(np.linalg.norm(later.places - station, axis=2) - np.linalg.norm(view.places - station, axis=2)).max()
    assert 0.05 * symbol_motion.farther_m(view) < moved <= symbol_motion.farther_m(view)


@pytest.mark.parametrize(("first", "more"), [(0, {"ground_reflection": {}}), (7, {})])
def test_symbols_that_go_through_all_instants_in_two_groups_have_the_same_echo(first, more, monkeypatch):
    radio = network(subcarrier_spacing_hz=15e3, subcarriers=32, symbols=230, transmit=(4, 2), receive=(4, 2))
    cloud, row = target([[0.1, 0, 0], [-0.1, 0.02, 0]], rotor=True, x_m=120.0, vx_mps=40.0, rate_hz=60.0)
    # The target crosses the range that the prefix covers at the fiftieth symbol.
    settings = {"symbol_motion": {}, "cyclic_prefix": {"prefix_s": 2 * 125.0 / SPEED_OF_LIGHT}} | more
    scene = Scene(radio, 3, None, tuple(called(settings)))
    view = observe(scene, radio.stations[0], cloud, row)
    chain = Chain(list(scene.effects), view, lambda name: scene.stream(name, row, "A"), 1.0)
    rows = slice(first, None)
    part = view.at(view.times_s[rows]) if first else view
    assert len(part.motion.rotation) == 230 - first
    factor = np.random.default_rng(3).uniform(0.2, 1.0, (230, 2))[rows]
    given = chain.target, part, frozenset(("symbol_motion", "cyclic_prefix")), factor, rows
    still, samples = arrivals.arriving(*given)
    monkeypatch.setattr(arrivals, "TOGETHER", 1)
    groups, in_orders = [], arrivals._in_orders
    monkeypatch.setattr(arrivals, "_in_orders", lambda *now: (groups.append(len(now[1].times_s)), in_orders(*now))[1])
    for one, other in zip(arrivals.arriving(*given), (still, samples), strict=True):
        assert abs(other).max() > 0 and abs(one - other).max() < 1e-10 * abs(still).max()
    assert groups == [200, len(part.times_s) - 200]


def test_a_view_at_some_symbols_has_the_motion_and_the_places_of_these():
    view, rows = moving(None, False)[0].view, np.array([3, 1])
    fresh, later = view.at(view.times_s), view.at(view.times_s[rows])
    for known in ("motion", "places"):
        getattr(fresh, known)
        part = fresh.at_symbols(rows)
        assert known in vars(part) and (part.times_s == view.times_s[rows]).all()
        assert (part.motion.rotation == later.motion.rotation).all() and (part.places == later.places).all()
        assert (part.motion.translation == later.motion.translation).all()


@pytest.mark.parametrize("lit", [[0, 1, 2, 3, 4], [1, 3], []])
def test_moments_are_the_plain_sums_over_points_with_and_without_strength(lit):
    rng = np.random.default_rng(4)
    out, back = rng.normal(size=(2, 2, 3, 5)) + 1j * rng.normal(size=(2, 2, 3, 5))
    strength, ahead, home = np.zeros((3, 5)), *rng.uniform(-1, 1, (2, 3, 5))
    strength[:, lit] = rng.choice([-1e-9, 2e-9, 3.0], (3, len(lit)))
    middle, found = rng.uniform(-0.1, 0.1, 3), np.empty((3, 2, 2, 8))
    planes = [np.stack([one.real, one.imag]) for one in (out, back)]
    work = np.empty((moment_loops.SUM_ROWS + 8, 16)), np.empty(5, np.int64)
    moment_loops.moments(strength, *planes, 2.0, ahead, home, middle, 0.5, 1.5, *work, found)
    place = (0.5 * (ahead + home) - middle[:, None]) / 1.5
    terms = (-1j) ** np.arange(8)[:, None, None] * np.cos(np.arange(8)[:, None, None] * np.arccos(place))
    truth = np.einsum("pnl,qnl->nqp", terms, 2.0 * strength * out * back)
    assert found[:, 0] + 1j * found[:, 1] == pytest.approx(truth, rel=1e-12, abs=1e-20)


def test_the_number_of_instants_counts_a_part_by_its_share_of_the_amplitudes(monkeypatch):
    chain, on = moving(None, False)
    view, given, count = chain.view, [], symbol_motion.count
    alone, errors = np.array([0.0, 1.0]), np.geomspace(1e-12, 1e-2, 60)
    # The rotor needs the most instants, and it alone has as many as where the shares are unknown.
    assert [count(view, error, alone) for error in errors] == [count(view, error) for error in errors]
    assert [count(view, error, 0.01 * alone) for error in errors] == [count(view, 100 * error) for error in errors]
    assert count(view, 1e-9, 1.0 - alone) < count(view, 1e-9)
    count_of, motions = symbol_motion.count_of, []
    monkeypatch.setattr(symbol_motion, "count_of", lambda *asked: (given.append(asked[3]), count_of(*asked))[1])
    complex_motion = symbol_motion.complex_motion
    monkeypatch.setattr(symbol_motion, "complex_motion", lambda one: motions.append(one) or complex_motion(one))
    strengths = chain.target.strengths * np.linspace([1.0, 3.0], [2.0, 1.0], len(view.times_s)) + 1e-9
    chain.target.__dict__["strengths"] = strengths
    chain.cells(on)
    # A part's share is that of its largest amplitude in the look.
    assert (given[0] * strengths.sum(axis=1).max() >= (1 - 1e-12) * strengths).all()
    assert given[0].sum() < 2
    # The motion is bounded once for the instants of positions and of array sums.
    assert len(motions) == 1


@pytest.mark.parametrize("physics", [{}, {"squint": {}}])
@pytest.mark.parametrize("error", [1e-13, 1e-6])
def test_an_echo_on_the_direct_path_alone_is_the_sum_over_its_instants(physics, error):
    radio = network(symbols=40, transmit=(8, 4), receive=(8, 4))
    points = np.random.default_rng(2).uniform(-0.4, 0.4, (21, 3))
    cloud, row = target(points, rotor=True, x_m=90.0, y_m=-30.0, vx_mps=20.0, rate_hz=90.0)
    scene = Scene(radio, 3, None, tuple(called({"symbol_motion": {}} | physics)))
    view = observe(scene, radio.stations[0], cloud, row)
    chain, on = Chain(list(scene.effects), view, lambda name: scene.stream(name, row, "A"), 1.0), frozenset(physics)
    chain.error = error
    factor, on = np.random.default_rng(3).uniform(0.2, 1.0, (40, 21)), on | {"symbol_motion"}
    given = chain.target, view, on, factor, slice(None)
    assert time_series.alone(view, None, on)
    still, samples = arrivals.arriving(*given)
    whole = arrivals.waveform.transmit(still, chain.sending.aired) + samples
    truth = arrivals._at_instants(*given, symbol_motion.every_sample(view))
    assert abs(samples).max() > 1e-3 * abs(truth).max()
    assert abs(whole - truth).max() < max(1e-10 * abs(truth).max(), error * chain.peaks.sum(axis=1).max())


@pytest.mark.parametrize("allowed", [0.0, 1e-9, 2e-3, 1e9])
def test_moments_left_out_sum_to_no_more_than_is_allowed_and_few_are_kept(allowed):
    sizes = 0.03 ** np.arange(6)[:, None] * 0.1 ** np.arange(12)
    used = time_series.numbers(sizes, allowed)
    left = sizes.sum() - sum(sizes[order, :count].sum() for order, count in enumerate(used))
    assert used[0] == 12 and left <= allowed + 1e-15
    assert len(used) == {0.0: 6, 1e-9: 6, 2e-3: 2, 1e9: 1}[allowed]
    assert allowed == 0.0 or used.sum() < 0.6 * sizes.size


def test_the_largest_moment_of_each_order_is_that_of_any_symbol():
    planes, found = np.random.default_rng(8).normal(size=(3, 7, 2, 8)), np.empty((3, 8))
    time_series_loops.largest(planes, found)
    assert found == pytest.approx(np.hypot(planes[:, :, 0], planes[:, :, 1]).max(axis=1), rel=1e-15)
