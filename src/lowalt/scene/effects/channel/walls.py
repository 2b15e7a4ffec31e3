"""Building multipath: facades reflect the wave to a target and back, each as a further path.

A facade is an upright rectangle on the ground. The station sees every point's image behind it, weaker by the Fresnel
coefficient of the wall, where the ray meets the rectangle. Out and back by any two paths add; rays that meet two
facades, edges and shadows of the buildings are left out (`line_of_sight` blocks by probability). Points may be on
either side; a facade reflects only between points on the station's side.
"""

import math

import numpy as np

from lowalt.echo.radar import radar
from lowalt.files.errors import InputError
from lowalt.machine.jit import VECTOR
from lowalt.scene import series
from lowalt.scene.checks import CheckedScene
from lowalt.scene.fresnel import fresnel
from lowalt.scene.response import ImagePath
from lowalt.scene.view import View

SOURCE = (
    "image method: Balanis, Advanced Engineering Electromagnetics, section 7.4; concrete at 4.9 GHz: ITU-R P.2040-1, "
    "Table 3; places of the facades: this project's own, inside the default network"
)
DEFAULTS = {
    "facades": [[250.0, 60.0, 90.0, 80.0, 30.0], [120.0, 240.0, -30.0, 80.0, 30.0], [380.0, 240.0, 210.0, 80.0, 30.0]],
    "permittivity": 5.24, "conductivity_s_m": 0.16,
}  # fmt: skip


def idle(settings: dict) -> bool:
    """Return whether there are no facades, or they are like air."""
    return not settings["facades"] or (settings["permittivity"] == 1 and settings["conductivity_s_m"] == 0)


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a facade without extent, or a material that does not exist."""
    for facade in settings["facades"]:
        if min(facade[3:]) <= 0:
            raise InputError(f"effects.walls.facades: {facade} has width and height {facade[3:]}, expected positive")
    if settings["permittivity"] < 1:
        raise InputError(f"effects.walls.permittivity: {settings['permittivity']}, expected at least 1")


def mirrored(
    facade: list[float], places: np.ndarray, station_m: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return images (N, L, 3) m of places (N, L, 3) m, the sine of the grazing angle, and whether the ray is reflected.

    facade: x, y of its foot's middle (m), azimuth of its normal (degrees), width and height (m). A ray is reflected
    where station and point are on the same side and the line to the image meets the rectangle.
    """
    x, y, azimuth, width, height = facade
    cosine, sine = np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))
    foot, normal, along = np.array([x, y, 0.0]), np.array([cosine, sine, 0.0]), np.array([-sine, cosine, 0.0])
    images, grazing = np.empty(places.shape), np.empty(places.shape[:2])
    reflected, size = np.empty(places.shape[:2], np.bool_), np.array([0.5 * width, height])
    _mirror(places, station_m, (foot, normal, along), size, images, grazing, reflected)
    return images, grazing, reflected


@VECTOR
def _mirror(places, station, axes, size, images, grazing, reflected):
    """Fill images (N, L, 3), grazing and reflected (N, L) of `mirrored`; size: half the width and the height (m).

    axes: the middle of the facade's foot (m), its normal, and the direction along it.
    """
    foot, normal, along = axes
    before = (station[0] - foot[0]) * normal[0] + (station[1] - foot[1]) * normal[1]
    beside = (station[0] - foot[0]) * along[0] + (station[1] - foot[1]) * along[1]
    for n in range(places.shape[0]):
        for l in range(places.shape[1]):  # noqa: E741
            x, y, z = places[n, l, 0], places[n, l, 1], places[n, l, 2]
            off = (x - foot[0]) * normal[0] + (y - foot[1]) * normal[1]
            x, y = x - 2.0 * off * normal[0], y - 2.0 * off * normal[1]
            images[n, l, 0], images[n, l, 1], images[n, l, 2] = x, y, z
            a, b, c = x - station[0], y - station[1], z - station[2]
            grazing[n, l] = abs(a * normal[0] + b * normal[1]) / math.sqrt(a * a + b * b + c * c)
            # The ray meets the facade's plane at this share of its way to the image.
            share = before / (before + off)
            across, up = beside + share * (a * along[0] + b * along[1]), station[2] + share * c
            inside = (abs(across) <= size[0]) & (up >= 0.0) & (up <= size[1])
            reflected[n, l] = inside & (before * off > 0.0)


def paths(settings: dict, view: View) -> list[ImagePath]:
    """Return one path a facade: images (N, L, 3) m and coefficients (N, L), zero where no ray is reflected.

    A facade that reflects nothing in the whole look has the coefficient 0.0, and the points themselves as images.
    """
    frequency, station_m = radar(view.network, view.station).centre_hz, np.asarray(view.station.position_m)
    # Vertical polarisation is parallel to an upright wall, as horizontal polarisation is to the ground.
    material = settings["permittivity"], settings["conductivity_s_m"], frequency, "horizontal"
    result = []
    for facade in settings["facades"]:
        images, sine, reflected = mirrored(facade, view.places, station_m)
        behind = mirrored(facade, station_m[None, None], station_m)[0][0, 0]
        if reflected.any():
            mirror = series.at(lambda sine: fresnel(sine, *material), sine) * view.relative_gain(images)
            result.append(ImagePath(images, np.where(reflected, mirror, 0.0), behind))
        else:
            result.append(ImagePath(view.places, 0.0, behind))
    return result
