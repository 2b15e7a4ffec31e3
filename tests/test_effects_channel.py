"""Channel effects: each against its closed form or a limit of it, and quiet at strength zero."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy import stats
from scipy.special import gamma, kv

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


def settings_of(**change) -> dict:
    """Settings of the clutter with some changed."""
    return {**clutter.DEFAULTS, **change}


def test_land_has_the_closed_power_of_its_rings():
    network = replace(NETWORK, transmit=(1, 1), receive=(1, 1))
    station = network.station("A")
    found = clutter.cell_power(settings_of(reach_m=1000.0), network, station, np.array([200.0, 100.0, 60.0]))
    cell, height = network.cell_m, 25.0
    edges = np.clip((np.arange(len(found))[:, None] + [-0.25, 0.75]) * cell, height, 1000.0)
    # sigma0 r dr dphi / r^4 with sigma0 = gamma h / r, all around.
    rings = 2 * np.pi * 0.03 * height / 3 * (edges[:, 0] ** -3 - edges[:, 1] ** -3)
    np.testing.assert_allclose(found, radar(network, station).scale ** 2 * rings, rtol=1e-6, atol=1e-30)


def test_land_under_both_beams_matches_a_sum_over_patches():
    station = NETWORK.station("B")
    aim = np.array([300.0, 150.0, 40.0])
    found = clutter.cell_power(settings_of(reach_m=400.0), NETWORK, station, aim)
    radio = radar(NETWORK, station)
    place = np.array(station.position_m)
    radius = (np.arange(24) + 0.5) / 24
    azimuth = 2 * np.pi * np.arange(2000) / 2000
    normal = np.array([np.cos(station.normal_rad), np.sin(station.normal_rad), 0.0])
    side = np.array([-normal[1], normal[0], 0.0])
    for cell in (7, 30, 77):
        r = (cell - 0.25 + radius[:, None]) * NETWORK.cell_m
        flat = np.sqrt(r**2 - place[2] ** 2)
        away = np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), -place[2] + 0 * flat * azimuth], -1)
        to_aim = (aim - place) / np.linalg.norm(aim - place)
        angle = np.pi * radio.kappa
        unit = away / r[..., None]
        phases = [np.exp(1j * angle * np.arange(16)[:, None, None] * ((unit - to_aim) @ side)).sum(axis=0),
                  np.exp(1j * angle * np.arange(4)[:, None, None] * (unit - to_aim)[..., 2]).sum(axis=0)]  # fmt: skip
        gain = abs(phases[0] * phases[1]) ** 4
        land = 0.03 * place[2] / r * r * gain / r**4
        slow = radio.scale**2 * land.sum() * NETWORK.cell_m / 24 * 2 * np.pi / 2000
        assert found[cell] == pytest.approx(slow, rel=2e-3)


@pytest.mark.parametrize(
    ("law", "shape", "distribution"),
    [
        ("rayleigh", 1.0, stats.rayleigh(scale=np.sqrt(0.5))),
        ("weibull", 1.3, stats.weibull_min(1.3, scale=1 / np.sqrt(stats.weibull_min(1.3).moment(2)))),
        ("weibull", 2.0, stats.rayleigh(scale=np.sqrt(0.5))),
        ("k", 0.8, None),
    ],
)
def test_cells_have_the_amplitude_law_they_were_given(law, shape, distribution):
    rng = np.random.default_rng(8)
    texture = clutter.texture(law, shape, 1.0 - rng.random((2, 20_000)))
    amplitude = np.sqrt(texture) * abs(clutter.speckle(rng, 20_000, 1, 2.5e-3, 3.0, 6.0, 0.06)[:, 0])
    if law != "k":
        assert stats.kstest(amplitude, distribution.cdf).pvalue > 0.01
    else:
        # K law: P(|A| > x) = 2 / Gamma(nu) (b x)^nu K_nu(2 b x), b = sqrt(nu).
        def below(x: np.ndarray) -> np.ndarray:
            y = np.sqrt(shape) * x
            return 1 - 2 / gamma(shape) * y**shape * kv(shape, 2 * y)

        assert stats.kstest(amplitude, below).pvalue > 0.01


def test_windblown_land_has_billingsleys_spectrum_and_ratio():
    wavelength, step, wind = 0.06, 2.5e-3, 4.5
    still, beta = clutter.windblown(wind, SPEED_OF_LIGHT / wavelength)
    # At 10 statute miles an hour: a ratio of 489.8 / 10^1.55 / f^1.21 and 1 / beta = 0.1048 (1 + 0.4147) m/s.
    ten = clutter.windblown(4.4704, 4.9e9)
    assert ten[0] == pytest.approx(489.8 / 10**1.55 / 4.9**1.21)
    assert 1 / ten[1] == pytest.approx(0.1048 * 1.4147)
    waves = clutter.speckle(np.random.default_rng(9), 5000, 400, step, still, beta, wavelength)
    assert (abs(waves) ** 2).mean() == pytest.approx(1, rel=0.05)
    lags = np.arange(0, 200, 7)
    found = [(waves[:, lag:] * waves[:, : 400 - lag].conj()).mean().real for lag in lags]
    # The exponential spectrum's autocorrelation is a Lorentzian; the still part adds its share at all lags.
    moving = 1 / (1 + (4 * np.pi * lags * step / (beta * wavelength)) ** 2)
    np.testing.assert_allclose(found, (still + moving) / (1 + still), atol=0.05)
    loose = clutter.speckle(np.random.default_rng(1), 2000, 400, step, 0.0, beta, wavelength)
    taper = np.hanning(400)
    power = (abs(np.fft.fft(loose * taper, axis=1)) ** 2).mean(axis=0)
    speed = np.fft.fftfreq(400, step) * wavelength / 2
    fair = (abs(speed) > 0.1) & (abs(speed) < 0.9)
    slope = np.polyfit(abs(speed[fair]), np.log(power[fair]), 1)[0]
    assert -slope == pytest.approx(beta, rel=0.03)


def test_land_fills_the_range_cells_and_only_those_in_reach():
    view = seen(body([[0, 0, 0]]), x_m=200.0, y_m=100.0, z_m=60.0)
    settings = settings_of(law="rayleigh", wind_mps=0.0, reach_m=600.0)
    centred = np.exp(0.5j * np.pi * np.arange(NETWORK.subcarriers) / NETWORK.subcarriers)
    total = 0.0
    for seed in range(60):
        cells = np.fft.ifft(clutter.scatter(settings, view, np.random.default_rng(seed)) * centred, axis=1)
        assert abs(cells - cells[0]).max() < 1e-12 * abs(cells).max()
        total = total + abs(cells[0]) ** 2 / 60
    power = clutter.cell_power(settings, NETWORK, view.station, view.aim_m)
    assert total[len(power) :].max() < 1e-25 * total.max()
    assert total[: int(25 / NETWORK.cell_m)].max() < 1e-25 * total.max()
    ratio = total[6 : len(power)] / power[6:]
    assert ratio.mean() == pytest.approx(1, abs=5 / np.sqrt(60 * len(ratio)))
    set_ratio = settings_of(law="rayleigh", wind_mps=0.0, reach_m=600.0, clutter_to_signal_db=10.0)
    cells = np.fft.ifft(clutter.scatter(set_ratio, view, np.random.default_rng(0)), axis=1)
    plain = np.fft.ifft(clutter.scatter(settings, view, np.random.default_rng(0)), axis=1)
    gain = (abs(cells[0]).max() / abs(plain[0]).max()) ** 2
    assert gain * power.sum() == pytest.approx(10 * clutter.target_power(view))
    echo = response(NETWORK, view.station, view.places, view.cloud.rcs_m2, view.aim_m)
    # One point in the middle of both beams: its range cells together hold its power.
    assert clutter.target_power(view) == pytest.approx((abs(np.fft.ifft(echo, axis=1)[0]) ** 2).sum(), rel=1e-9)


def test_land_folds_at_the_unambiguous_range_and_vanishes_with_its_reflectivity():
    network = replace(NETWORK, subcarriers=32)
    view = seen(body([[0, 0, 0]]), network, x_m=100.0, y_m=50.0, z_m=60.0)
    found = clutter.scatter(settings_of(), view, np.random.default_rng(0))
    assert found.shape == (400, 32)
    assert np.isfinite(found).all()
    weak = clutter.scatter(settings_of(gamma=0.03e-12), view, np.random.default_rng(0))
    np.testing.assert_allclose(weak, 1e-6 * found, rtol=1e-9)
    assert clutter.idle(settings_of(gamma=0.0))
    assert not clutter.idle(clutter.DEFAULTS)
