"""Effects of the channel: laws and slow sums.

They act on the target's own echo, on its further paths and on what else is heard.
"""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy import stats
from scipy.optimize import minimize

import reference_effects
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.errors import InputError
from lowalt.motion.cross_section import mean_cross_section as over_looks
from lowalt.scene.antenna import Element, gain
from lowalt.scene.chain import SceneSample
from lowalt.scene.crossing import crossing
from lowalt.scene.effects.channel import (
    companions,
    cross_sections,
    element_pattern,
    fluctuation,
    ground_reflection,
    line_of_sight,
    mean_cross_section,
    pointing_error,
    reflected_aspect,
    walls,
)
from lowalt.scene.observe import observe
from lowalt.scene.response import ImagePath
from lowalt.scene.target_classes import LARGE_UAV, VEHICLE
from lowalt.scene.view import View
from scenes import A, B, link, linked, network, scene, seen_by, target

LINK = link()


def seen(station=A, cloud=None, radio=None, element=None, **changes) -> View:
    """The small target as a station or a link sees it."""
    made, row = target(np.random.default_rng(1))
    radio = radio or linked()
    return seen_by(radio, station, cloud or made, row | changes, element=element)


def facing(count: int, kinds=("body", "rotor")):
    """The small target with normals in all directions."""
    rng, (cloud, _) = np.random.default_rng(2), target(np.random.default_rng(1), count)
    normals = rng.normal(size=(count, 3))
    return replace(cloud, normals=normals / np.linalg.norm(normals, axis=1, keepdims=True))


def test_an_element_has_its_3db_widths_and_its_front_to_back():
    far = 1e5

    def toward(azimuth_deg: float, up_deg: float, **changes: float) -> float:
        element = Element(**{"downtilt_deg": 0.0, **changes})
        a = A.normal_rad + np.radians(azimuth_deg)
        u = np.radians(up_deg)
        away = far * np.array([np.cos(u) * np.cos(a), np.cos(u) * np.sin(a), np.sin(u)])
        return 10 * np.log10(gain(element, A, np.array(A.position_m) + away))

    assert toward(0, 0) == pytest.approx(8.0)
    for off in ((32.5, 0), (-32.5, 0), (0, 32.5), (0, -32.5)):
        assert toward(*off) == pytest.approx(5.0)
    assert toward(180, 0) == pytest.approx(-22.0)
    assert toward(180, 0, back_db=20.0) == pytest.approx(-12.0)
    assert toward(32.5, 0, back_db=20.0) == pytest.approx(5.0)
    assert toward(0, -10, downtilt_deg=10.0) == pytest.approx(8.0)


def test_an_elements_pattern_weighs_both_ways():
    settings = element_pattern.DEFAULTS
    own, there = (element_pattern.visible(settings, seen(end)) for end in (B, A))
    np.testing.assert_allclose(
        element_pattern.visible(settings, seen(LINK)), np.sqrt(own * there), rtol=1e-12
    )


@pytest.mark.parametrize("power", [0.0, 1.0, 2.5])
def test_a_diffuse_lobe_has_a_mean_of_one(power):
    node, weight = np.polynomial.legendre.leggauss(400)
    assert weight @ cross_sections.diffuse(node, power) / 2 == pytest.approx(1.0, rel=2e-3)


@pytest.mark.parametrize("size", [0.05, 1.0, 12.0])
def test_a_facets_lobe_has_a_mean_of_one_and_physical_opticss_first_null(size):
    cosine = -1 + (2 * np.arange(100_000) + 1) / 100_000
    assert cross_sections.facet(cosine, size).mean() == pytest.approx(1.0, rel=1e-3)
    if size > 2:
        null = np.sqrt(1 - (3.8317059702075125 / (2 * size)) ** 2)
        assert (
            cross_sections.facet(np.array([null]), size)[0]
            < 1e-12 * cross_sections.facet(np.ones(1), size)[0]
        )


