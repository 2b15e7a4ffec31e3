"""A town: facets, blockage, reflections and diffraction against slow truths.

These are brute force, closed forms and the simpler effects.
"""

import itertools
import json
import math

import numpy as np
import pytest
from scipy.ndimage import maximum_filter1d
from scipy.special import fresnel

from linked_routes import link_of, seen_paths
from lowalt.__main__ import main
from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.echo.radar import radar
from lowalt.extensions.town import edge_loops, image_paths, town
from lowalt.extensions.town.buildings import read
from lowalt.extensions.town.facets import town as made
from lowalt.extensions.town.materials import MATERIALS, named, properties
from lowalt.files.errors import InputError
from lowalt.scene.chain import received_signal
from lowalt.scene.checks import CheckedScene, refuse_same_waves
from lowalt.scene.effects import module_of
from lowalt.scene.effects.channel import ground_reflection, walls
from lowalt.scene.trust import refuse_effects
from scenes import A, network, scene, target, view_of
from shown_meshes import ply as ply_bytes
from towns import BOXES, ORIGIN, block, geojson, mitsuba, ply

NETWORK = network()
HZ = 4.9e9
WAVELENGTH_M = SPEED_OF_LIGHT / HZ
MAST = np.array([-60.0, 3.0, 30.0])


def built(boxes, material="concrete"):
    """A town of boxes (x, y, width, depth, height) on medium dry ground."""
    corners = np.concatenate([block(*box) for box in boxes])
    return made(corners, np.zeros(len(corners), int), (material,), "medium_dry_ground")


def crosses(start, end, triangle):
    """Whether a segment crosses a triangle (3, 3): the slow reference solves a 3 x 3 system."""
    a, b, c = triangle
    matrix = np.column_stack([end - start, a - b, a - c])
    if abs(np.linalg.det(matrix)) < 1e-12:
        return False
    t, u, v = np.linalg.solve(matrix, a - start)
    return 1e-9 < t < 1 - 1e-9 and u >= 0 and v >= 0 and u + v <= 1


def test_direct_rays_are_blocked_as_by_every_triangle():
    rng = np.random.default_rng(1)
    city = built(BOXES)
    places = rng.uniform([-80, -80, 0.5], [80, 80, 40], (50, 8, 3))
    lit = image_paths.seen(city, MAST, image_paths.rays_to(places, 0.0), np.empty(0, np.int64))
    triangles = np.concatenate([block(*box) for box in BOXES])
    expected = [
        not any(crosses(MAST, end, triangle) for triangle in triangles)
        for end in places.reshape(-1, 3)
    ]
    np.testing.assert_array_equal(lit.reshape(-1), expected)
    assert 0.2 < lit.mean() < 0.9


def edge_field(nu, edge=0):
    """The field behind a screen of whose edges (top, left, right) all but one are far off.

    No wave passes by them.
    """
    rows = np.full((3, len(nu)), 1e15)
    result = np.empty(len(nu), np.complex128)
    rows[edge] = nu
    edge_loops.fields(rows, result)
    return result


def edge_nu(start, edge, ends):
    """The parameter nu of an edge that a wave passes from start to ends (..., 3) m.

    It follows from how much longer its way is.
    """
    direct_m = np.linalg.norm(ends - start, axis=-1)
    detour_m = np.linalg.norm(edge - start) + np.linalg.norm(ends - edge, axis=-1) - direct_m
    return 2.0 * np.sqrt(detour_m / WAVELENGTH_M)


