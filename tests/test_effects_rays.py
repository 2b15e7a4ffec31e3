"""Grids and azimuths of triangles for rays: none is lost while the target moves on, and points judged at once agree."""

from dataclasses import replace

import numpy as np
import pytest

from interpreted import interpreted
from lowalt.effects.channel import occlusion, ray_grid, ray_tests, shadow_rays, still_rays, surface_tree, turning_rays
from lowalt.effects.channel.ray_tests import cross
from lowalt.targets.surfaces import Surface
from test_effects_occlusion import NETWORK, scene


@pytest.mark.parametrize("range_m", [30.0, 80.0])
def test_a_grid_loses_no_triangle_while_the_target_flies_on(range_m, monkeypatch):
    # Small triangles, of which a ray rarely meets two: one that a cell lacks is missed.
    rng = np.random.default_rng(5)
    corners = rng.uniform(-1.5, 1.5, (900, 1, 3)) + rng.normal(0, 0.06, (900, 3, 3))
    surface = Surface(corners.reshape(-1, 3), np.arange(2700).reshape(-1, 3))
    points = rng.uniform(-1.5, 1.5, (300, 3))
    view = scene(
        points, rng.normal(0, 1, (300, 3)), [surface], np.zeros(300, int), closed=False, x_m=range_m, z_m=50.0,
        vx_mps=-9.0, vy_mps=28.0, yaw_rad=0.4, pitch_rad=0.3,
    )  # fmt: skip
    view = replace(view, times_s=NETWORK.times_s[:64])
    found = occlusion.hidden(view)
    monkeypatch.setattr(shadow_rays, "SLOW", 0.0)
    assert (found == occlusion.hidden(view)).all()
    assert 0.05 < found.mean() < 0.9
    assert len(np.unique(found, axis=0)) > 5