def test_points_shine_along_their_normals_and_the_same_from_either_end():
    cloud = facing(12)
    settings = cross_sections.DEFAULTS | {"blades": "diffuse"}
    view = seen(A, cloud)
    way = np.array(A.position_m) - view.places
    cosine = (way * view.normals).sum(axis=2) / np.linalg.norm(way, axis=2)
    np.testing.assert_allclose(
        cross_sections.visible(settings, view) ** 2,
        4 * np.maximum(cosine, 0),
        rtol=1e-9,
        atol=1e-15,
    )
    back = replace(link(B, A), frequency_hz=A.frequency_hz)
    ways = [
        cross_sections.visible(cross_sections.DEFAULTS, seen(each, cloud)) for each in (LINK, back)
    ]
    np.testing.assert_allclose(*ways, rtol=1e-12)
    # A link whose ends stand together is a station.
    beside = link(replace(A, name="A'"), A)
    np.testing.assert_allclose(
        cross_sections.visible(cross_sections.DEFAULTS, seen(beside, cloud)),
        cross_sections.visible(cross_sections.DEFAULTS, seen(A, cloud)),
        rtol=1e-7,
        atol=1e-9,
    )


def test_mean_cross_sections_are_those_of_class_and_size_and_blades_lie_below():
    cloud = replace(facing(12), record=facing(12).record | {"category": "UAV"})
    size = np.ptp(cloud.points[cloud.part == 0], axis=0).max()
    found = mean_cross_section.cross_sections(mean_cross_section.DEFAULTS, cloud, 0.061)
    mean_db = 10 * np.log10(over_looks(replace(cloud, rcs_m2=found), 0.061))
    assert mean_db == pytest.approx(-12.81 + (12.81 - 5.85) * np.log(size / 0.4) / np.log(4))
    blades = cloud.part == 1
    assert 10 * np.log10(found[blades].sum() / found[~blades].sum()) == pytest.approx(-15.0)
    np.testing.assert_allclose(np.ptp(found[blades] / cloud.rcs_m2[blades]), 0, atol=1e-15)
    stated = mean_cross_section.cross_sections(
        {"dbsm": {"Thing": 3.0}, "blades_db": 0.0}, cloud, 0.061
    )
    assert over_looks(replace(cloud, rcs_m2=stated), 0.061) == pytest.approx(10**0.3)


def test_the_log_normal_factor_keeps_the_mean_and_is_one_draw():
    settings = fluctuation.DEFAULTS | {"pattern": False, "spread_db": 3.0}
    view = seen()
    drawn = [
        fluctuation.visible(settings, view, np.random.default_rng(seed)) for seed in range(4000)
    ]
    assert all(np.ptp(factor) == 0 for factor in drawn)
    assert np.mean([factor[0, 0] ** 2 for factor in drawn]) == pytest.approx(1, abs=0.05)
    assert np.std([20 * np.log10(factor[0, 0]) for factor in drawn]) == pytest.approx(3.0, abs=0.15)


def test_a_car_shows_each_side_its_lobe_and_a_link_the_bisectors():
    cloud, _ = target(np.random.default_rng(1))
    cloud = replace(cloud, record=cloud.record | {"category": "Vehicle"})
    settings = fluctuation.DEFAULTS | {"spread_db": 0.0}
    level = {
        "z_m": 0.0,
        "vx_mps": 0.0,
        "vy_mps": 0.0,
        "vz_mps": 0.0,
        "pitch_rad": 0.0,
        "roll_rad": 0.0,
    }
    far = 1000.0
    # Front, left, back and right at the lobe's zenith angle.
    for azimuth, zenith, peak in (
        (0, 71.75, 15.52),
        (90, 79.7, 20.75),
        (180, 79.65, 14.56),
        (270, 79.7, 20.75),
    ):
        a, z = np.radians([azimuth, zenith])
        # The body's front is +y, and its left -x.
        place = far * np.array([-np.sin(a) * np.sin(z), np.cos(a) * np.sin(z), np.cos(z)])
        station = replace(A, position_m=tuple(place))
        view = seen(station, cloud, x_m=0.0, y_m=0.0, yaw_rad=0.0, **level)
        factor = fluctuation.visible(settings, view, np.random.default_rng(1))
        assert 20 * np.log10(factor[0, 0]) == pytest.approx(peak - 11.25, abs=1e-6)