def kirchhoff_sum(start, end, half_width_m, top_m):
    """The field behind a screen x = 0, |y| < half_width_m, z < top_m, over that in free space.

    It is a sum over the screen's plane.

    The screen fades out far below its top, where a sharp end would diffract.
    """
    step = 0.01
    y = np.arange(-half_width_m + step / 2, half_width_m, step)
    below_m = np.arange(step / 2, 60.0, step)
    fade = np.cos(0.5 * np.pi * np.clip((below_m - 20.0) / 40.0, 0.0, 1.0)) ** 2
    total = 0.0
    for part, weight in zip(np.array_split(below_m, 60), np.array_split(fade, 60), strict=True):
        places = np.stack(np.broadcast_arrays(0.0, y[:, None], top_m - part), axis=-1)
        out_m = np.linalg.norm(places - start, axis=-1)
        on_m = np.linalg.norm(places - end, axis=-1)
        total += (
            np.exp(-2j * np.pi * (out_m + on_m) / WAVELENGTH_M) / (out_m * on_m) * weight
        ).sum() * step**2
    direct_m = np.linalg.norm(end - start)
    free = np.exp(-2j * np.pi * direct_m / WAVELENGTH_M) / direct_m
    slant = abs(end[0] - start[0]) / direct_m
    return 1.0 - 1j / WAVELENGTH_M * slant * total / free


def reference_paths(scene, mast, place, order):
    """Every path of 1 to `order` facets to one place.

    They are images of the mast, and each leg is tested against every triangle.
    """
    facets = scene.facets
    corners = [facets.triangles[a:b] for a, b in itertools.pairwise(facets.first)]
    triangles = [
        (k, np.array([t[:3], t[:3] + t[3:6], t[:3] + t[6:]]))
        for k, rows in enumerate(corners)
        for t in rows
    ]

    def mirror(k, point):
        return point - 2 * (facets.normal[k] @ point - facets.offset[k]) * facets.normal[k]

    found = set()
    for count in range(1, order + 1):
        for route in itertools.product(range(len(facets.offset)), repeat=count):
            if any(a == b for a, b in itertools.pairwise(route)):
                continue
            images = [mast]
            for k in route:
                images.append(mirror(k, images[-1]))
            points = [place]
            end = place
            fits = True
            for k, image in zip(route[::-1], images[:0:-1], strict=True):
                here = facets.normal[k] @ end - facets.offset[k]
                there = facets.normal[k] @ image - facets.offset[k]
                if here * there >= 0:
                    fits = False
                    break
                end = end + here / (here - there) * (image - end)
                points.append(end)
                rows = corners[k]
                on = [
                    np.linalg.lstsq(np.column_stack([t[3:6], t[6:]]), end - t[:3], rcond=None)[0]
                    for t in rows
                ]
                fits &= not rows.size or any(u >= 0 and v >= 0 and u + v <= 1 for u, v in on)
            if not fits:
                continue
            points = [*points, mast][::-1]
            at = (None, *route, None)
            if not any(
                crosses(start, stop, triangle)
                for leg, (start, stop) in enumerate(itertools.pairwise(points))
                for k, triangle in triangles
                if k not in at[leg : leg + 2]
            ):
                found.add(route)
    return found


def test_reflected_paths_are_those_of_every_pair_of_facets():
    rng = np.random.default_rng(2)
    city = built(BOXES[:3])
    epsilon = image_paths.epsilons(city, HZ, "test")
    counts = []
    for place in rng.uniform([-50, -50, 1.0], [60, 50, 30], (40, 3)):
        places = place[None, None]
        routes = image_paths.reflected(
            city, epsilon, MAST, places, image_paths.rays_to(places, 0.0), 2
        )
        assert {route.facets for route in routes} == reference_paths(city, MAST, place, 2), place
        counts.append(len(routes))
        for route in routes:
            # Both images keep the path's length.
            length = np.linalg.norm(route.images[0, 0] - MAST)
            assert math.isclose(length, np.linalg.norm(route.station_m - place), rel_tol=1e-12)
            assert abs(route.coefficient[0, 0]) <= 1.0
    assert max(counts) >= 4


