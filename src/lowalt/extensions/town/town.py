"""A town: buildings from a file, which block, reflect and diffract waves.

The waves go between a station and a target.

Every ray of every point is traced past all buildings: the direct one, where it is blocked over
roofs and around edges, and those by one or two of all walls, roofs and the ground. Out by any path
and back by any other add. The SNRs of the configuration refer to the echo on the direct path in
free space, so a blocked target is weaker by the loss that buildings cause. Echoes of land and of
the buildings themselves are those of other effects, which know no shadows.
Effects that reflect or block the same waves would count them twice and are refused.
"""

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Network
from lowalt.echo.radar import radar
from lowalt.extensions.town import image_paths
from lowalt.extensions.town.buildings import files_of, read
from lowalt.extensions.town.bundle_loops import blocked
from lowalt.files.errors import InputError
from lowalt.scene.checks import CheckedScene, above_ground
from lowalt.scene.response import ImagePath
from lowalt.scene.view import View

SOURCE = (
    "image method and Fresnel coefficients: Balanis, Advanced Engineering Electromagnetics, "
    "sections 5.3 and 7.4; materials: ITU-R P.2040-3, Table 3; diffraction: ITU-R P.526-15, "
    "sections 4.1 and 4.3, and Deygout 1966; rays per cell of 0.5 m: estimate, below the radius of "
    "the first Fresnel zone at 100 m and 4.9 GHz"
)
DEFAULTS = {
    "buildings": None,
    "origin": None,
    "unit": "m",
    "up": "z",
    "height_m": None,
    "material": "concrete",
    "left_out": 0.1,
    "ground": "medium_dry_ground",
    "order": 2,
    "diffraction": True,
    "cell_m": 0.5,
}
PARTS = {
    "second order": {"order": 1},
    "reflections": {"order": 0},
    "diffraction": {"diffraction": False},
}
FILES = ("buildings",)
WAVES = ("reflected by the ground", "reflected by walls", "blocked by buildings")
NEAR_M = 2000.0
"""A town that is farther from every station is at the wrong place."""


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for no file, a town far from all stations, or an unknown material."""
    above_ground("town", scene.network)
    found = read(settings)
    refuse_place(settings, scene.network)
    for station in scene.network.stations:
        image_paths.epsilons(found.town, radar(scene.network, station).centre_hz, "effects.town")


def refuse_place(settings: dict, network: Network) -> None:
    """Refuse a town far from all stations, and a station under a roof.

    Raises: InputError naming the file, the station and the distance or the height.
    """
    found = read(settings)
    path = settings["buildings"]
    low = np.array(found.facts["low_m"])
    high = np.array(found.facts["high_m"])
    masts = {}
    away = {}
    for station in network.stations:
        mast = np.asarray(station.position_m, float)
        masts[station.name] = mast
        nearest_point = np.clip(mast, low, high)
        away[station.name] = float(np.linalg.norm((mast - nearest_point)[:2]))
    nearest = min(away, key=away.__getitem__)
    if away[nearest] > NEAR_M:
        raise InputError(
            f"{path}: the nearest building is {away[nearest] / 1000:.1f} km from station "
            f"{nearest}, expected at most {NEAR_M / 1000:g} km: set effects.town.origin, the place "
            "in the file of x = y = 0"
        )
    for name, mast in masts.items():
        top = np.array([mast[0], mast[1], high[2] + 1.0])
        if mast[2] >= top[2]:
            continue
        if blocked(found.town.occluders, mast[None], top[None])[0]:
            raise InputError(
                f"{path}: station {name} at {mast.tolist()} m stands under a roof, expected it "
                "above the buildings: move it, or set effects.town.origin"
            )


def paths(settings: dict, view: View) -> list[ImagePath]:
    """Return the reflected paths that reach any point, and the change of the direct one.

    The direct one changes where buildings are near it.

    That change is a path along the direct one whose coefficient is the field there over that in
    free space, less one.
    """
    town = read(settings).town
    radio = radar(view.network, view.station)
    station_m = np.array(view.station.position_m, float)
    places = np.ascontiguousarray(view.places)
    rays = image_paths.rays_to(places, settings["cell_m"])
    wavelength_m = SPEED_OF_LIGHT / radio.centre_hz
    _, field = image_paths.direct(
        town, station_m, places, rays, wavelength_m, settings["diffraction"]
    )
    result = []
    if (field != 1.0).any():
        result.append(ImagePath(view.places, field - 1.0))
    epsilon = image_paths.epsilons(town, radio.centre_hz, "effects.town")
    for route in image_paths.reflected(town, epsilon, station_m, places, rays, settings["order"]):
        coefficient = route.coefficient * view.relative_gain(route.images)
        result.append(ImagePath(route.images, coefficient, route.station_m))
    return result


def files(settings: dict) -> list[str]:
    """Return the path of the file of buildings and those of the meshes that it names.

    Raises: InputError where one of them is not there.
    """
    return [] if settings["buildings"] is None else files_of(settings["buildings"])


def record(
    settings: dict, network: Network, row: dict, rng: np.random.Generator
) -> dict[str, dict]:
    """Return the field `paths`: which paths lead to a target's origin at the first symbol.

    row: the target's, of the motion table.

    `under_roof`: whether a roof is above it; `stations`: by name `direct`, whether the sight is
    free; `field_db`, the direct field over that in free space; and `reflected`, the surfaces of
    each reflected path, as ["wall", "ground"].
    """
    town = read(settings).town
    target = np.array([[[row["x_m"], row["y_m"], row["z_m"]]]], float)
    rays = image_paths.rays_to(target, 0.0)
    # The last facet is the ground.
    kinds = ["wall" if abs(up) < 0.5 else "roof" for up in town.facets.normal[:-1, 2]]
    kinds.append("ground")
    result = {}
    for station in network.stations:
        if station.transmitter is not None:
            continue
        frequency = radar(network, station).centre_hz
        station_m = np.array(station.position_m, float)
        wavelength_m = SPEED_OF_LIGHT / frequency
        lit, field = image_paths.direct(
            town, station_m, target, rays, wavelength_m, settings["diffraction"]
        )
        epsilon = image_paths.epsilons(town, frequency, "effects.town")
        found = image_paths.reflected(town, epsilon, station_m, target, rays, settings["order"])
        size = max(abs(field[0, 0]), 1e-20)
        result[station.name] = {
            "direct": bool(lit[0, 0]),
            "field_db": float(np.round(20 * np.log10(size), 2)),
            "reflected": [[kinds[k] for k in route.facets] for route in found],
        }
    far_above = target[0] + [0.0, 0.0, 1e4]
    roof = blocked(town.occluders, target[0], far_above)[0]
    return {"paths": {"under_roof": bool(roof), "stations": result}}