@pytest.mark.parametrize(
    "environment, flat_m, height_m, expected",
    [
        ("UMa", 10.0, 5.0, 1.0),
        ("UMa", 100.0, 1.5, 0.18 + np.exp(-100 / 63) * 0.82),
        ("UMa", 700.0, 120.0, 1.0),
        ("UMi", 100.0, 10.0, 0.18 + np.exp(-100 / 36) * 0.82),
        ("RMa", 510.0, 5.0, np.exp(-0.5)),
        ("RMa", 5000.0, 41.0, 1.0),
    ],
)
def test_targets_are_in_sight_with_the_tables_probability(environment, flat_m, height_m, expected):
    assert line_of_sight.probability(environment, flat_m, height_m) == pytest.approx(expected)


def test_a_blocked_look_loses_both_ways_and_is_blocked_as_often_as_said():
    view = seen(x_m=100.0, y_m=0.0, z_m=1.5)
    settings = line_of_sight.DEFAULTS | {"blocked_db": 10.0}
    rng = np.random.default_rng(1)
    drawn = Counter(
        float(line_of_sight.visible_one_way(settings, view, rng)[0, 0]) for _ in range(3000)
    )
    assert set(drawn) == {1.0, 0.1}
    assert drawn[1.0] / 3000 == pytest.approx(
        line_of_sight.probability("UMa", 100.0, 1.5), abs=0.03
    )


def test_beams_miss_by_the_drawn_angles_and_keep_their_range():
    view = seen()
    settings = pointing_error.DEFAULTS | {"sigma_deg": 1.0, "update_s": 0.02}
    drawn = [
        pointing_error.beams(settings, view, np.random.default_rng(seed)) for seed in range(300)
    ]
    np.testing.assert_allclose(drawn[0].starts_s, [0.0, 0.02, 0.04])
    place = np.array(A.position_m)
    course = np.array([view.row[f"v{axis}_mps"] for axis in "xyz"])
    away = view.origin_m + drawn[0].starts_s[:, None] * course - place
    found = np.stack([each.aims_m for each in drawn]) - place
    np.testing.assert_allclose(
        np.linalg.norm(found, axis=2), np.linalg.norm(away, axis=1)[None].repeat(300, 0)
    )
    azimuth = np.degrees(
        np.arctan2(found[..., 1], found[..., 0]) - np.arctan2(away[:, 1], away[:, 0])
    )
    assert np.std(azimuth) == pytest.approx(1.0, abs=0.1)
    rise = np.degrees(np.arcsin(found[..., 2] / np.linalg.norm(found, axis=2)))
    level = np.degrees(np.arcsin(away[:, 2] / np.linalg.norm(away, axis=1)))
    assert np.std(rise - level) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("polarisation", ["vertical", "horizontal"])
def test_the_ground_reflects_as_fresnel_says_from_the_mirror_image(polarisation):
    view = seen()
    settings = ground_reflection.DEFAULTS | {"permittivity": 7.0, "conductivity_s_m": 0.02}
    (path,) = ground_reflection.paths(settings | {"polarisation": polarisation}, view)
    frequency = A.frequency_hz + 15.5 * 120e3
    epsilon = 7.0 - 1j * 0.02 / (2 * np.pi * frequency * 8.8541878128e-12)
    place = np.array(A.position_m)
    # The ray's foot divides the way as both heights do.
    foot = place + (view.places - place) * (place[2] / (place[2] + view.places[..., 2]))[..., None]
    foot[..., 2] = 0.0
    length = np.linalg.norm(foot - place, axis=2) + np.linalg.norm(view.places - foot, axis=2)
    np.testing.assert_allclose(np.linalg.norm(path.places - place, axis=2), length, rtol=1e-12)
    falls = np.arccos(place[2] / np.linalg.norm(foot - place, axis=2)).astype(complex)
    breaks = np.arcsin(np.sin(falls) / np.sqrt(epsilon))
    expected = -np.sin(falls - breaks) / np.sin(falls + breaks)
    if polarisation == "vertical":
        expected = np.tan(falls - breaks) / np.tan(falls + breaks)
    np.testing.assert_allclose(path.coefficient, expected, rtol=1e-9)
    np.testing.assert_allclose(path.station_m, place * [1, 1, -1])