def test_a_wall_that_closes_no_building_reflects_on_both_sides():
    """Only the walls of closed convex buildings have an inner side, which no ray reaches."""
    closed = block(0.0, 40.0, 80.0, 2.0, 30.0)
    # A wall along x, whose winding says nothing, and the same without a roof.
    for corners, sides in ((closed[2:4], 2), (closed[2:4, ::-1], 2), (closed[:8], 2), (closed, 1)):
        city = made(corners, np.zeros(len(corners), int), ("concrete",), "medium_dry_ground")
        assert (city.facets.outward[:-1] == 0.0).all() == (sides == 2)
    sheet = made(
        block(0.0, 40.0, 2.0, 80.0, 30.0)[2:4], np.zeros(2, int), ("concrete",), "medium_dry_ground"
    )
    epsilon = image_paths.epsilons(sheet, HZ, "test")
    for side in (-1.0, 1.0):
        mast = np.array([side * 30.0, 30.0, 20.0])
        place = np.array([[[side * 40.0, 50.0, 10.0]]])
        routes = image_paths.reflected(
            sheet, epsilon, mast, place, image_paths.rays_to(place, 0.0), 1
        )
        assert {route.facets for route in routes} == reference_paths(sheet, mast, place[0, 0], 1)
        assert (0,) in {route.facets for route in routes}


def test_paths_of_many_points_are_those_of_each():
    rng = np.random.default_rng(3)
    city = built(BOXES)
    epsilon = image_paths.epsilons(city, HZ, "test")
    places = (
        np.array([5.0, -40.0, 12.0])
        + rng.uniform(-1, 1, (1, 20, 3))
        + np.linspace(0, 25, 90)[:, None, None]
    )
    together = image_paths.reflected(
        city, epsilon, MAST, places, image_paths.rays_to(places, 0.0), 2
    )
    found = {route.facets: route.coefficient for route in together}
    for n, point in itertools.product(range(0, 90, 9), range(0, 20, 5)):
        one = places[n : n + 1, point : point + 1]
        alone = image_paths.reflected(city, epsilon, MAST, one, image_paths.rays_to(one, 0.0), 2)
        assert {route.facets for route in alone} == {
            key for key, value in found.items() if value[n, point] != 0
        }
        for route in alone:
            np.testing.assert_allclose(
                found[route.facets][n, point], route.coefficient[0, 0], rtol=1e-12
            )


def test_one_wall_and_the_ground_are_the_simpler_effects(tmp_path):
    """The ground's law is that of `ground_reflection`.

    The wall's is that of `walls` where rays are level.
    """
    rng = np.random.default_rng(4)
    places = np.array([60.0, 25.0, 10.0]) + rng.uniform(-1, 1, (24, 9, 3))
    places[:, :4, 2] = A.position_m[2]
    view = view_of(NETWORK, places, np.ones(9), [60.0, 25.0, 10.0])
    path = ply(tmp_path / "wall.ply", [(20.0, -60.0, 400.0, 2.0, 800.0)])
    settings = town.DEFAULTS | {"buildings": str(path), "order": 1, "diffraction": False}
    found = town.paths(settings, view)
    assert len(found) == 2
    wall, ground = sorted(found, key=lambda each: each.station_m[2], reverse=True)
    hz = radar(NETWORK, A).centre_hz
    permittivity, conductivity = properties("concrete", hz, "test")
    facade = {
        "facades": [[20.0, -59.0, 90.0, 400.0, 800.0]],
        "permittivity": permittivity,
        "conductivity_s_m": conductivity,
    }
    by_wall = walls.paths(walls.DEFAULTS | facade, view)[0]
    by_ground = ground_reflection.paths(ground_reflection.DEFAULTS, view)[0]
    for each, expected in ((wall, by_wall), (ground, by_ground)):
        np.testing.assert_allclose(each.places, expected.places, atol=1e-12 * 1e3)
        np.testing.assert_allclose(each.station_m, expected.station_m, atol=1e-12 * 1e3)
    np.testing.assert_allclose(ground.coefficient, by_ground.coefficient, atol=1e-12)
    np.testing.assert_allclose(wall.coefficient[:, :4], by_wall.coefficient[:, :4], atol=1e-12)
    # Inclined rays have a part in the plane of incidence, which `walls` leaves out.
    off = abs(wall.coefficient[:, 4:] - by_wall.coefficient[:, 4:])
    assert 1e-9 < off.max() < 1e-3


