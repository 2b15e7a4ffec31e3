"""Building multipath: facades reflect the wave to a target and back, each as a further path.

A facade is an upright rectangle on the ground. The station sees every point's image behind it, weaker by the Fresnel
coefficient of the wall, where the ray meets the rectangle. Out and back by any two paths add; rays that meet two
facades, edges and shadows of the buildings are left out (`line_of_sight` blocks by probability). Points may be on
either side; a facade reflects only between points on the station's side.
"""

import numpy as np

from lowalt.common.errors import InputError
from lowalt.echo.radar import radar
from lowalt.effects.checks import CheckedScene
from lowalt.effects.fresnel import fresnel
from lowalt.effects.response import ImagePath
from lowalt.effects.view import View

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
    angle = np.radians(azimuth)
    normal, along = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
    foot = np.array([x, y, 0.0])
    off, own = (places - foot) @ normal, float((station_m - foot) @ normal)
    images = places - 2 * off[..., None] * normal
    ray = images - station_m
    length = np.sqrt(np.einsum("nli,nli->nl", ray, ray))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = own / (own + off)
        meets = station_m + share[..., None] * ray - foot
        inside = (abs(meets @ along) <= 0.5 * width) & (meets[..., 2] >= 0) & (meets[..., 2] <= height)
    return images, abs(ray @ normal) / length, inside & (own * off > 0)


def paths(settings: dict, view: View) -> list[ImagePath]:
    """Return one path a facade: images (N, L, 3) m and coefficients (N, L), zero where no ray is reflected."""
    frequency = radar(view.network, view.station).centre_hz
    result = []
    for facade in settings["facades"]:
        station_m = np.asarray(view.station.position_m)
        images, sine, reflected = mirrored(facade, view.places, station_m)
        # Vertical polarisation is parallel to an upright wall, as horizontal polarisation is to the ground.
        mirror = fresnel(
            np.clip(sine, 0.0, 1.0), settings["permittivity"], settings["conductivity_s_m"], frequency, "horizontal"
        )
        behind = mirrored(facade, station_m[None, None], station_m)[0][0, 0]
        result.append(ImagePath(images, np.where(reflected, mirror * view.relative_gain(images), 0.0), behind))
    return result
