"""A town's laws against numbers worked out by hand.

They are of two bounces between parallel walls, of every material, and of buildings as files state
them.
"""

import json

import numpy as np
import pytest

from lowalt.extensions.town import image_paths
from lowalt.extensions.town.buildings import read
from lowalt.extensions.town.facets import town
from lowalt.extensions.town.footprints import moved
from lowalt.extensions.town.materials import MATERIALS, properties
from lowalt.extensions.town.town import DEFAULTS
from towns import ORIGIN, block, mitsuba, ply

P2040 = {
    "concrete": (5.24, 0.0, 0.0462, 0.7822), "brick": (3.91, 0.0, 0.0238, 0.16),
    "plasterboard": (2.73, 0.0, 0.0085, 0.9395), "wood": (1.99, 0.0, 0.0047, 1.0718),
    "glass": (6.31, 0.0, 0.0036, 1.3394), "ceiling_board": (1.48, 0.0, 0.0011, 1.075),
    "chipboard": (2.58, 0.0, 0.0217, 0.78), "plywood": (2.71, 0.0, 0.33, 0.0), "marble": (7.074, 0.0, 0.0055, 0.9262),
    "floorboard": (3.66, 0.0, 0.0044, 1.3515), "metal": (1.0, 0.0, 1e7, 0.0),
    "very_dry_ground": (3.0, 0.0, 0.00015, 2.52), "medium_dry_ground": (15.0, -0.1, 0.035, 1.63),
    "wet_ground": (30.0, -0.4, 0.15, 1.3),
}  # fmt: skip
"""a, b, c and d of ITU-R P.2040-3, Table 3: permittivity a f^b, conductivity c f^d in S/m, f in
GHz.
"""


def test_the_materials_are_those_of_the_recommendation():
    assert set(MATERIALS) == set(P2040)


@pytest.mark.parametrize("name", P2040)
def test_a_material_has_its_own_four_numbers(name):
    a, b, c, d = P2040[name]
    for ghz in (60.0, 80.0) if name == "floorboard" else (4.0, 8.0):
        permittivity, conductivity = properties(name, ghz * 1e9, "test")
        assert permittivity == pytest.approx(a * ghz**b, rel=1e-12)
        assert conductivity == pytest.approx(c * ghz**d, rel=1e-12)


def test_a_lossy_wall_s_permittivity_has_the_imaginary_part_of_the_recommendation():
    corners = block(0.0, 0.0, 2.0, 2.0, 2.0)
    city = town(corners, np.zeros(len(corners), int), ("brick",), "wet_ground")
    walls = image_paths.epsilons(city, 5e9, "test")
    # P.2040, equation 9b: epsilon = a f^b - j 17.98 sigma / f, with f in GHz, for fields exp(+j 2
    # pi f t).
    assert walls[0] == pytest.approx(3.91 - 17.98j * 0.0238 * 5**0.16 / 5, rel=1e-3)
    assert walls[-1] == pytest.approx(30 * 5**-0.4 - 17.98j * 0.15 * 5**1.3 / 5, rel=1e-3)


def test_two_bounces_between_parallel_walls_move_the_images_by_twice_the_street():
    """A street 30 m wide, its facades at x = 0 and x = 30.

    Images lie 60 m away, on the side of the last wall seen.
    """
    corners = np.concatenate(
        [block(-1.0, 0.0, 2.0, 400.0, 60.0), block(31.0, 0.0, 2.0, 400.0, 60.0)]
    )
    city = town(corners, np.zeros(len(corners), int), ("concrete",), "medium_dry_ground")
    station = np.array([10.0, -40.0, 20.0])
    place = np.array([[[17.0, 35.0, 25.0]]])
    rays = image_paths.rays_to(place, 0.0)
    routes = image_paths.reflected(
        city, image_paths.epsilons(city, 4.9e9, "test"), station, place, rays, 2
    )
    facades = [
        route
        for route in routes
        if len(route.facets) == 2 and len(city.facets.offset) - 1 not in route.facets
    ]
    # Station, wall at 0, wall at 30, target: the station sees the target at x = 17 - 60, the target
    # sees it at 10 + 60.
    seen = {(round(route.images[0, 0, 0], 6), round(route.station_m[0], 6)) for route in facades}
    assert seen == {(17.0 - 60.0, 10.0 + 60.0), (17.0 + 60.0, 10.0 - 60.0)}
    for route in facades:
        length = np.linalg.norm(route.images[0, 0] - station)
        assert length == pytest.approx(np.linalg.norm(route.station_m - place[0, 0]))


