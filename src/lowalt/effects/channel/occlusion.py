"""Self-occlusion: points that the target's own surfaces hide from a station do not echo.

Straight rays, point by point and symbol by symbol, against the surfaces of all parts as they turn; shadows are sharp.
Blades narrower than half a wavelength hide nothing: waves bend around them.
Waves on other paths (a ground reflection) are taken to be hidden where the direct one is.
"""

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.effects.channel.shadows import GRID, capsules, triangles
from lowalt.effects.view import View
from lowalt.targets.cloud import Cloud

SOURCE = (
    "geometrical optics: Knott, Shaeffer & Tuley, Radar Cross Section, 2nd ed. 1993, chapter 5 (shadowing); "
    "visible points by their depth on a screen: Catmull, A Subdivision Algorithm for Computer Display of Curved "
    "Surfaces, 1974, computed here at the points themselves"
)
DEFAULTS = {"strength": 1.0, "thin_waves": 0.5}


def idle(settings: dict) -> bool:
    """Return whether hidden points echo as if nothing were before them."""
    return settings["strength"] == 0


def blade_widths_m(cloud: Cloud, surfaces: dict) -> dict[int, float]:
    """Return each rotor's mean blade width (m), by part: one side's area over its diameter."""
    corners = surfaces["vertices"][surfaces["faces"]]
    area = 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    part = surfaces["vertex_part"][surfaces["faces"][:, 0]]
    widths = {}
    for rotor in cloud.parts_of("rotor"):
        mine = part == rotor
        away = corners[mine].reshape(-1, 3) - cloud.hinges[rotor]
        if len(away):
            diameter = 2.0 * np.linalg.norm(np.cross(away, cloud.axes[rotor]), axis=1).max()
            sides = 2.0 if surfaces["closed"][rotor] else 1.0
            widths[rotor] = float(area[mine].sum() / (sides * diameter))
    return widths


def hidden(view: View, thin_waves: float = 0.0) -> np.ndarray:
    """Return whether each point is hidden from the station, (N, L) bool.

    thin_waves: blades narrower than this many wavelengths hide nothing.

    Raises: InputError where the target's surfaces are not given or are another target's.
    """
    surfaces, cloud = view.occluders, view.cloud
    make = "make them with python -m lowalt.targets.occluders"
    if surfaces is None:
        raise InputError(f"effects.occlusion: {cloud.subtype} has no surfaces, {make}")
    if surfaces["subtype"] != cloud.subtype or len(surfaces["offset_m"]) != len(cloud.points):
        raise InputError(
            f"effects.occlusion: surfaces of {surfaces['subtype']} with {len(surfaces['offset_m'])} points, expected "
            f"those of {cloud.subtype} with {len(cloud.points)}; {make}"
        )
    place = np.asarray(view.station.position_m, float)
    result = np.zeros(view.places.shape[:2], np.bool_)
    if view.nodes:
        capsules(place, np.ascontiguousarray(view.places), surfaces["bones"], surfaces["radius_m"], result)
        return result
    rotation, translation, points, part = view.motion
    known = np.isfinite(cloud.normals).all(axis=1)
    offset = surfaces["offset_m"]
    start = points + np.where(known[:, None], offset[:, None] * cloud.normals, 0.0)
    range_m = np.linalg.norm(view.aim_m - place)
    toward = np.where(known, 0.0, offset / range_m)
    wavelength = SPEED_OF_LIGHT / view.network.carrier_hz
    thin = [rotor for rotor, width in blade_widths_m(cloud, surfaces).items() if width < thin_waves * wavelength]
    faces = surfaces["faces"][~np.isin(surfaces["vertex_part"][surfaces["faces"][:, 0]], thin)]
    closed = surfaces["closed"][surfaces["vertex_part"][faces[:, 0]]]
    triangles(
        place, np.ascontiguousarray(rotation), np.ascontiguousarray(translation), np.asarray(part, np.int64), start,
        toward, surfaces["vertices"], surfaces["vertex_part"], faces, closed, GRID, result,
    )  # fmt: skip
    return result


def visible(settings: dict, view: View, rng: np.random.Generator | None = None) -> np.ndarray:
    """Return the factor (N, L) on every point's amplitude: 1 where the station sees it, 1 - strength where not.

    Raises: InputError where the target's surfaces are not given or are another target's.
    """
    return 1.0 - settings["strength"] * hidden(view, settings["thin_waves"])
