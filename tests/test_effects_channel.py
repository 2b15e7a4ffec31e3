"""Channel effects: each against its closed form or a limit of it, and quiet at strength zero."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from lowalt.common.config import load_yaml
from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT, Network
from lowalt.echo.radar import radar
from lowalt.effects.channel import clutter, cross_sections, ground_reflection
from lowalt.effects.response import response
from lowalt.effects.view import View
from lowalt.motion.table import NUMBERS
from lowalt.targets.cloud import Cloud

NETWORK = Network.from_settings(load_yaml("config/default.yaml")["network"])
PLAIN = replace(NETWORK, transmit=(1, 1), receive=(1, 1), subcarriers=1)
"""Isotropic arrays and one subcarrier, so that only the propagation paths matter."""
NOTHING = np.full(3, np.nan)
METAL = {**ground_reflection.DEFAULTS, "permittivity": 1.0, "conductivity_s_m": 1e14, "polarisation": "horizontal"}
"""A mirror: reflection -1 at every angle."""
EARTH = {**ground_reflection.DEFAULTS, "permittivity": 12.8, "conductivity_s_m": 0.47}


def body(points: list, normals: np.ndarray | None = None, kind: str = "body") -> Cloud:
    """A cloud of given points: the first ones on a body, all others on one part that turns about z."""
    points = np.array(points, float)
    moving = kind != "body"
    return Cloud(
        points=points, part=np.array([0] + [int(moving)] * (len(points) - 1)), kinds=("body", kind)[: 1 + moving],
        names=("body", kind)[: 1 + moving], parents=np.full(1 + moving, -1),
        hinges=np.array([NOTHING, np.zeros(3)])[: 1 + moving], axes=np.array([NOTHING, [0, 0, 1.0]])[: 1 + moving],
        normals=np.full(points.shape, np.nan) if normals is None else np.asarray(normals, float),
        rcs_m2=np.ones(len(points)), record={"subtype": "test", "category": "UAV", "source": "t", "checksum": ""},
    )  # fmt: skip


def seen(cloud: Cloud, network: Network = NETWORK, times_s: np.ndarray | None = None, **values: float) -> View:
    """The view of a cloud at station A; motion values not given are zero."""
    row = {"subtype": "test", "model": 0, **dict.fromkeys(NUMBERS, 0.0), **values}
    return View(network, network.station("A"), cloud, row, network.times_s if times_s is None else times_s)


def received(view: View, settings: dict | None) -> np.ndarray:
    """The subcarriers of a view, with the ground where there are settings for it."""
    paths = [] if settings is None else ground_reflection.paths(settings, view)
    return response(view.network, view.station, view.places, view.cloud.rcs_m2, view.aim_m, paths=paths)


@pytest.mark.parametrize("settings", [METAL, EARTH, {**EARTH, "roughness_m": 0.1}])
def test_two_rays_add_as_the_closed_form_over_range_and_height(settings):
    station = np.array(PLAIN.station("A").position_m)
    frequency = PLAIN.station("A").frequency_hz
    wave = 2 * np.pi * frequency / SPEED_OF_LIGHT
    for x in (30.0, 200.0, 1100.0):
        for z in (0.0, 1.0, 40.0, 150.0):
            found = received(seen(body([[0, 0, 0]]), PLAIN, np.zeros(1), x_m=x, z_m=z), settings)[0, 0]
            direct, far = np.hypot(x, z - station[2]), np.hypot(x, z + station[2])
            sine = (z + station[2]) / far
            epsilon = settings["permittivity"] - 1j * settings["conductivity_s_m"] / (
                2 * np.pi * frequency * 8.8541878128e-12
            )
            root = np.sqrt(epsilon - (1 - sine**2))
            weight = epsilon if settings["polarisation"] == "vertical" else 1
            ground = (weight * sine - root) / (weight * sine + root)
            x_rough = 2 * (wave * settings["roughness_m"] * sine) ** 2
            ground = ground * np.i0(x_rough) * np.exp(-x_rough)
            one_way = np.exp(-1j * wave * direct) / direct + ground * np.exp(-1j * wave * far) / far
            scale = radar(PLAIN, PLAIN.station("A")).scale
            echo = scale / direct**2
            assert found == pytest.approx(scale * one_way**2, abs=1e-7 * abs(echo))


def test_a_mirror_fades_to_nothing_and_rises_by_twelve_decibels():
    # Far out the paths differ by 2 h z / x, so heights between two fades are lambda x / (2 h) apart.
    height = np.linspace(0.0, 40.0, 801)
    x, h = 1200.0, 25.0
    cloud = body([[0, 0, 0]])
    gain = []
    for z in height:
        view = seen(cloud, PLAIN, np.zeros(1), x_m=x, z_m=z)
        gain.append(abs(received(view, METAL) / received(view, None))[0, 0])
    gain = 20 * np.log10(np.maximum(gain, 1e-12))
    assert gain.max() == pytest.approx(40 * np.log10(2), abs=0.1)
    assert gain[0] < -200
    fades = height[1:-1][(gain[1:-1] < gain[:-2]) & (gain[1:-1] < gain[2:])]
    wavelength = SPEED_OF_LIGHT / PLAIN.station("A").frequency_hz
    assert np.diff(fades).mean() == pytest.approx(wavelength * x / (2 * h), rel=0.01)


def test_the_reflection_has_its_limits_and_keeps_the_energy():
    sine = np.linspace(0, 1, 2001)
    for polarisation in ("vertical", "horizontal"):
        for permittivity, conductivity in ((1.5, 0.0), (15.0, 0.01), (80.0, 5.0), (1.0, 1e9)):
            found = ground_reflection.fresnel(sine, permittivity, conductivity, 4.9e9, polarisation)
            assert (abs(found) <= 1 + 1e-15).all()
            assert found[0] == pytest.approx(-1)
    # Brewster's angle, where a lossless ground swallows vertical polarisation: tan psi = 1 / sqrt(eps).
    brewster = np.sin(np.arctan(1 / np.sqrt(15.0)))
    assert abs(ground_reflection.fresnel(brewster, 15.0, 0.0, 4.9e9, "vertical")) < 1e-15
    assert abs(ground_reflection.fresnel(brewster, 15.0, 0.0, 4.9e9, "horizontal")) > 0.8
    # A wave that enters a lossy ground dies away there: the wrong sign of the loss would reflect more than comes in.
    inside = np.sqrt(15.0 - 1j * 0.3 - 1 + 0.25)
    assert inside.imag < 0
    rough = ground_reflection.roughness(sine, 0.05, 4.9e9)
    assert rough[0] == 1
    assert (np.diff(rough) < 0).all()
    # Small heights: the first orders of Ament's factor exp(-2 (k s sin psi)^2) and Miller's agree.
    wave = 2 * np.pi * 4.9e9 / SPEED_OF_LIGHT
    np.testing.assert_allclose(
        ground_reflection.roughness(sine, 1e-4, 4.9e9), np.exp(-2 * (wave * 1e-4 * sine) ** 2), atol=1e-7
    )


def test_ground_like_air_is_idle_and_the_limit_is_continuous():
    air = {**ground_reflection.DEFAULTS, "permittivity": 1.0, "conductivity_s_m": 0.0}
    assert ground_reflection.idle(air)
    assert not ground_reflection.idle(ground_reflection.DEFAULTS)
    view = seen(body([[0, 0, 0], [0.3, 0.1, 0.2]]), x_m=150.0, y_m=80.0, z_m=50.0)
    plain = received(view, None)
    thin = received(view, {**air, "permittivity": 1 + 1e-9})
    assert abs(thin - plain).max() < 1e-8 * abs(plain).max()


@pytest.mark.parametrize(
    ("effect", "change", "place", "words"),
    [
        (ground_reflection, {}, -1.0, "station A stands at z = -1.0"),
        (ground_reflection, {"permittivity": 0.5}, 25.0, "permittivity is 0.5"),
        (ground_reflection, {"polarisation": "left"}, 25.0, "polarisation is 'left'"),
        (clutter, {}, 0.0, "station A stands at z = 0.0"),
        (clutter, {"law": "weibull", "shape": 2.5}, 25.0, "shape is 2.5"),
    ],
)
def test_impossible_scenes_are_refused_by_name(effect, change, place, words):
    station = replace(NETWORK.stations[0], position_m=(0.0, 0.0, place))
    checked = SimpleNamespace(network=replace(NETWORK, stations=(station,)))
    with pytest.raises(InputError, match=words):
        effect.check({**effect.DEFAULTS, **change}, checked)
    effect.check(effect.DEFAULTS, SimpleNamespace(network=NETWORK))


@pytest.mark.parametrize("strength", [1.0, 0.3])
def test_factors_of_diffuse_points_in_one_pass_are_roots_of_their_lobes_to_the_last_bit(strength):
    cosine = np.random.default_rng(4).uniform(-1.0, 1.0, (5, 11))
    cosine[:, 3], cosine[2, 4], known = np.nan, 0.0, np.arange(11) != 3
    found = np.full(cosine.shape, 7.0)
    cross_sections._lambert(cosine, known, strength, found)
    wanted = np.where(known, np.sqrt(1.0 - strength + strength * cross_sections.diffuse(cosine, 1.0)), 1.0)
    np.testing.assert_array_equal(found, wanted)


def test_lobes_keep_the_mean_cross_section():
    angle = np.linspace(0, np.pi, 400_001)
    cosine, weight = np.cos(angle), np.sin(angle) * (angle[1] - angle[0])
    for power in (0.0, 0.5, 1.0, 4.0):
        assert weight @ cross_sections.diffuse(cosine, power) / 2 == pytest.approx(1, rel=1e-4)
    for size in (1e-3, 0.7, 3.0, 40.0):
        assert weight @ cross_sections.facet(cosine, size) / 2 == pytest.approx(1, rel=1e-6)
    # A large plate's lobe there and back is half as wide as its beam one way, of gain 4 pi A / lambda^2 = (k a)^2.
    assert cross_sections.facet(np.array([1.0]), 200.0)[0] == pytest.approx(4 * 200.0**2, rel=0.01)


def test_a_sphere_of_points_keeps_its_total_and_unknown_normals_stay():
    rng = np.random.default_rng(4)
    normals = rng.normal(size=(4000, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals[:10] = np.nan
    view = seen(body(0.2 * np.nan_to_num(normals), normals), times_s=np.zeros(1), x_m=200.0, y_m=50.0, z_m=60.0)
    factor = cross_sections.visible(cross_sections.DEFAULTS, view)
    assert (factor[0, :10] == 1).all()
    # The relative cross section 4 cos+ has a variance of 5/3 over the sphere.
    assert (factor[0, 10:] ** 2).mean() == pytest.approx(1, abs=5 * np.sqrt(5 / 3 / 3990))
    weak = cross_sections.visible({**cross_sections.DEFAULTS, "strength": 1e-9}, view)
    assert abs(weak - 1).max() < 1e-8
    assert cross_sections.idle({**cross_sections.DEFAULTS, "strength": 0.0})


def blade_pair(count: int = 15) -> Cloud:
    """Two blades along x at rest, their points on leading and trailing edges with normals square to the blade."""
    along = np.linspace(0.03, 0.15, count)
    edge = [[side * x, way * 0.004, 0] for side in (1, -1) for x in along for way in (1, -1)]
    normals = [[0, way, 0] for side in (1, -1) for x in along for way in (1, -1)]
    return body([[0, 0, 0], *edge], np.array([[0, 0, 1.0], *normals]), "rotor")


def test_blades_flash_twice_a_turn_and_brightest_square_to_the_line_of_sight():
    rate = 20.0
    times = np.arange(400) * 2.5e-3
    view = seen(blade_pair(), times_s=times, x_m=0.0, y_m=200.0, z_m=25.0, rate_hz=rate)
    factor = cross_sections.visible(cross_sections.DEFAULTS, view)
    power = (factor[:, 1:] ** 2).sum(axis=1)
    spectrum = abs(np.fft.rfft(power - power.mean()))
    assert np.fft.rfftfreq(400, 2.5e-3)[spectrum.argmax()] == pytest.approx(2 * rate)
    # At rest the blade lies along x and the station along -y: the flash comes at whole half turns.
    turned = (rate * times) % 0.5
    bright = power > 0.99 * power.max()
    assert np.minimum(turned[bright], 0.5 - turned[bright]).max() < 0.02
    assert power.min() < 1e-12 * power.max()
    echo = response(NETWORK, view.station, view.places, view.cloud.rcs_m2, view.aim_m, factor=factor)
    flat = response(NETWORK, view.station, view.places, view.cloud.rcs_m2, view.aim_m)
    assert abs(echo[bright]).mean() > 1.5 * abs(flat[bright]).mean()


def test_images_at_another_instant_are_those_of_the_path():
    view = seen(body([[1.0, 2.0, 3.0], [-1.0, 0.5, 0.0]]))
    (path,), before = ground_reflection.paths(ground_reflection.DEFAULTS, view), view.places.copy()
    np.testing.assert_array_equal(ground_reflection.images({}, view)[0], path.places)
    np.testing.assert_array_equal(path.places, before * [1.0, 1.0, -1.0])
    np.testing.assert_array_equal(view.places, before)
