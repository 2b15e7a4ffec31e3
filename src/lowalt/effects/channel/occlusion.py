"""Self-occlusion: points that the target's own surfaces hide from a station do not echo.

Straight rays, point by point and symbol by symbol, against the surfaces of all parts as they turn; shadows are sharp.
Waves bend around blades: a hidden point keeps the power share on the axis of the shadow of a strip of a blade's width.
Waves on other paths (a ground reflection) are taken to be hidden where the direct one is.
"""

import numpy as np
from scipy.special import fresnel

from lowalt.common.errors import InputError
from lowalt.common.jit import LEAN
from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.effects.channel.capsules import capsules
from lowalt.effects.channel.shadow_rays import cast_rays
from lowalt.effects.channel.surface_tree import whole_tree
from lowalt.effects.kept_by_arrays import KeptByArrays
from lowalt.effects.view import View
from lowalt.targets.cloud import Cloud

SOURCE = (
    "blades: Born & Wolf, Principles of Optics, 7th ed. 1999, 8.3.2 (Babinet's principle) and 8.7.3 (Fresnel's "
    "integrals); the rest, geometrical optics: Knott, Shaeffer & Tuley, Radar Cross Section, 2nd ed. 1993, chapter 5; "
    "rays and triangles: Moeller & Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, J. Graphics Tools 2, 1997"
)
DEFAULTS = {"strength": 1.0, "blades": "bent"}
DRAWS_NOTHING = True

_BLADES = KeptByArrays()
"""Widths and radii of the blades of each target."""


def idle(settings: dict) -> bool:
    """Return whether hidden points echo as if nothing were before them."""
    return settings["strength"] == 0


def blades_m(cloud: Cloud, surfaces: dict) -> dict[int, tuple[float, float]]:
    """Return each rotor's mean blade width and its radius (m), by part: one side's area over its diameter."""
    arrays = [surfaces[name] for name in ("vertices", "vertex_part", "faces", "closed")]
    rotors = cloud.parts_of("rotor")
    return _BLADES.of([*arrays, cloud.hinges, cloud.axes], lambda: _measured_blades(cloud, surfaces), *rotors)


def _measured_blades(cloud: Cloud, surfaces: dict) -> dict[int, tuple[float, float]]:
    """The result of `blades_m`, worked out."""
    corners = surfaces["vertices"][surfaces["faces"]]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    part = surfaces["vertex_part"][surfaces["faces"][:, 0]]
    found = {}
    for rotor in cloud.parts_of("rotor"):
        mine = part == rotor
        away = corners[mine].reshape(-1, 3) - cloud.hinges[rotor]
        if len(away):
            radius = float(np.linalg.norm(np.cross(away, cloud.axes[rotor]), axis=1).max())
            sides = 2.0 if surfaces["closed"][rotor] else 1.0
            found[rotor] = float(area[mine].sum() / (sides * 2.0 * radius)), radius
    return found


def passed(width_m: float, distance_m: float, wavelength_m: float) -> float:
    """Return the power share of a wave on the axis of the shadow of a long strip, at this distance behind it.

    By Babinet's principle the strip's field is the free one less that of a slit of its width: |1 - (1 + j) F(v)|^2 with
    the Fresnel integral F = C - jS and v = width / sqrt(2 wavelength distance). Source: Born & Wolf, 8.3.2 and 8.7.3.
    """
    sine, cosine = fresnel(width_m / np.sqrt(2.0 * wavelength_m * distance_m))
    return float(abs(1.0 - (1.0 + 1j) * (cosine - 1j * sine)) ** 2)


def through_blades(view: View) -> float:
    """Return the factor on a two-way amplitude behind a blade: its power share, the mean over the craft's rotors.

    The rotor's radius is taken as the distance behind the blade, and the phase is left out.
    """
    wavelength = SPEED_OF_LIGHT / view.network.carrier_hz
    found = [passed(width, radius, wavelength) for width, radius in blades_m(view.cloud, view.occluders).values()]
    return float(np.mean(found)) if found else 0.0