def test_ground_that_is_not_given_is_medium_dry_at_the_carrier():
    assert ground_reflection.ground(ground_reflection.DEFAULTS, 1e9) == (15.0, 0.035)
    assert ground_reflection.ground(ground_reflection.DEFAULTS, 4.9e9) == pytest.approx(
        (12.8, 0.467), rel=2e-3
    )
    assert ground_reflection.ground(ground_reflection.DEFAULTS | {"permittivity": 3.0}, 1e9) == (
        3.0,
        0.035,
    )


def test_rough_ground_loses_its_coherent_part_as_heights_say():
    view = seen()
    settings = ground_reflection.DEFAULTS | {"roughness_m": 0.01}
    (smooth,), (rough,) = (
        ground_reflection.paths(settings | {"roughness_m": r}, view) for r in (0.0, 0.01)
    )
    ray = smooth.places - np.array(A.position_m)
    sine = -ray[..., 2] / np.linalg.norm(ray, axis=2)
    wave = 2 * np.pi * (A.frequency_hz + 15.5 * 120e3) / SPEED_OF_LIGHT
    # Heights whose phases are those of sea waves of random amplitude: the mean of exp(j 2 k sin psi
    # h).
    angle = 2 * np.pi * (np.arange(64) + 0.5) / 64
    amplitude = stats.halfnorm(scale=np.sqrt(2) * 0.01).ppf((np.arange(4000) + 0.5) / 4000)
    for n, point in ((0, 0), (5, 4)):
        heights = amplitude[:, None] * np.sin(angle)
        mean = np.exp(2j * wave * sine[n, point] * heights).mean()
        assert abs(rough.coefficient[n, point] / smooth.coefficient[n, point]) == pytest.approx(
            abs(mean), rel=1e-2
        )


def test_a_facade_reflects_where_the_shortest_way_by_its_plane_meets_it():
    facade = [30.0, 60.0, -80.0, 8.0, 12.0]
    rng = np.random.default_rng(3)
    places = rng.uniform([-40, -30, 1], [110, 90, 40], (1, 200, 3))
    station = np.array(A.position_m)
    images, sine, reflected = walls.mirrored(facade, places, station)
    angle = np.radians(facade[2])
    foot = np.array([30.0, 60.0, 0.0])
    normal = np.array([np.cos(angle), np.sin(angle), 0.0])
    along = np.array([-np.sin(angle), np.cos(angle), 0.0])
    up = np.array([0.0, 0.0, 1.0])
    for l, point in enumerate(places[0]):  # noqa: E741
        before = ((station - foot) @ normal) * ((point - foot) @ normal) > 0
        if not before:
            assert not reflected[0, l]
            continue

        def way(q, point=point):
            spot = foot + q[0] * along + q[1] * up
            return np.linalg.norm(spot - station) + np.linalg.norm(point - spot)

        best = minimize(way, [0.0, 5.0], tol=1e-12)
        assert np.linalg.norm(images[0, l] - station) == pytest.approx(best.fun, rel=1e-9)
        spot = foot + best.x[0] * along + best.x[1] * up
        assert sine[0, l] == pytest.approx(
            abs((spot - station) @ normal) / np.linalg.norm(spot - station), rel=1e-4
        )
        if min(abs(abs(best.x[0]) - 4.0), abs(best.x[1]), abs(best.x[1] - 12.0)) > 1e-3:
            assert reflected[0, l] == (abs(best.x[0]) < 4.0 and 0.0 < best.x[1] < 12.0)
    assert 0 < reflected.sum() < 50


def test_dark_facades_carry_nothing_and_lit_ones_the_walls_coefficient():
    view = seen()
    settings = walls.DEFAULTS | {
        "facades": [[30.0, 60.0, -80.0, 200.0, 90.0], [900.0, 60.0, -80.0, 1.0, 1.0]]
    }
    lit, dark = walls.paths(settings, view)
    assert (abs(lit.coefficient) > 0.05).all() and dark.coefficient == 0.0
    np.testing.assert_allclose(
        np.linalg.norm(lit.station_m - view.places, axis=2),
        np.linalg.norm(lit.places - np.array(A.position_m), axis=2),
        rtol=1e-12,
    )


