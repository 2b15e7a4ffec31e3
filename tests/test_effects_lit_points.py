"""Echoes of the points that have any strength alone, held against echoes of all points."""

import numpy as np
import pytest

from lowalt.effects import arrivals, lit_points, steering
from lowalt.effects.catalogue import called
from lowalt.effects.received import Scene, observe
from lowalt.effects.sending import Sending
from lowalt.effects.target_echo import TargetEcho
from test_effects import network, target

RADIO = network(transmit=(16, 4), receive=(8, 2), symbols=40)
POINTS = 48


@pytest.mark.parametrize("routes", [(), (3,), (2, 2)])
def test_every_point_with_any_strength_is_listed_once_and_first(routes):
    rng = np.random.default_rng(1)
    factor = rng.random((*routes, 40, POINTS)) * (rng.random((*routes, 40, POINTS)) < 0.2)
    numbers = lit_points.lit(factor)
    wanted = (factor != 0).reshape(-1, 40, POINTS).any(axis=0)
    if numbers is None:
        assert 16 * -(-wanted.sum(axis=1).max() // 16) > 0.85 * POINTS
        return
    for row, mine in zip(numbers, wanted, strict=True):
        assert len(set(row)) == len(row)
        assert set(row[: mine.sum()]) == set(np.flatnonzero(mine))


@pytest.mark.parametrize("factor", [1.0, np.ones((1, POINTS)), np.ones((40, POINTS)), np.ones((2, 40, POINTS))])
def test_nothing_is_gathered_where_all_points_echo(factor):
    assert lit_points.lit(factor) is None


def test_one_symbol_of_a_look_decides_how_many_points_are_kept():
    factor = np.zeros((40, POINTS))
    assert lit_points.lit(factor).shape == (40, 16)
    factor[17, :17] = 1.0
    assert lit_points.lit(factor).shape == (40, 32)
    factor[3] = 1.0
    assert lit_points.lit(factor) is None


@pytest.mark.parametrize("routes", [(), (2,)])
@pytest.mark.parametrize("update_s", [None, 0.02])
@pytest.mark.parametrize("physics", [{}, {"squint": True, "wavefront": True}])
def test_points_without_strength_change_no_echo(routes, update_s, physics):
    cloud, row = target(np.random.default_rng(4), points=POINTS)
    pointing = {} if update_s is None else {"pointing_error": {"sigma_deg": 0.1, "update_s": update_s}}
    effects = tuple(called({"ground_reflection": {}, **pointing}))
    station = RADIO.stations[0]
    view = observe(Scene(RADIO, 5, None, effects), station, cloud, row)
    assert view.turning == (update_s is not None)
    ground = next(effect for effect in effects if effect.name == "ground_reflection")
    paths = ground.module.paths(ground.settings, view)
    rng = np.random.default_rng(1)
    factor = rng.random((*routes, 40, POINTS)) * (rng.random((40, POINTS)) < 0.3)
    assert lit_points.lit(factor).shape[1] < POINTS
    found = steering.echo(view, paths, factor, **physics)
    wanted = steering.Steered(view, paths, **physics).echo(factor)
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-12 * abs(wanted).max())


def test_a_symbol_in_which_no_point_echoes_is_zero():
    cloud, row = target(np.random.default_rng(4), points=POINTS)
    view = observe(Scene(RADIO, 5, None, ()), RADIO.stations[0], cloud, row)
    factor = np.zeros((40, POINTS))
    factor[:20, 5] = 1.0
    found = steering.echo(view, (), factor)
    assert not found[20:].any()
    assert found[:20].all()


def test_a_path_to_some_points_has_their_places_and_coefficients_at_both_ends():
    rng = np.random.default_rng(1)
    numbers = rng.integers(0, POINTS, (40, 16))
    coefficient = rng.random((40, POINTS)) + 0j
    sender = lit_points.ImagePath(rng.random((40, POINTS, 3)), 2.0 * coefficient)
    path = lit_points.ImagePath(rng.random((40, POINTS, 3)), coefficient, sender=sender)
    found = lit_points.path_at(path, numbers)
    for one, whole in ((found, path), (found.sender, sender)):
        np.testing.assert_array_equal(one.coefficient, np.take_along_axis(whole.coefficient, numbers, 1))
        np.testing.assert_array_equal(one.places, np.take_along_axis(whole.places, numbers[..., None], 1))
    assert lit_points.path_at(path._replace(coefficient=0.5), numbers).coefficient == 0.5


@pytest.mark.parametrize("effects", [{}, {"walls": {"facades": [[30.0, 60.0, -90.0, 400.0, 300.0]]}}])
def test_later_instants_of_a_symbol_have_moments_of_the_same_points(effects):
    cloud, row = target(np.random.default_rng(4), points=POINTS)
    named = tuple(called({"ground_reflection": {}, "symbol_motion": {}, "wavefront": {}, **effects}))
    view = observe(Scene(RADIO, 5, None, named), RADIO.stations[0], cloud, row)

    def draws(*_):
        return np.random.default_rng(1)

    echo = TargetEcho(list(named), view, draws, Sending([], RADIO, draws))
    factor = np.random.default_rng(1).random((40, POINTS))
    factor[:, :38] = 0.0
    on, lit = frozenset({"symbol_motion", "wavefront"}), lit_points.lit(factor)
    within = arrivals._within(echo, view, on, 3, echo.by_need["symbol_motion"].module.complex_motion(view))
    assert lit.shape[1] < POINTS and len(echo.paths) > len(effects)
    some, whole = (list(arrivals._rays(echo, view, echo.paths, on, within, one)) for one in (lit, None))
    given, every = (rays[0].paired(factor) for rays in (some, whole))
    for one, other in zip(some, whole, strict=True):
        spectrum, truth = some[0].spectrum(one.moments(given)), whole[0].spectrum(other.moments(every))
        np.testing.assert_allclose(spectrum, truth, rtol=0, atol=1e-12 * abs(truth).max())
    assert some[1].view.places.shape == (40, 16, 3) and len(some) == 3
