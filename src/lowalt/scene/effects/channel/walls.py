"""Building multipath: facades reflect the wave to a target and back, each as a further path.

A facade is an upright rectangle on the ground. The station sees every point's image behind it,
weaker by the Fresnel coefficient of the wall, where the ray meets the rectangle. All pairs of an
outward and a return path add. Rays that meet two facades, diffraction at edges and the shadows of
buildings are left out. A facade reflects only where station and point are on the same side of it.
"""

import numpy as np

from lowalt.echo.radar import radar
from lowalt.files.errors import InputError
from lowalt.numerics import chebyshev_series
from lowalt.numerics.portable import sine_cosine
from lowalt.scene.checks import CheckedScene
from lowalt.scene.fresnel import fresnel
from lowalt.scene.response import ImagePath
from lowalt.scene.view import View

SOURCE = (
    "image method: Balanis, Advanced Engineering Electromagnetics, section 7.4; concrete at 4.9 "
    "GHz: ITU-R P.2040-1, Table 3; places of the facades: this project's own, inside the default "
    "network"
)
DEFAULTS = {
    "facades": [
        [250.0, 60.0, 90.0, 80.0, 30.0],
        [120.0, 240.0, -30.0, 80.0, 30.0],
        [380.0, 240.0, 210.0, 80.0, 30.0],
    ],
    "permittivity": 5.24,
    "conductivity_s_m": 0.16,
}
IDLE = [{"facades": []}, {"permittivity": 1, "conductivity_s_m": 0}]
WAVES = ("reflected by walls",)


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a facade without extent."""
    for facade in settings["facades"]:
        if min(facade[3:]) <= 0:
            raise InputError(
                f"effects.walls.facades: {facade} has width and height {facade[3:]}, expected "
                "positive"
            )


def mirrored(
    facade: list[float], places: np.ndarray, station_m: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return images (N, L, 3) m of places (N, L, 3) m, and how their rays are reflected.

    That is the sine of the grazing angle, and whether the ray is reflected.

    facade: x, y of its foot's middle (m), azimuth of its normal (degrees), width and height (m). A
    ray is reflected where station and point are on the same side and the line to the image meets
    the rectangle.
    """
    foot_x, foot_y, azimuth, width, height = facade
    sine, cosine = sine_cosine(np.radians(azimuth))
    x, y, z = np.moveaxis(places, -1, 0)
    # Distances from the facade's plane, and along it from the middle of its foot.
    before = (station_m[0] - foot_x) * cosine + (station_m[1] - foot_y) * sine
    beside = (station_m[1] - foot_y) * cosine - (station_m[0] - foot_x) * sine
    off = (x - foot_x) * cosine + (y - foot_y) * sine
    images = np.stack([x - 2.0 * off * cosine, y - 2.0 * off * sine, z], axis=1)
    away_x, away_y, away_z = np.moveaxis(images - station_m[:, None], 1, 0)
    grazing = abs(away_x * cosine + away_y * sine) / np.sqrt(away_x**2 + away_y**2 + away_z**2)
    # The ray meets the facade's plane at this share of its way to the image.
    with np.errstate(divide="ignore", invalid="ignore"):
        share = before / (before + off)
    across = beside + share * (away_y * cosine - away_x * sine)
    up = station_m[2] + share * away_z
    inside = (abs(across) <= 0.5 * width) & (up >= 0.0) & (up <= height)
    return images.swapaxes(1, 2), grazing, inside & (before * off > 0.0)


def paths(settings: dict, view: View) -> list[ImagePath]:
    """Return one path per facade: images (N, L, 3) m and coefficients (N, L).

    Coefficients are zero where no ray is reflected.

    A facade that reflects nothing in the whole look has the coefficient 0.0, and the points
    themselves as images.
    """
    frequency = radar(view.network, view.station).centre_hz
    station_m = np.asarray(view.station.position_m)
    # Vertical polarisation is parallel to an upright wall, as horizontal polarisation is to the
    # ground.
    material = settings["permittivity"], settings["conductivity_s_m"], frequency, "horizontal"
    result = []
    for facade in settings["facades"]:
        images, sine, reflected = mirrored(facade, view.places, station_m)
        behind = mirrored(facade, station_m[None, None], station_m)[0][0, 0]
        if not reflected.any():
            result.append(ImagePath(view.places, 0.0, behind))
            continue
        mirror = chebyshev_series.at(lambda sine: fresnel(sine, *material), sine)
        mirror = mirror * view.relative_gain(images)
        result.append(ImagePath(images, np.where(reflected, mirror, 0.0), behind))
    return result