def loose(count: int, kinds: tuple[str, ...], closed: bool, **row):
    """Points among small triangles, on one part or, of two parts, on the second, which turns about z."""
    rng = np.random.default_rng(7)
    corners = rng.uniform(-1.0, 1.0, (count, 1, 3)) * [1, 1, 0.3] + rng.normal(0, 0.1, (count, 3, 3))
    surface = Surface(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    points = rng.uniform(-1.0, 1.0, (40, 3)) * [1, 1, 0.3]
    given = [surface] * len(kinds)
    part = np.full(40, len(kinds) - 1)
    return scene(points, rng.normal(0, 1, (40, 3)), given, part, kinds, closed=closed, **row)


@pytest.mark.parametrize("closed", [True, False])
@pytest.mark.parametrize(("kind", "z_m"), [("rotor", 25.0), ("rotor", 60.0), ("wheel", 5.0)])
def test_azimuths_lose_no_triangle_of_a_part_that_turns(kind, z_m, closed, monkeypatch):
    view = loose(150, ("body", kind), closed, x_m=60.0, y_m=20.0, z_m=z_m, vx_mps=10.0, rate_hz=70.0)
    view = replace(view, times_s=NETWORK.times_s[:100])
    asked, cast = [], shadow_rays.turning_rays.cast
    monkeypatch.setattr(shadow_rays.turning_rays, "cast", lambda *given: (asked.append(cast(*given)), asked[0])[1])
    found = occlusion.hidden(view)
    assert asked[0].all()
    monkeypatch.setattr(shadow_rays.turning_rays, "cast", lambda *given: np.zeros(40, np.bool_))
    assert (found == occlusion.hidden(view)).all()
    assert 0.1 < found.mean() < 0.95
    assert len(np.unique(found, axis=0)) > 20


@pytest.mark.parametrize("closed", [True, False])
def test_points_that_are_judged_for_many_symbols_are_hidden_as_ray_by_ray(closed, monkeypatch):
    view = loose(200, ("body",), closed, x_m=40.0, y_m=30.0, z_m=45.0, vx_mps=-9.0, vy_mps=28.0)
    view = replace(view, times_s=NETWORK.times_s[:150])
    asked, hidden, judged = [], [], shadow_rays.judged

    def kept(*values):
        asked.append(judged(*values))
        hidden.append(values[-1].copy())
        return asked[0]

    monkeypatch.setattr(shadow_rays, "judged", kept)
    found = occlusion.hidden(view)
    assert asked[0].all() and asked[0].shape == (3, 40)
    assert (hidden[0] == found).all()
    # Some points are free of all triangles, some hidden for good, and some come and go.
    assert min(found.all(axis=0).mean(), (~found).all(axis=0).mean()) > 0.03
    assert len(np.unique(found, axis=0)) > 5
    monkeypatch.setattr(shadow_rays, "judged", lambda *values: np.zeros_like(asked[0]))
    assert (found == occlusion.hidden(view)).all()


def test_a_point_without_a_grid_toward_the_station_is_not_judged():
    view = loose(200, ("body",), True, x_m=40.0, y_m=30.0, z_m=45.0, vx_mps=6.0)
    surfaces = view.occluders
    tree = surface_tree.whole_tree(surfaces)
    station = np.array([[40.0, 30.0, 45.0]]) + np.linspace(0.0, 0.5, 70)[:, None] * [1.0, -1.0, 0.0]
    grid = ray_grid.grids(station, surfaces["vertices"], tree, 0)
    points, part, toward = np.zeros((2, 3)), np.zeros(2, np.int64), np.array([0.0, 0.1])
    given = surfaces["vertices"], tree, 0, grid
    # A point that is moved toward the station does not stand still in its part's frame.
    asked = [
        still_rays.judged(*given, seen, points, part, toward, np.zeros((70, 2), np.bool_)).tolist()
        for seen in (station, station * [1, 1, -1])
    ]
    assert asked == [[[True, False]] * 2, [[False, False]] * 2]
    grid.way[:] = -1.0
    assert not still_rays.judged(*given, station, points, part, toward, np.zeros((70, 2), np.bool_)).any()


def small_triangles(closed: bool):
    """A tree of triangles that rays along z from around the origin meet now and then."""
    rng = np.random.default_rng(8)
    vertices = (rng.uniform(-1.0, 1.0, (40, 1, 3)) * [1, 1, 4] + rng.normal(0, 1.0, (40, 3, 3))).reshape(-1, 3)
    surfaces = {"vertices": vertices, "vertex_part": np.zeros(120, int), "closed": np.array([closed])}
    return surface_tree.tree(surfaces, np.arange(120).reshape(-1, 3))


@pytest.mark.parametrize("closed", [True, False])
def test_rays_that_are_held_against_a_triangle_together_meet_it_as_alone(closed):
    tree, rng = small_triangles(closed), np.random.default_rng(9)
    each, alone, away = (interpreted(one) for one in (ray_tests.hit_each, ray_tests.hit, ray_tests.turned_away))
    met = left_out = 0
    for f in range(40):
        start, ways = rng.uniform(-1.0, 1.0, 3), rng.normal([[0.0], [0.0], [4.0]], 1.0, (3, 30))
        # One ray begins at a corner, and one lies in the plane.
        ways[:, 0], ways[:, 1] = tree.edges[f, 3:6], tree.edges[f, :3] - start
        free = np.ones(30)
        each(tree.edges[f], tree.closed[f], start, ways, 0, 29, free)
        found = [alone(tree, f, *start, *ways[:, n]) for n in range(29)]
        assert (free == 0.0).tolist() == [*found, False]
        met += sum(found)
        if away(tree, f, *start):
            assert closed and not any(found)
            left_out += 1
    assert met > 20
    assert (left_out > 8) == closed


@pytest.mark.parametrize("turn", [0.0, 0.4, 2.9])
def test_symbols_are_sorted_by_the_azimuth_of_the_station(turn):
    angle = turn + 0.7 * np.arange(100)
    middle = np.array([1.0, 2.0, 3.0])
    station = middle + np.stack([30.0 * np.cos(angle), 30.0 * np.sin(angle), np.linspace(3.0, 6.0, 100)], axis=1)
    seen = turning_rays._seen(np.ascontiguousarray(station.T), np.array([0.0, 0.0, 2.0]), middle)
    assert sorted(seen.order) == list(range(100))
    np.testing.assert_array_equal(seen.ends, station[seen.order].T)
    assert seen.begin[0] == 0 and seen.begin[-1] == 100 and (np.diff(seen.begin) >= 0).all()
    np.testing.assert_allclose(seen.limits, [0.1, 0.2, 30.0], rtol=1e-12)
    # The number that stands for an angle is y / (|x| + |y|) in the first quarter, and so on.
    away = seen.axes[1:] @ (station - middle).T
    tangent = np.arctan2(away[1], away[0]) % (2 * np.pi)
    quarter, rest = np.divmod(tangent, np.pi / 2)
    number = quarter + np.sin(rest) / (np.sin(rest) + np.cos(rest))
    slots = np.floor(number * turning_rays.BINS / 4).astype(int)
    for slot in range(turning_rays.BINS):
        assert set(seen.order[seen.begin[slot] : seen.begin[slot + 1]]) == set(np.flatnonzero(slots == slot))


def test_a_triangle_is_asked_of_the_bins_that_it_names_also_across_the_last_one():
    begin = np.arange(turning_rays.BINS + 1)
    edge, start = np.array([-9.0, -9.0, 1.0, 30.0, 0.0, 0.0, 0.0, 30.0, 0.0]), np.zeros(3)
    ways = np.zeros((3, turning_rays.BINS))
    ways[2] = 2.0
    last = turning_rays.BINS - 1
    for first, final, bins in (
        (3, 5, [3, 4, 5]), (-2, 1, [last - 1, last, 0, 1]), (last - 1, last + 2, [last - 1, last, 0, 1]),
        (last, last, [last]), (-1, -1, [last]), (last + 1, last + 2, [0, 1]),
    ):  # fmt: skip
        free = np.ones(turning_rays.BINS)
        interpreted(turning_rays._ask)(edge, False, begin, first, final, start, ways, free)
        assert np.flatnonzero(free == 0.0).tolist() == sorted(bins)
    free = np.ones(turning_rays.BINS)
    interpreted(turning_rays._ask)(edge, False, begin, -4, last, start, ways, free)
    assert not free.any()


def test_triangles_at_some_slopes_are_marked():
    """A triangle 10 away across and 2 to 3 up, seen from the axis at the origin: slopes 0.2 to 0.3 and little more."""
    corners = np.array([[2.0, 10.0, 0.0], [3.0, 10.0, 0.0], [2.5, 10.0, 0.4]]).reshape(9, 1)
    for low, high, wanted in (
        (0.0, 0.19, 0), (0.0, 0.21, 1), (0.31, 1.0, 0), (0.29, 1.0, 1), (-1.0, -0.1, 0), (-1.0, 0.25, 1),
    ):  # fmt: skip
        marks = np.full(1, 7.0)
        interpreted(turning_rays._at_slopes)(corners, 0.0, 0.0, 0.0, low, high, 1, marks)
        assert marks[0] == wanted
        # The same from 5 higher up: slopes -0.3 to -0.2.
        interpreted(turning_rays._at_slopes)(corners, 5.0, 0.0, 0.0, -high, -low, 1, marks)
        assert marks[0] == wanted


def test_cross_products_are_numpys_to_the_last_bit():
    rng = np.random.default_rng(3)
    for a, b in rng.normal(size=(200, 2, 3)):
        np.testing.assert_array_equal(cross(a, b), np.cross(a, b))


def test_places_on_the_space_filling_curve_take_bits_of_the_axes_by_turns():
    """0 to 1 are 1024 steps an axis; bit k of x, y and z are bits 3 k, 3 k + 1 and 3 k + 2 of the place."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]], float)
    steps = surface_tree.BITS
    ones = sum(8**k for k in range(steps))
    assert surface_tree.curve(corners).tolist() == [0, ones, 2 * ones, 4 * ones, 7 * ones]
    inner = np.array([[0.5, 0.25, 0.0], [2.0**-steps, 1 - 2.0**-steps, 0.0]])
    top = 8 ** (steps - 1)
    assert surface_tree.curve(inner).tolist() == [top + 2 * top // 8, 1 + 2 * ones]