@pytest.mark.parametrize("edge", range(3))
def test_the_field_behind_an_edge_is_fresnels_integral(edge):
    nu = np.concatenate([np.linspace(-60, 60, 5001), [0.0, 1e-9, -1e-9, 1e3, -1e4, 3e5]])
    sine, cosine = fresnel(nu)
    expected = 0.5 * (1.0 + 1.0j) * ((0.5 - cosine) - 1.0j * (0.5 - sine))
    np.testing.assert_allclose(edge_field(nu, edge), expected, atol=5e-15)


def test_a_wide_block_is_one_knife_edge_and_a_pole_nearly_none():
    wide = built([(0.0, 0.0, 2.0, 4000.0, 40.0)])
    ends = np.array([[[60.0, 3.0, 20.0]]])
    mast = np.array([-60.0, 3.0, 30.0])
    lit, field = image_paths.direct(
        wide, mast, ends, image_paths.rays_to(ends, 0.0), WAVELENGTH_M, True
    )
    assert not lit.any()
    expected = max(edge_nu(mast, np.array([x, 3.0, 40.0]), ends[0, 0]) for x in (-1.0, 1.0))
    np.testing.assert_allclose(field[0], edge_field([expected]), atol=1e-3)
    pole = built([(0.0, 3.0, 0.02, 0.02, 400.0)])
    lit, field = image_paths.direct(
        pole, mast, ends, image_paths.rays_to(ends, 0.0), WAVELENGTH_M, True
    )
    assert not lit.any()
    assert 0.9 < abs(field[0, 0]) < 1.05


@pytest.mark.parametrize(
    ("end", "half_width_m", "top_m"),
    [
        ((60.0, 0.0, 20.0), 6.0, 30.0),
        ((60.0, 3.0, 20.0), 6.0, 40.0),
        ((30.0, 0.0, 1.5), 5.0, 25.0),
        ((60.0, 2.0, 26.0), 8.0, 34.0),
        ((80.0, -9.0, 20.0), 5.0, 30.0),
    ],
)
def test_the_field_behind_a_finite_screen_is_kirchhoffs_sum(end, half_width_m, top_m):
    mast = np.array([-60.0, 0.0, 30.0])
    end = np.array(end)
    expected = kirchhoff_sum(mast, end, half_width_m, top_m)
    screen = built([(0.0, 0.0, 1e-2, 2 * half_width_m, top_m)])
    ends = end[None, None]
    field = image_paths.direct(
        screen, mast, ends, image_paths.rays_to(ends, 0.0), WAVELENGTH_M, True
    )[1][0, 0]
    assert abs(20.0 * np.log10(abs(field / expected))) < 0.2
    assert abs(np.angle(field / expected)) < 0.05


def test_the_field_among_buildings_never_jumps():
    """Where other buildings block most as a target moves on, finer steps change the field by less."""
    city = built(BOXES)
    mast = np.array([-60.0, 3.0, 30.0])
    largest = []
    for step_m in (0.02, 0.005):
        y = np.arange(-49.0, -41.0, step_m)
        ends = np.stack([np.full(len(y), 75.0), y, np.full(len(y), 1.5)], axis=1)[:, None]
        rays = image_paths.rays_to(ends, 0.0)
        field = image_paths.direct(city, mast, ends, rays, WAVELENGTH_M, True)[1][:, 0]
        # From both sides, how far a place is off the line through its two neighbours.
        ahead = abs(field[2:-1] - 2.0 * field[1:-2] + field[:-3])
        behind = abs(field[1:-2] - 2.0 * field[2:-1] + field[3:])
        level = maximum_filter1d(abs(field), round(0.4 / step_m))[1:-2]
        largest.append((np.minimum(ahead, behind) / level).max())
    assert largest[1] < 0.2 * largest[0]


