"""Self-occlusion: points that the target's own surfaces hide from a station do not echo.

Straight rays, point by point and symbol by symbol, against the surfaces of all parts as they turn; shadows are sharp.
Waves on other paths (a ground reflection) are taken to be hidden where the direct one is.
"""

import numpy as np

from lowalt.common.errors import InputError
from lowalt.effects.channel.shadows import GRID, capsules, triangles
from lowalt.effects.view import View

SOURCE = (
    "geometrical optics: Knott, Shaeffer & Tuley, Radar Cross Section, 2nd ed. 1993, chapter 5 (shadowing); "
    "visible points by their depth on a screen: Catmull, A Subdivision Algorithm for Computer Display of Curved "
    "Surfaces, 1974, computed here at the points themselves"
)
DEFAULTS = {"strength": 1.0}


def idle(settings: dict) -> bool:
    """Return whether hidden points echo as if nothing were before them."""
    return settings["strength"] == 0


def hidden(view: View) -> np.ndarray:
    """Return whether each point is hidden from the station, (N, L) bool.

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
    closed = surfaces["closed"][surfaces["vertex_part"][surfaces["faces"][:, 0]]]
    triangles(
        place, np.ascontiguousarray(rotation), np.ascontiguousarray(translation), np.asarray(part, np.int64), start,
        toward, surfaces["vertices"], surfaces["vertex_part"], surfaces["faces"], closed, GRID, result,
    )  # fmt: skip
    return result


def visible(settings: dict, view: View, rng: np.random.Generator | None = None) -> np.ndarray:
    """Return the factor (N, L) on every point's amplitude: 1 where the station sees it, 1 - strength where not.

    Raises: InputError where the target's surfaces are not given or are another target's.
    """
    return 1.0 - settings["strength"] * hidden(view)