@pytest.mark.parametrize("station", [A, LINK])
def test_routes_show_the_sides_that_their_images_see(station):
    view = seen(station)
    images = [np.array([1.0, 2.0, -10.0]), np.array([5.0, -2.0, 9.0])]
    paths = [
        ImagePath(view.places, 1.0, images[0], ImagePath(view.places, 1.0, images[1])),
        ImagePath(view.places, 0.5),
    ]

    def weight(view: View, one_sided: bool) -> np.ndarray:
        """A follower's factor that is no product of both ends' factors, and one of all others that
        tells no place from another.
        """
        ends = [side(end.station.position_m) for end in view.ends()]
        return np.full(view.places.shape[:2], ends[0] + 5 * ends[-1] if one_sided else 3.0)

    def side(place) -> float:
        return 2.0 + np.sin(np.sum(np.square(place)))

    found = reflected_aspect.routes(reflected_aspect.DEFAULTS, view, paths, weight)
    assert found.shape == (3, 3, *view.places.shape[:2])
    sender = station.transmitter or station
    out = [
        side(sender.position_m),
        side(images[1] if station is LINK else images[0]),
        side(sender.position_m),
    ]
    back = [side(station.position_m), side(images[0]), side(station.position_m)]
    expected = np.empty((3, 3))
    for a, b in np.ndindex(expected.shape):
        # A path without an image of the station shows the direct one's side: it is what a building
        # takes from the direct path, and must cancel it where it is blocked.
        if a == b or 1 not in (a, b):
            expected[a, b] = out[a] + 5 * back[b]
        else:
            expected[a, b] = np.sqrt(6 * out[a] * 6 * back[b])
    np.testing.assert_allclose(found[..., 0, 0], 3.0 * expected, rtol=1e-12)


def test_companions_stand_clear_of_each_other_and_fly_alike():
    cloud, row = target(np.random.default_rng(1))
    record = cloud.record | {
        "published": {
            "vx_abs_max": 5.0,
            "vy_abs_max": 5.0,
            "vz_abs_max": 1.0,
            "freq_lo_hz": 50.0,
            "freq_hi_hz": 60.0,
        }
    }
    cloud = replace(cloud, record=record)
    settings = companions.DEFAULTS | {"count": [3, 3], "spread_m": 2.0}
    found = companions.companions(settings, cloud, row, {}, np.random.default_rng(2))
    recorded = companions.record(settings, network(), row, np.random.default_rng(2))
    assert (
        recorded
        == {"companions": [other.subtype for other, _ in found]}
        == {"companions": ["Thing"] * 3}
    )
    places = np.array(
        [[r[f"{axis}_m"] for axis in "xyz"] for r in (row, *(mine for _, mine in found))]
    )
    reach = np.linalg.norm(cloud.points, axis=1).max()
    apart = np.linalg.norm(places[:, None] - places, axis=2)[~np.eye(4, dtype=bool)]
    assert (apart > 2 * reach).all()
    assert len({mine["model"] for _, mine in found}) == 3
    with pytest.raises(InputError, match="no room"):
        companions.companions(
            settings | {"spread_m": 0.01}, cloud, row, {}, np.random.default_rng(2)
        )


@pytest.mark.parametrize("flock", [True, False])
def test_a_car_beside_a_target_stands_on_the_ground_drives_forward_and_rolls(flock):
    drone, row = target(np.random.default_rng(1))
    record = {
        "subtype": "Car",
        "category": "Vehicle",
        "origin_height_m": 0.7,
        "wheel_diameter_m": 0.6,
        "published": {"speed_lo": 8.0, "speed_hi": 20.0},
    }
    car = replace(drone, kinds=("body", "wheel"), record=drone.record | record)
    row |= {"vx_mps": -3.0, "vy_mps": 4.0, "vz_mps": 2.0, "yaw_rad": 0.6}
    row |= {"subtype": "Car", "category": "Vehicle"} if flock else {}
    asked = companions.DEFAULTS | {
        "count": [3, 3],
        "spread_m": 20.0,
        "speed_mps": 0.1,
        "subtypes": ["Car"],
    }
    found = companions.companions(
        asked, car if flock else drone, row, {"Car": car}, np.random.default_rng(3)
    )
    for _, mine in found:
        assert mine["z_m"] == 0.7 and mine["vz_mps"] == 0
        speed = np.hypot(mine["vx_mps"], mine["vy_mps"])
        front = -np.sin(mine["yaw_rad"]), np.cos(mine["yaw_rad"])
        assert (mine["vx_mps"], mine["vy_mps"]) == pytest.approx(tuple(speed * np.array(front)))
        assert mine["rate_hz"] * np.pi * 0.6 == pytest.approx(speed)
        # In a column as fast as its target, in a street at a speed and in a direction of its own.
        assert (abs(speed - 5.0) < 0.5) == (mine["yaw_rad"] == 0.6) == flock


