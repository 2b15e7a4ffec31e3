"""Self-occlusion: points that the target's own surfaces hide from a station do not echo.

For every point and symbol, a straight ray to the station is tested against the surfaces of all
moving parts; shadows are sharp. Waves bend around rotor blades: a point behind one keeps the share
of power that reaches the axis of the shadow of a strip as wide as the blade. Other paths, such as a
ground reflection, count as hidden where the direct path is.
"""

from collections.abc import Collection

import numpy as np
from scipy.special import fresnel

from lowalt.config.network import SPEED_OF_LIGHT
from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.scene.rays import hidden_by, hidden_by_bones
from lowalt.scene.view import View
from lowalt.targets.cloud import Cloud

SOURCE = (
    "blades: Born & Wolf, Principles of Optics, 7th ed. 1999, 8.3.2 (Babinet's principle) and "
    "8.7.3 (Fresnel's integrals); the rest, geometrical optics: Knott, Shaeffer & Tuley, Radar "
    "Cross Section, 2nd ed. 1993, chapter 5; rays and triangles: Moeller & Trumbore, Fast, Minimum "
    "Storage Ray/Triangle Intersection, J. Graphics Tools 2, 1997"
)
DEFAULTS = {"blades": "bent"}
SURFACES = True
ONE_SIDED = True


def blades_m(cloud: Cloud, surfaces: dict) -> list[tuple[float, float]]:
    """Return each rotor's mean blade width (m) and its radius (m).

    The width is one side's area over the rotor's diameter.
    """
    part = surfaces["vertex_part"][surfaces["faces"][:, 0]]
    result = []
    for rotor in cloud.parts_of("rotor"):
        corners = surfaces["vertices"][surfaces["faces"][part == rotor]]
        if len(corners):
            away = corners.reshape(-1, 3) - cloud.hinges[rotor]
            radius = float(portable.norm(np.cross(away, cloud.axes[rotor])).max())
            across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            sides = 2.0 if surfaces["closed"][rotor] else 1.0
            area = 0.5 * float(portable.total(portable.norm(across)))
            result.append((area / (sides * 2.0 * radius), radius))
    return result


def passed(width_m: float, distance_m: float, wavelength_m: float) -> float:
    """Return the power share of a wave on the axis of the shadow of a long strip.

    distance_m: behind the strip.

    By Babinet's principle the strip's field is the free one less that of a slit of its width: |1 -
    (1 + j) F(v)|^2 with the Fresnel integral F = C - jS and v = width / sqrt(2 wavelength
    distance). Source: Born & Wolf, 8.3.2 and 8.7.3.
    """
    sine, cosine = fresnel(width_m / np.sqrt(2.0 * wavelength_m * distance_m))
    return float(abs(1.0 - (1.0 + 1j) * (cosine - 1j * sine)) ** 2)


def through_blades(view: View) -> float:
    """Return the factor on a two-way amplitude behind a blade.

    It is the share of power, averaged over the rotors. The rotor's radius is taken as the distance
    behind the blade, and the phase is left out.
    """
    wavelength = SPEED_OF_LIGHT / view.network.carrier_hz
    assert view.occluders is not None  # blades hide points only in front of surfaces
    blades = blades_m(view.cloud, view.occluders)
    if not blades:
        return 0.0
    return float(np.mean([passed(width, radius, wavelength) for width, radius in blades]))


def hidden(view: View, parts: Collection[int], known: np.ndarray | None = None) -> np.ndarray:
    """Return whether the surfaces of `parts` hide each point from the station, (N, L) bool.

    known: points (N, L) that other surfaces hide, and so are not asked but hidden. Bones hide a
    recording's nodes.
    Raises: InputError where the target's surfaces are not given or are another target's.
    """
    surfaces = _surfaces(view)
    cloud = view.cloud
    place_m = np.asarray(view.station.position_m, np.float64)
    result = np.zeros(view.places.shape[:2], np.bool_)
    if known is not None:
        result |= known
    if "node" in cloud.kinds:
        hidden_by_bones(surfaces, place_m, view.places, result)
        return result
    # Rays start a little off the point's own surface: along its normal, or toward the station where
    # it has none.
    has_normal = np.isfinite(cloud.normals).all(axis=1)
    offset_m = surfaces["offset_m"]
    start = cloud.points + np.where(has_normal[:, None], offset_m[:, None] * cloud.normals, 0.0)
    toward = np.where(has_normal, 0.0, offset_m / portable.norm(view.aim_m - place_m))
    motion = view.motion._replace(points=start)
    hidden_by(surfaces, place_m, motion, cloud.axes, toward, parts, result)
    return result


def _surfaces(view: View) -> dict:
    """Return the target's surfaces.

    Raises: InputError where they are not given or are another target's.
    """
    surfaces = view.occluders
    cloud = view.cloud
    make = "make them with python -m lowalt.targets.occluders"
    if surfaces is None:
        raise InputError(f"effects.occlusion: {cloud.subtype} has no surfaces, {make}")
    if surfaces["subtype"] != cloud.subtype or len(surfaces["offset_m"]) != len(cloud.points):
        raise InputError(
            f"effects.occlusion: surfaces of {surfaces['subtype']} with "
            f"{len(surfaces['offset_m'])} points, expected those of {cloud.subtype} with "
            f"{len(cloud.points)}; {make}"
        )
    return surfaces


def visible(settings: dict, view: View, rng: np.random.Generator | None = None) -> np.ndarray:
    """Return the factor (N, L) on every point's amplitude.

    It is 1 where the station sees it, 0 where not.

    Behind `bent` blades it is the share that goes around them, behind `transparent` ones 1. On a
    link it is the root of the product of the factors at both ends, so a point that opaque surfaces
    hide from either end does not echo.
    Raises: InputError where the target's surfaces are not given or are another target's.
    """
    ends = view.ends()
    if len(ends) == 2:
        return np.sqrt(visible(settings, ends[0]) * visible(settings, ends[1]))
    blades = view.cloud.parts_of("rotor")
    if settings["blades"] == "opaque":
        blades = []
    opaque = [part for part in range(len(view.cloud.kinds)) if part not in blades]
    dark = hidden(view, opaque)
    result = np.where(dark, 0.0, 1.0)
    if settings["blades"] == "bent" and blades:
        behind = hidden(view, blades, dark) & ~dark
        result[behind] = through_blades(view)
    return result