def test_the_field_is_smooth_across_the_shadow_of_a_roof():
    wide = built([(0.0, 0.0, 2.0, 4000.0, 26.0)])
    heights = np.linspace(10, 30, 400)
    ends = np.stack([np.full(400, 60.0), np.full(400, 3.0), heights], axis=1)[:, None]
    rays = image_paths.rays_to(ends, 0.0)
    lit, field = image_paths.direct(wide, MAST, ends, rays, WAVELENGTH_M, True)
    assert lit.any()
    assert not lit.all()
    assert abs(np.diff(field[:, 0])).max() < 0.1
    assert abs(field[0, 0]) < 0.2
    assert field[-1, 0] == 1.0


def test_an_upright_edge_diffracts_on_both_sides_of_its_shadow_and_by_a_wall_that_goes_on_past_the_target():
    wall = built([(0.0, 1000.0, 0.02, 2000.0, 9000.0)])
    mast = np.array([-200.0, 5.0, 30.0])
    y = np.linspace(-2.0, 30.0, 600)
    ends = np.stack([np.full(600, 30.0), y, np.full(600, 30.0)], axis=1)[:, None]
    lit, field = image_paths.direct(
        wall, mast, ends, image_paths.rays_to(ends, 0.0), WAVELENGTH_M, True
    )
    edge = np.array([0.0, 0.0, 30.0])
    nu = edge_nu(mast, edge, ends[:, 0]) * np.sign(5.0 + 200.0 / 230.0 * (y - 5.0))
    assert 0 < (lit[:, 0] & (nu > -0.78)).sum() < lit.sum()
    near = (nu > -0.78) & (nu < 3.0)
    np.testing.assert_allclose(field[near, 0], edge_field(nu[near]), atol=0.01)
    np.testing.assert_allclose(abs(field[nu > 3.0, 0]), abs(edge_field(nu[nu > 3.0])), atol=1e-3)


def test_the_ply_the_geojson_and_the_mitsuba_version_of_a_town_have_equal_facades(tmp_path):
    files = {
        "ply": (ply(tmp_path / "town.ply", BOXES), None),
        "geojson": (geojson(tmp_path / "town.geojson", BOXES), ORIGIN),
        "xml": (mitsuba(tmp_path / "scene.xml", BOXES), None),
    }
    planes = {}
    for kind, (path, origin) in files.items():
        found = read(town.DEFAULTS | {"buildings": str(path), "origin": origin}).town.facets
        sides = np.column_stack([found.normal, found.offset, found.centre, found.half])[:-1]
        # A PLY file of this kind may be wound either way.
        sides[sides[:, :4].sum(axis=1) < 0, :4] *= -1
        planes[kind] = sides[np.lexsort(np.round(sides.T, 2))]
    assert len(planes["ply"]) == 5 * len(BOXES)
    np.testing.assert_allclose(planes["geojson"], planes["ply"], atol=2e-3)
    np.testing.assert_allclose(planes["xml"], planes["ply"], atol=1e-5)


def test_a_mesh_whose_y_axis_is_up_is_turned_and_not_mirrored(tmp_path):
    upright = read(town.DEFAULTS | {"buildings": str(ply(tmp_path / "z.ply", BOXES))}).corners
    faces = [(3 * k, 3 * k + 1, 3 * k + 2) for k in range(len(upright))]
    # The x axis stays; what was y points against z.
    turned = np.stack([upright[..., 0], upright[..., 2], -upright[..., 1]], axis=-1).reshape(-1, 3)
    (tmp_path / "y.ply").write_bytes(ply_bytes(turned.tolist(), faces, "ascii"))
    found = read(town.DEFAULTS | {"buildings": str(tmp_path / "y.ply"), "up": "y"})
    np.testing.assert_allclose(found.corners, upright, atol=1e-5)