def hidden(view: View, by: str = "all", known: np.ndarray | None = None) -> np.ndarray:
    """Return whether each point is hidden from the station, (N, L) bool.

    by: surfaces that count: all of them, the rotors' blades, or the rest; known: points (N, L) bool that are hidden by
    other surfaces, and so not asked.

    Raises: InputError where the target's surfaces are not given or are another target's.
    """
    surfaces, cloud, place = _surfaces(view), view.cloud, np.asarray(view.station.position_m, float)
    if view.nodes:
        result = np.zeros(view.places.shape[:2], np.bool_) if known is None else known.copy()
        capsules(place, np.ascontiguousarray(view.places), surfaces["bones"], surfaces["radius_m"], result)
        return result
    has_normal = np.isfinite(cloud.normals).all(axis=1)
    offset = surfaces["offset_m"]
    start = cloud.points + np.where(has_normal[:, None], offset[:, None] * cloud.normals, 0.0)
    toward = np.where(has_normal, 0.0, offset / np.linalg.norm(view.aim_m - place))
    motion = view.motion._replace(points=start)
    rotors = cloud.parts_of("rotor")
    asked = {"all": range(len(cloud.kinds)), "blades": rotors, "rest": set(range(len(cloud.kinds))) - set(rotors)}[by]
    given = place, motion, toward, surfaces["vertices"], whole_tree(surfaces), rotors, list(asked), known
    return cast_rays(*given, cloud.axes)


def _surfaces(view: View) -> dict:
    """The target's surfaces. Raises: InputError where they are not given or are another target's."""
    surfaces, cloud = view.occluders, view.cloud
    make = "make them with python -m lowalt.targets.occluders"
    if surfaces is None:
        raise InputError(f"effects.occlusion: {cloud.subtype} has no surfaces, {make}")
    if surfaces["subtype"] != cloud.subtype or len(surfaces["offset_m"]) != len(cloud.points):
        raise InputError(
            f"effects.occlusion: surfaces of {surfaces['subtype']} with {len(surfaces['offset_m'])} points, expected "
            f"those of {cloud.subtype} with {len(cloud.points)}; {make}"
        )
    return surfaces


@LEAN
def _factors(found, rest, dimmed, behind, out):
    """Fill out (N, L): `dimmed` where rest (N, L), else `behind` where found (N, L), else 1."""
    for n in range(len(out)):
        one, other, row = found[n], rest[n], out[n]
        for l in range(np.uint64(out.shape[1])):  # noqa: E741
            row[l] = dimmed if other[l] else (behind if one[l] else 1.0)


def visible(settings: dict, view: View, rng: np.random.Generator | None = None) -> np.ndarray:
    """Return the factor (N, L) on every point's amplitude: 1 where the station sees it, 1 - strength where not.

    Behind bent blades it is the share that goes around them instead. On a link each way has the root of the factor that
    a station at its end has: a point hidden from either end by opaque surfaces does not echo.
    Raises: InputError where the target's surfaces are not given or are another target's.
    """
    return visible_of(settings, view, None)


def visible_of(settings: dict, view: View, dark: np.ndarray | None) -> np.ndarray:
    """Return the factor (N, L) of `visible`; of points that are `dark` (N, L) without it, as if surfaces hid them.

    No ray is cast for dark points. dark: None for no such points; raises as `visible`.
    """
    ends = view.ends()
    if len(ends) == 2:
        out, back = (visible_of(settings, end, dark) for end in ends)
        return np.sqrt(out * back)
    strength, behind = settings["strength"], 1.0
    if settings["blades"] == "opaque" or view.nodes or not view.cloud.parts_of("rotor"):
        found = rest = hidden(view, known=dark)
    else:
        found = rest = hidden(view, "rest", dark)
        if settings["blades"] == "bent":
            # The rays to the rest's points are not cast again, so `found` holds these too.
            found, behind = hidden(view, "blades", rest), 1.0 - strength * (1.0 - through_blades(view))
    result = np.empty(found.shape)
    _factors(found, rest, 1.0 - strength, behind, result)
    return result
