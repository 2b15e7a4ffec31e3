"""A town's laws against numbers worked out by hand: two bounces between parallel walls, and every
material.
"""

import numpy as np
import pytest

from lowalt.extensions.town import image_paths
from lowalt.extensions.town.facets import town
from lowalt.extensions.town.materials import MATERIALS, properties
from towns import block

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
    """A street 30 m wide, its facades at x = 0 and x = 30: images lie 60 m away, on the side of the
    last wall seen.
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