def test_without_diffraction_a_blocked_ray_has_no_field():
    city = built([(0.0, 0.0, 2.0, 4000.0, 40.0)])
    for end, free in ((60.0, False), (-50.0, True)):
        ends = np.array([[[end, 3.0, 20.0]]])
        lit, field = image_paths.direct(
            city, MAST, ends, image_paths.rays_to(ends, 0.0), WAVELENGTH_M, False
        )
        assert lit[0, 0] == free
        assert field[0, 0] == float(free)


def test_a_record_names_the_paths(tmp_path):
    path = str(geojson(tmp_path / "town.geojson", BOXES))
    row = {"x_m": 40.0, "y_m": 0.0, "z_m": 1.5}
    settings = {"buildings": path, "origin": ORIGIN}
    complete = town.DEFAULTS | settings
    rng = np.random.default_rng(1)
    facts = town.record(complete, NETWORK, row, rng)["paths"]
    assert facts["under_roof"] is False
    below = town.record(complete, NETWORK, row | {"x_m": 20.0}, rng)["paths"]
    assert below["under_roof"] is True
    assert set(facts["stations"]) == {station.name for station in NETWORK.stations}
    for fact in facts["stations"].values():
        assert fact["direct"] == (fact["field_db"] > -6.1)
        assert all(set(surfaces) <= {"wall", "roof", "ground"} for surfaces in fact["reflected"])


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"height_m": None, "heights": False},
            "4 of 4 buildings have neither height nor building:levels",
        ),
        ({"origin": None}, "origin is not set"),
        ({"origin": [11.7, 48.137]}, r"km from station .*expected at most 2 km"),
        ({"material": "cheese"}, "effects.town.material: 'cheese'"),
    ],
)
def test_a_town_that_does_not_fit_is_refused(tmp_path, change, message):
    change = dict(change)
    path = geojson(tmp_path / "town.geojson", BOXES, heights=change.pop("heights", True))
    settings = town.DEFAULTS | {"buildings": str(path), "origin": ORIGIN} | change
    with pytest.raises(InputError, match=message):
        town.refuse_place(settings, NETWORK)


