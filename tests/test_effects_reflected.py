"""Aspect and shadows along reflected routes: closed forms of a Lambert surface, of an underside, and refusals."""

from dataclasses import replace

import numpy as np
import pytest

import reference_effects
from lowalt.common.errors import InputError
from lowalt.effects.catalogue import called
from lowalt.effects.chain import Chain
from lowalt.effects.channel import occlusion, reflected_aspect, walls
from lowalt.effects.checks import CheckedScene
from lowalt.effects.received import Scene, observe, received_signal
from test_effects import network, target
from test_effects_buildings import FACADE
from test_effects_occlusion import box
from test_effects_occlusion import scene as hidden_scene

MIRROR = {"permittivity": 1.0, "conductivity_s_m": 1e14, "polarisation": "horizontal"}
"""A ground that reflects everything and turns the phase."""


def scene(effects, radio):
    return Scene(radio, 5, None, tuple(called(effects)))


def facing(normals, **motion):
    """Points at rest with these normals, and their row."""
    cloud, row = target(np.random.default_rng(3), points=len(normals), size_m=0.2)
    still = dict.fromkeys(("vx_mps", "vy_mps", "vz_mps", "yaw_rad", "pitch_rad", "roll_rad"), 0.0)
    part = np.zeros(len(normals), np.int64)
    return replace(cloud, normals=np.asarray(normals, float), part=part), row | still | motion


def subcarriers(effects, radio, cloud, row):
    """The response of all points over all paths."""
    whole = scene(effects, radio)
    view = observe(whole, radio.stations[0], cloud, row)
    chain = Chain(list(whole.effects), view, lambda name: np.random.default_rng(1))
    return view, np.fft.fft(chain.cells(frozenset()), axis=1)


def ways(radio, view, number):
    """One-way factors (2, L) by the direct path and by the mirrored ground, at subcarrier `number`."""
    station = radio.stations[0]
    f = station.frequency_hz + number * radio.subcarrier_spacing_hz
    given = radio, station, radio.transmit
    seen = view.places[0], view.places[0] * [1, 1, -1]
    one, two = (reference_effects.one_way(*given, places, view.aim_m, f, False, False) for places in seen)
    return np.array([one, -two])


def cosines(radio, view):
    """Cosines (2, L) between the normals and the ways to the station and to its image below the ground."""
    place = np.asarray(radio.stations[0].position_m)
    away = np.array([place - view.places[0], place * [1, 1, -1] - view.places[0]])
    return np.einsum("kli,li->kl", away, view.normals[0]) / np.linalg.norm(away, axis=2)


def test_a_lambert_surface_shines_by_both_cosines():
    radio = network(subcarriers=8, symbols=2, transmit=(2, 2), receive=(2, 2))
    cloud, row = facing([[0, 0, -1.0], [-0.6, 0, -0.8], [-0.5, 0.0, 0.866]], x_m=60.0, y_m=5.0, z_m=40.0)
    effects = {"cross_sections": {"power": 2.0}, "ground_reflection": MIRROR, "reflected_aspect": {}}
    view, found = subcarriers(effects, radio, cloud, row)
    cosine = np.maximum(cosines(radio, view), 0.0)
    assert ((cosine > 0).sum(axis=0) == [2, 2, 1]).all()
    scale = np.sqrt(radio.power / 16) * reference_effects.C / radio.carrier_hz / (4 * np.pi) ** 1.5
    for number in range(8):
        # The lobe of mean one is 6 cos^2, or 6 cos cos' between two ways.
        way = (np.sqrt(cosine) * ways(radio, view, number)).sum(axis=0)
        truth = (scale * np.sqrt(6 * cloud.rcs_m2) * way**2).sum()
        assert abs(found[0, number] - truth) < 1e-6 * abs(truth)
    _, before = subcarriers({**effects, "reflected_aspect": {"follow": []}}, radio, cloud, row)
    assert abs(before - found).max() > 0.01 * abs(found).max()