def test_what_hides_a_target_from_a_station_hides_it_on_that_station_s_way_of_a_link():
    radio = linked()
    seen_factors = set()
    for model in range(20):
        cloud, row = target(np.random.default_rng(1), model=model, x_m=60.0, y_m=60.0, z_m=1.5)
        asked = scene({"line_of_sight": {"blocked_db": 10.0}}, radio)
        samples = [
            SceneSample(asked, observe(asked, end, cloud, row)) for end in (A, B, LINK, link(B, A))
        ]
        own, other, there, back = (sample.weight(sample.view)[0, 0] for sample in samples)
        assert there == back == pytest.approx(np.sqrt(own * other))
        seen_factors.add(float(there))
    assert sorted(seen_factors) == pytest.approx([0.1, np.sqrt(0.1), 1.0])


def test_both_directions_of_a_link_share_the_drawn_cross_section_and_stations_do_not():
    radio, (cloud, row) = linked(), target(np.random.default_rng(1))
    asked = scene({"fluctuation": {"pattern": False}}, radio)
    samples = [
        SceneSample(asked, observe(asked, end, cloud, row)) for end in (LINK, link(B, A), A, B)
    ]
    there, back, own, other = (sample.weight(sample.view)[0, 0] for sample in samples)
    assert there == back and len({there, own, other}) == 3


@pytest.mark.parametrize(
    ("faces", "k1", "k2"),
    [(VEHICLE, 6.0, 1.65), (LARGE_UAV, 6.05, 1.33)],
    ids=["vehicle", "large craft"],
)
def test_the_loss_by_the_bistatic_angle_is_that_worked_by_hand(faces, k1, k2):
    """The loss of TR 38.901 is 3 sin(beta / 2), or that of a target with faces.

    The latter is k1 sin(k2 beta / 2) - 5 lg cos(beta / 2).
    """
    angle = np.radians([0.0, 60.0, 120.0])
    half = np.array([0.0, 30.0, 60.0])
    assert fluctuation.bistatic_loss_db(None, angle) == pytest.approx([0.0, 1.5, 2.598], abs=1e-3)
    expected = k1 * np.sin(np.radians(k2 * half)) - 5 * np.log10(np.cos(np.radians(half)))
    np.testing.assert_allclose(fluctuation.bistatic_loss_db(faces, angle), expected, atol=1e-12)


def test_the_way_from_mast_to_mast_is_the_sum_over_both_arrays_elements():
    radio = linked(receive=(3, 2))
    element = Element()
    view = seen(LINK, radio=radio, element=element)
    found, delay_s = crossing(view, A, replace(B, frequency_hz=A.frequency_hz))
    distance = np.linalg.norm(np.subtract(A.position_m, B.position_m))
    assert delay_s == pytest.approx(distance / SPEED_OF_LIGHT)
    f = A.frequency_hz + np.arange(32) * 120e3
    ends = ((A, B, radio.transmit), (B, A, radio.receive))
    sums = [
        reference_effects.one_way(
            radio,
            replace(end, frequency_hz=A.frequency_hz),
            shape,
            np.array([other.position_m]),
            view.origin_m,
            0.0,
            False,
            False,
        )[0]
        for end, other, shape in ends
    ]
    # Each sum fell with the distance, and the amplitude from mast to mast falls once.
    sums += [np.sqrt(gain(element, end, np.array(other.position_m))) for end, other, _ in ends]
    level = (
        np.sqrt(radio.power / 48)
        * SPEED_OF_LIGHT
        / radio.carrier_hz
        / (4 * np.pi)
        * distance
        * np.prod(sums)
    )
    np.testing.assert_allclose(found, level * np.exp(-2j * np.pi * f * delay_s), rtol=1e-9)
