"""Buildings: how often they block the line of sight, and the images in their facades."""

import numpy as np
import pytest

import reference_effects
from lowalt.common.errors import InputError
from lowalt.effects.catalogue import called
from lowalt.effects.channel import line_of_sight, walls
from lowalt.effects.checks import CheckedScene
from lowalt.effects.received import Scene, observe, received_signal
from test_effects import network, target

FACADE = [30.0, 60.0, -90.0, 200.0, 60.0]
"""A wall along x at y = 60 m that faces the station at the origin."""


def scene(effects, radio=None):
    return Scene(radio or network(), 5, None, tuple(called(effects)))


@pytest.mark.parametrize(
    ("environment", "flat_m", "height_m", "expected"),
    [
        # Worked by hand from the tables: d1 and p1 of the height, then d1/d + exp(-d/p1)(1 - d1/d).
        ("UMa", 500.0, 50.0, 0.8887), ("UMi", 300.0, 50.0, 0.5872), ("RMa", 1000.0, 20.0, 0.7896),
        ("UMa", 18.0, 1.5, 1.0), ("UMa", 100.0, 1.5, 0.3477), ("UMi", 100.0, 1.5, 0.2310),
        ("UMa", 900.0, 120.0, 1.0), ("RMa", 5000.0, 41.0, 1.0), ("RMa", 510.0, 1.5, 0.6065),
    ],
)  # fmt: skip
def test_line_of_sight_is_as_frequent_as_the_tables_say(environment, flat_m, height_m, expected):
    assert line_of_sight.probability(environment, flat_m, height_m) == pytest.approx(expected, abs=6e-4)


def test_probability_never_leaves_its_range_and_falls_with_distance():
    for environment in line_of_sight.ENVIRONMENTS:
        for height in (0.5, 5.0, 12.0, 20.0, 22.5, 23.0, 39.0, 60.0, 99.0, 299.0):
            found = [line_of_sight.probability(environment, d, height) for d in (1.0, 20.0, 60.0, 200.0, 900.0, 5e3)]
            assert all(0 <= one <= 1 for one in found) and found[0] == 1.0
            assert found[-1] <= found[1] + 1e-12


def test_looks_are_blocked_as_often_as_the_probability_says_and_by_the_loss_both_ways():
    cloud, row = target(np.random.default_rng(1))
    station = network().stations[0]
    rare = scene({"line_of_sight": {"environment": "UMi", "blocked_db": 15.0}})
    view = observe(rare, station, cloud, {**row, "x_m": 300.0, "z_m": 30.0})
    rng = np.random.default_rng(2)
    found = np.array([line_of_sight.visible(rare.effects[0].settings, view, rng)[0, 0] for _ in range(4000)])
    assert sorted(set(found)) == pytest.approx([10 ** (-30 / 20), 1.0])
    expected = line_of_sight.probability("UMi", np.hypot(300.0, 25.0), 30.0)
    assert (found == 1).mean() == pytest.approx(expected, abs=0.03)


def test_a_facade_shows_the_image_where_the_ray_meets_it():
    station = np.array([0.0, 0.0, 10.0])
    places = np.array([[[60.0, 20.0, 30.0], [60.0, 90.0, 30.0], [600.0, 20.0, 30.0], [60.0, 20.0, 190.0]]])
    images, sine, reflected = walls.mirrored(FACADE, places, station)
    np.testing.assert_allclose(images[0, :, 1], [100.0, 30.0, 100.0, 100.0])
    np.testing.assert_allclose(np.delete(images, 1, axis=2), np.delete(places, 1, axis=2))
    # Behind the wall, beyond its end and above its roof nothing is reflected.
    assert reflected.tolist() == [[True, False, False, False]]
    assert sine[0, 0] == pytest.approx(100.0 / np.linalg.norm([60.0, 100.0, 20.0]))


def test_a_facade_is_called_dark_only_where_no_place_in_the_box_is_reflected():
    rng, known = np.random.default_rng(4), []
    for _ in range(400):
        station = np.array([0.0, 0.0, 10.0])
        facade = [*rng.uniform(-60, 60, 2), rng.uniform(0, 360), rng.uniform(5, 80), rng.uniform(5, 40)]
        low = rng.uniform([-60, -60, 0], [60, 60, 60])
        high = low + rng.uniform(0.1, 20, 3)
        # Corners and faces of the box are the places that decide.
        share = np.clip(rng.uniform(-0.3, 1.3, (1, 300, 3)), 0.0, 1.0)
        seen = walls.mirrored(facade, low + share * (high - low), station)[2].any()
        known.append((walls.dark(facade, low, high, station), bool(seen)))
    assert (True, True) not in known
    # The test knows dark boxes and lit ones, and most boxes without a reflection are known as dark.
    assert known.count((False, True)) > 20 and known.count((True, False)) > 5 * known.count((False, False))


def test_a_wall_that_reflects_nothing_changes_no_bit():
    cloud, row = target(np.random.default_rng(3), points=4)
    radio = network(subcarriers=12, symbols=2)
    ground, wall = {"ground_reflection": {}, "squint": {}}, {"walls": {"facades": [[*FACADE[:2], 90.0, *FACADE[3:]]]}}
    behind = {"walls": {"facades": [[-5000.0, 60.0, 0.0, 20.0, 20.0]]}}
    for more in wall, behind:
        with_it = received_signal(scene({**ground, **more}, radio), radio.stations[0], cloud, row)
        without = received_signal(scene(ground, radio), radio.stations[0], cloud, row)
        assert np.array_equal(with_it.signal, without.signal) == (more is behind)


def test_paths_by_a_wall_are_the_sum_over_images():
    cloud, row = target(np.random.default_rng(3), points=4)
    radio = network(subcarriers=12, symbols=2, transmit=(2, 2), receive=(2, 2))
    given = {"facades": [FACADE], "permittivity": 1.0, "conductivity_s_m": 1e9}
    whole = scene({"walls": given}, radio)
    found = received_signal(whole, radio.stations[0], cloud, row)
    view = observe(whole, radio.stations[0], cloud, row)
    image = view.places * [1, -1, 1] + [0.0, 120.0, 0.0]
    # A perfect mirror turns the field that is parallel to it.
    truth = reference_effects.subcarriers(
        radio, radio.stations[0], view.places, cloud.rcs_m2, view.aim_m, [(image, -1.0)]
    )
    cells = np.fft.ifft(truth, axis=1)
    expected = cells[[0, 1], abs(cells).argmax(axis=1)]
    assert abs(found.signal - expected).max() < 1e-4 * abs(expected).max()
    plain = received_signal(scene({}, radio), radio.stations[0], cloud, row)
    assert abs(found.signal - plain.signal).max() > 1e-2 * abs(expected).max()


def test_impossible_buildings_are_refused():
    with pytest.raises(InputError, match="width and height"):
        walls.check({"facades": [[0, 0, 0, 10, 0]], "permittivity": 5}, CheckedScene(network(), {}, ()))
    with pytest.raises(InputError, match="permittivity"):
        walls.check({"facades": [], "permittivity": 0.5}, CheckedScene(network(), {}, ()))
    with pytest.raises(InputError, match="environment"):
        line_of_sight.check({"environment": "moon"}, CheckedScene(network(), {}, ()))