def collection(path, *features):
    path.write_text(json.dumps({"type": "FeatureCollection", "features": list(features)}))
    return path


def outline(tags, *rings):
    """A building whose rings (K, 2) are metres east and north of ORIGIN: the outer one, then holes."""
    coordinates = []
    for ring in rings:
        closed = [*ring, ring[0]]
        coordinates.append([moved(ORIGIN, corner) for corner in closed])
    geometry = {"type": "Polygon", "coordinates": coordinates}
    return {"type": "Feature", "properties": {"building": "yes", **tags}, "geometry": geometry}


def square(x, y, side):
    """The corners (4, 2) m of a square whose first corner is x, y."""
    return [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]


def read_town(path, **settings):
    return read(DEFAULTS | {"buildings": str(path), "origin": ORIGIN} | settings)


def areas(corners):
    """The areas (F,) m2 of triangles, and their unit normals (F, 3)."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice = np.linalg.norm(across, axis=1)
    return twice / 2, across / twice[:, None]


def test_a_height_in_feet_is_read_in_feet(tmp_path):
    path = collection(tmp_path / "town.geojson", outline({"height": "100 ft"}, square(0, 0, 20)))
    assert read_town(path).facts["high_m"][2] == pytest.approx(30.48)


def test_a_mesh_in_feet_is_read_in_feet(tmp_path):
    path = ply(tmp_path / "town.ply", [(0.0, 0.0, 100.0, 50.0, 40.0)])
    facts = read(DEFAULTS | {"buildings": str(path), "unit": "ft"}).facts
    np.testing.assert_allclose(facts["high_m"], [15.24, 7.62, 12.192], rtol=1e-6)


def test_a_courtyard_has_walls_that_face_it_and_no_roof(tmp_path):
    """A block of 60 m with a court of 20 m in its middle: four walls outside, four around the court.

    The rings are wound as GeoJSON does not ask for: the outer one clockwise, the hole not.
    """
    court = outline({"height": 10}, square(0, 0, 60)[::-1], square(20, 20, 20))
    found = read_town(collection(tmp_path / "town.geojson", court))
    assert found.facts["walls"] == 8
    area, normal = areas(found.corners)
    level = abs(normal[:, 2]) > 0.5
    assert area[level].sum() == pytest.approx(60.0**2 - 20.0**2, rel=1e-3)
    assert area[~level].sum() == pytest.approx(10.0 * 4 * (60.0 + 20.0), rel=1e-3)
    middle = found.corners.mean(axis=1) - np.array([30.0, 30.0, 0.0])
    inner = ~level & (abs(middle[:, :2]).max(axis=1) < 15.0)
    away = (normal * middle).sum(axis=1)
    assert inner.sum() == 8
    assert (away[inner] < 0.0).all()
    assert (away[~level & ~inner] > 0.0).all()


def test_a_ray_reaches_a_courtyard_from_above_alone(tmp_path):
    court = outline({"height": 10}, square(0, 0, 60), square(20, 20, 20)[::-1])
    city = read_town(collection(tmp_path / "town.geojson", court)).town
    target = np.array([[[30.0, 30.0, 2.0]]])
    rays = image_paths.rays_to(target, 0.0)
    nothing = np.empty(0, np.int64)
    for station, free in (([30.0, 33.0, 80.0], True), ([30.0, 150.0, 20.0], False)):
        assert image_paths.seen(city, np.array(station), rays, nothing)[0, 0] == free


def test_a_building_over_a_passage_begins_at_its_least_height(tmp_path):
    """A bridge from 6 to 10 m: four walls of 4 m, a roof, and an underside that faces down."""
    bridge = outline({"height": 10, "min_height": 6}, square(0, 0, 20))
    tower = outline({"height": 30}, square(60, 0, 20))
    found = read_town(collection(tmp_path / "town.geojson", bridge, tower))
    of_bridge = found.corners[found.corners[..., 0].max(axis=1) < 40.0]
    assert of_bridge[..., 2].min() == 6.0
    assert of_bridge[..., 2].max() == 10.0
    area, normal = areas(of_bridge)
    assert area[normal[:, 2] < -0.5].sum() == pytest.approx(20.0**2, rel=1e-3)
    assert area[abs(normal[:, 2]) < 0.5].sum() == pytest.approx(4 * 20.0 * 4.0, rel=1e-3)
    target = np.array([[[10.0, 10.0, 2.0]]])
    rays = image_paths.rays_to(target, 0.0)
    nothing = np.empty(0, np.int64)
    assert image_paths.seen(found.town, np.array([10.0, -50.0, 4.0]), rays, nothing)[0, 0]
    assert not image_paths.seen(found.town, np.array([10.0, 10.0, 50.0]), rays, nothing)[0, 0]


def test_the_origin_is_the_point_of_the_file_that_becomes_zero(tmp_path):
    """A building 300 m east and 200 m north of the origin stands at x = 300, y = 200."""
    path = collection(tmp_path / "town.geojson", outline({"height": 9}, square(300, 200, 20)))
    np.testing.assert_allclose(read_town(path).facts["low_m"], [300.0, 200.0, 0.0], atol=0.02)
    east = moved(ORIGIN, (100.0, 0.0))
    facts = read_town(path, origin=east).facts
    np.testing.assert_allclose(facts["low_m"], [200.0, 200.0, 0.0], atol=0.02)
    mesh = ply(tmp_path / "town.ply", [(300.0, 200.0, 20.0, 20.0, 9.0)])
    facts = read(DEFAULTS | {"buildings": str(mesh), "origin": [100.0, 50.0]}).facts
    np.testing.assert_allclose(facts["low_m"], [190.0, 140.0, 0.0], atol=1e-6)


def test_a_draft_puts_the_middle_of_the_town_at_that_of_the_stations():
    there = moved(ORIGIN, (250.0, -120.0))
    assert there[0] > ORIGIN[0]
    assert there[1] < ORIGIN[1]
    # A degree of latitude is 111.2 km at 48 degrees, one of longitude 74.5 km.
    assert there[0] - ORIGIN[0] == pytest.approx(250.0 / 74_400.0, rel=3e-3)
    assert there[1] - ORIGIN[1] == pytest.approx(-120.0 / 111_200.0, rel=3e-3)


def test_the_steps_of_a_mitsuba_transform_act_one_after_the_other(tmp_path):
    """A unit cube, scaled to 20 x 30 x 18 m and then moved to x = 40, y = -50."""
    path = mitsuba(tmp_path / "scene.xml", [(40.0, -50.0, 20.0, 30.0, 18.0)])
    facts = read(DEFAULTS | {"buildings": str(path)}).facts
    np.testing.assert_allclose(facts["low_m"], [30.0, -65.0, 0.0], atol=1e-5)
    np.testing.assert_allclose(facts["high_m"], [50.0, -35.0, 18.0], atol=1e-5)


def test_metal_reflects_all_and_glass_little_at_right_angles():
    """A wall of glass, |n - 1| / |n + 1| with n = sqrt(6.31) is 0.43; one of metal, 1."""
    for material, size in (("metal", 1.0), ("glass", (6.31**0.5 - 1.0) / (6.31**0.5 + 1.0))):
        corners = block(0.0, 41.0, 400.0, 2.0, 200.0)
        city = town(corners, np.zeros(len(corners), int), (material,), "medium_dry_ground")
        station = np.array([0.0, 0.0, 50.0])
        target = np.array([[[0.0, 20.0, 50.0]]])
        epsilon = image_paths.epsilons(city, 4.9e9, "test")
        rays = image_paths.rays_to(target, 0.0)
        routes = image_paths.reflected(city, epsilon, station, target, rays, 1)
        (wall,) = [route for route in routes if route.facets[0] != len(city.facets.offset) - 1]
        np.testing.assert_allclose(wall.images[0, 0], [0.0, 60.0, 50.0], atol=1e-9)
        np.testing.assert_allclose(wall.station_m, [0.0, 80.0, 50.0], atol=1e-9)
        assert wall.coefficient[0, 0].real == pytest.approx(-size, abs=2e-3)
        assert abs(wall.coefficient[0, 0]) == pytest.approx(size, abs=2e-3)
