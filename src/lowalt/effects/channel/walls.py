"""Building multipath: facades reflect the wave to a target and back, each as a further path.

A facade is an upright rectangle on the ground. The station sees every point's image behind it, weaker by the Fresnel
coefficient of the wall, where the ray meets the rectangle. Out and back by any two paths add; rays that meet two
facades, edges and shadows of the buildings are left out (`line_of_sight` blocks by probability). Points may be on
either side; a facade reflects only between points on the station's side.
"""

import math

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.jit import LEAN
from lowalt.echo.radar import radar
from lowalt.effects import series
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
    _, _, _, width, height = facade
    planes = np.ascontiguousarray(np.swapaxes(places, 1, 2))
    images, sine = np.empty_like(planes), np.empty((len(planes), planes.shape[2]))
    reflected = np.empty(sine.shape, np.bool_)
    size = np.array([0.5 * width, height])
    _mirror(planes, station_m, np.stack(_axes(facade)), size, images, sine, reflected)
    return np.swapaxes(images, 1, 2), sine, reflected


def _axes(facade: list[float]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The middle of a facade's foot (m), its normal, and the direction along it."""
    x, y, azimuth, _, _ = facade
    angle = np.radians(azimuth)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([x, y, 0.0]), np.array([cosine, sine, 0.0]), np.array([-sine, cosine, 0.0])


@LEAN
def _mirror(planes, station, axes, size, images, sine, reflected):
    """Fill images (N, 3, L), sine and reflected (N, L) of `mirrored` for places in planes (N, 3, L).

    axes: (3, 3), those of `_axes`; size: half the width and the height (m).
    """
    foot, normal, along, half, height = axes[0], axes[1], axes[2], size[0], size[1]
    u, v, a, b = normal[0], normal[1], along[0], along[1]
    s0, s1, s2 = station[0], station[1], station[2]
    own = (s0 - foot[0]) * u + (s1 - foot[1]) * v
    for n in range(planes.shape[0]):
        x, y, z = planes[n, 0], planes[n, 1], planes[n, 2]
        i, j, k = images[n, 0], images[n, 1], images[n, 2]
        for l in range(np.uint64(planes.shape[2])):  # noqa: E741
            off = (x[l] - foot[0]) * u + (y[l] - foot[1]) * v
            i[l], j[l], k[l] = x[l] - 2.0 * off * u, y[l] - 2.0 * off * v, z[l]
            p, q, r = i[l] - s0, j[l] - s1, k[l] - s2
            sine[n, l] = abs(p * u + q * v) / math.sqrt(p * p + q * q + r * r)
            share = own / (own + off)
            across = (s0 + share * p - foot[0]) * a + (s1 + share * q - foot[1]) * b
            up = s2 + share * r
            inside = (abs(across) <= half) & (up >= 0.0) & (up <= height)
            reflected[n, l] = inside & (own * off > 0.0)


def box(view: View) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and the highest corner (3,) m of a box around all points in the whole look."""
    room = view.radii[:, None] + 1e-6
    return (view.middles - room).min(axis=(0, 1)), (view.middles + room).max(axis=(0, 1))


def dark(facade: list[float], low: np.ndarray, high: np.ndarray, station_m: np.ndarray) -> bool:
    """Return whether a facade is sure to reflect no ray between the station and any place in a box (corners in m).

    Where the box is on the station's side, the rays to its images meet the wall's plane within the hull of the places
    where those to its corners do, since lines stay lines under a projection.
    """
    foot, normal, along = _axes(facade)
    corners = np.array([[x, y, z] for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])
    own, off = float((station_m - foot) @ normal), (corners - foot) @ normal
    if (own * off <= 0.0).all():
        return True
    if (own * off <= 0.0).any():
        return False
    ray = corners - 2 * off[:, None] * normal - station_m
    meets = station_m + (own / (own + off))[:, None] * ray - foot
    across, up, room = meets @ along, meets[:, 2], 1e-6
    misses_sides = across.min() > 0.5 * facade[3] + room or across.max() < -0.5 * facade[3] - room
    misses_height = up.min() > facade[4] + room or up.max() < -room
    return bool(misses_sides or misses_height)


def images(settings: dict, view: View) -> list[np.ndarray]:
    """Return the points' images (N, L, 3) m behind every facade, also where no ray is reflected."""
    station_m = np.asarray(view.station.position_m, np.float64)
    return [mirrored(facade, view.places, station_m)[0] for facade in settings["facades"]]


def paths(settings: dict, view: View) -> list[ImagePath]:
    """Return one path a facade: images (N, L, 3) m and coefficients (N, L), zero where no ray is reflected.

    A facade that reflects nothing in the whole look has the coefficient 0.0, and the points themselves as images.
    """
    frequency = radar(view.network, view.station).centre_hz
    station_m, (low, high) = np.asarray(view.station.position_m, np.float64), box(view)
    # Vertical polarisation is parallel to an upright wall, as horizontal polarisation is to the ground.
    material = settings["permittivity"], settings["conductivity_s_m"], frequency, "horizontal"
    result = []
    for facade in settings["facades"]:
        behind = mirrored(facade, station_m[None, None], station_m)[0][0, 0]
        nothing = ImagePath(view.places, 0.0, behind)
        if dark(facade, low, high, station_m):
            result.append(nothing)
            continue
        images, sine, reflected = mirrored(facade, view.places, station_m)
        if not reflected.any():
            result.append(nothing)
            continue
        # Over the few degrees that a look covers, the coefficient is a short series of the sine.
        mirror = series.at(lambda sine: fresnel(sine, *material), np.clip(sine, 0.0, 1.0))
        result.append(ImagePath(images, np.where(reflected, mirror * view.relative_gain(images), 0.0), behind))
    return result