def test_a_geojson_in_metres_is_refused_by_the_command_in_one_sentence(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    path = geojson(tmp_path / "utm.geojson", BOXES)
    collection = json.loads(path.read_text())
    square = [
        [691_000.0, 5_335_000.0],
        [691_020.0, 5_335_000.0],
        [691_020.0, 5_335_020.0],
        [691_000.0, 5_335_000.0],
    ]
    collection["features"][0]["geometry"] = {"type": "Polygon", "coordinates": [square]}
    path.write_text(json.dumps(collection))
    assert main(["scene", "inspect", str(path)]) == 2
    said = capsys.readouterr().err
    assert (
        "utm.geojson: the place [691000, 5.335e+06] is no longitude and latitude" in said
        and "EPSG:4326" in said
    )


def test_wrong_units_and_sunk_towns_are_refused(tmp_path):
    path = str(ply(tmp_path / "town.ply", BOXES))
    for change in ({"unit": "mm"}, {"up": "y"}):
        with pytest.raises(InputError, match="expected a town in metres, z up"):
            read(town.DEFAULTS | {"buildings": path} | change)


def test_a_station_under_a_roof_is_refused(tmp_path):
    x, y, z = NETWORK.stations[0].position_m
    path = ply(tmp_path / "town.ply", [*BOXES, (x, y, 20.0, 20.0, z + 5.0)])
    with pytest.raises(
        InputError, match=f"station {NETWORK.stations[0].name} .* stands under a roof"
    ):
        town.refuse_place(town.DEFAULTS | {"buildings": str(path)}, NETWORK)


def test_a_mesh_outside_the_folder_of_a_scene_is_not_opened(tmp_path):
    ply(tmp_path / "secret.ply", BOXES)
    (tmp_path / "inside").mkdir()
    for name in ("../secret.ply", str(tmp_path / "secret.ply"), "\0.ply"):
        path = mitsuba(tmp_path / "inside/scene.xml", BOXES, name=name.replace("\0", "&#1;"))
        with pytest.raises(
            InputError, match=r"expected a file in the folder of the scene|not a readable XML"
        ):
            read(town.DEFAULTS | {"buildings": str(path)})


def test_materials_are_found_by_their_names_and_refused_where_they_are_not_known():
    assert named("mat-itu_medium_dry_ground.001") == "medium_dry_ground"
    assert named("Roof tiles") is None
    with pytest.raises(InputError, match="floorboard is known from 50 to 100 GHz"):
        properties("floorboard", 4.9e9, "here")
    assert all(law.low < law.high for law in MATERIALS.values())


def test_what_counts_the_same_waves_twice_is_refused(tmp_path):
    settings = town.DEFAULTS | {"buildings": str(ply(tmp_path / "town.ply", BOXES))}
    for name in ("ground_reflection", "walls", "line_of_sight"):
        modules = {name: module_of(name), "town": town}
        named = CheckedScene(NETWORK, {}, modules, (math.inf,), False)
        with pytest.raises(InputError, match=f"{name} together with town"):
            refuse_same_waves(named)
    town.check(
        settings, CheckedScene(NETWORK, {"clutter": {}, "town": settings}, {}, (math.inf,), False)
    )
    with pytest.raises(InputError, match="buildings: not set"):
        town.check(town.DEFAULTS, CheckedScene(NETWORK, {}, {}, (math.inf,), False))


def test_a_strangers_folder_may_not_name_a_file_of_buildings():
    with pytest.raises(
        InputError, match=r"index.json: its effect 'town' reads the file '/etc/passwd'"
    ):
        refuse_effects({"town": {"buildings": "/etc/passwd"}}, "index.json")


def test_a_blocked_target_is_weaker_and_its_paths_add(tmp_path):
    """Far buildings change nothing, and a wall hides.

    The ground of a town is that of `ground_reflection`.
    """
    cloud, row = target(np.random.default_rng(5))
    alone = ply(tmp_path / "far.ply", [(900.0, 900.0, 9.0, 9.0, 9.0)])
    behind = ply(tmp_path / "wall.ply", [(30.0, 12.0, 2.0, 300.0, 60.0)])
    quiet = {"order": 0, "ground": "very_dry_ground"}
    free = received_signal(scene({}), A, cloud, row).signal
    clear = received_signal(
        scene({"town": {"buildings": str(alone), **quiet}}), A, cloud, row
    ).signal
    np.testing.assert_allclose(clear, free, rtol=1e-9, atol=1e-9 * abs(free).max())
    dark = received_signal(scene({"town": {"buildings": str(behind), **quiet}}), A, cloud, row)
    assert abs(dark.signal).max() < 0.01 * abs(free).max()
    # Set SNRs refer to free space.
    assert math.isclose(dark.power, received_signal(scene({}), A, cloud, row).power, rel_tol=1e-6)
    ground = received_signal(scene({"ground_reflection": {}}), A, cloud, row).signal
    both = received_signal(
        scene({"town": {"buildings": str(alone), "order": 1}}), A, cloud, row
    ).signal
    np.testing.assert_allclose(both, ground, rtol=1e-6, atol=1e-6 * abs(ground).max())


def test_on_a_link_every_path_out_meets_every_path_back(tmp_path):
    """A sees a house, B does not."""
    settings = {"buildings": str(ply(tmp_path / "town.ply", [(-40.0, 6.0, 20.0, 8.0, 40.0)]))}
    sent, received = seen_paths(link_of({"town": settings}), town, settings)
    assert sent > received > 0