def test_an_underside_below_the_station_echoes_by_the_ground_alone():
    radio = network(subcarriers=8, symbols=2, transmit=(2, 2), receive=(2, 2))
    cloud, row = facing([[0, 0, -1.0]], x_m=20.0, y_m=5.0, z_m=4.0)
    effects = {"cross_sections": {"power": 1.0}, "ground_reflection": MIRROR}
    view, found = subcarriers({**effects, "reflected_aspect": {}}, radio, cloud, row)
    cosine = cosines(radio, view)
    assert cosine[0, 0] < 0 < cosine[1, 0]
    scale = np.sqrt(radio.power / 16) * reference_effects.C / radio.carrier_hz / (4 * np.pi) ** 1.5
    for number in range(8):
        truth = scale * np.sqrt(4 * cosine[1, 0] * cloud.rcs_m2[0]) * ways(radio, view, number)[1, 0] ** 2
        assert abs(found[0, number] - truth) < 1e-6 * abs(truth)
    assert not subcarriers(effects, radio, cloud, row)[1].any()


def test_a_plate_shades_the_direct_route_and_not_the_ground():
    plate = box((2.0, 2.0, 0.02), (0, 0, 0.5))
    view = hidden_scene([[0.0, 0.0, 0.0]], [[0, 0, 1.0]], [plate], [0], y_m=30.0, z_m=5.0)
    above, below = (occlusion.hidden(view.seen_from(place)) for place in ((0.0, 30.0, 25.0), (0.0, 30.0, -25.0)))
    assert above.all() and not below.any()
    assert occlusion.hidden(view.seen_from(view.station.position_m))[0] == occlusion.hidden(view)[0]


def test_points_without_a_normal_are_as_bright_by_every_route_to_the_last_bit():
    radio = network()
    cloud, row = target(np.random.default_rng(4))
    effects = {"cross_sections": {}, "ground_reflection": {}, "line_of_sight": {}, "walls": {"facades": [FACADE]}}
    one, two = (
        received_signal(scene(effects | more, radio), radio.stations[0], cloud, row)
        for more in ({}, {"reflected_aspect": {}})
    )
    assert (one.signal == two.signal).all() and one.power == two.power


def test_every_path_says_where_its_image_of_the_station_is():
    radio = network()
    cloud, row = target(np.random.default_rng(4))
    view = observe(scene({}, radio), radio.stations[0], cloud, row)
    path = walls.paths({**walls.DEFAULTS, "facades": [FACADE]}, view)[0]
    # The way from a point to the image is as long as that from the station to the point's image.
    own = np.linalg.norm(view.places - path.station_m, axis=2)
    assert own == pytest.approx(np.linalg.norm(path.places - np.asarray(view.station.position_m), axis=2))


def test_symbols_computed_again_have_the_same_routes():
    radio = network(symbols=6)
    rng = np.random.default_rng(6)
    cloud, row = target(rng)
    normals = rng.normal(size=cloud.points.shape)
    cloud = replace(cloud, normals=normals / np.linalg.norm(normals, axis=1, keepdims=True))
    whole = scene({"cross_sections": {}, "ground_reflection": {}, "reflected_aspect": {}, "symbol_motion": {}}, radio)
    view = observe(whole, radio.stations[0], cloud, row)
    chain = Chain(list(whole.effects), view, lambda name: np.random.default_rng(1))
    chosen = np.array([False, True, False, True, True, False])
    for on in (frozenset(), frozenset({"symbol_motion"})):
        every, some = chain.cells(on), chain.cells(on, chosen)
        assert abs(every[chosen] - some).max() < 1e-12 * abs(every).max()


@pytest.mark.parametrize(
    "effects, words",
    [({"cross_sections": {}}, "no reflected route"), ({"walls": {}}, "expected one of the scene's effects")],
)
def test_a_scene_without_routes_or_without_sides_is_refused(effects, words):
    with pytest.raises(InputError, match=words):
        reflected_aspect.check(reflected_aspect.DEFAULTS, CheckedScene(network(), effects, ()))
