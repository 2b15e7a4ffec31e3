"""Whether the parts of a user's mesh fit their kinds: wheels below a car, a hub in the middle of its blades.

A wrong direction, unit or hinge still gives a cloud; this module finds it by the geometry of the parts. Pure functions
over pools in body axes (x right, y front, z up, metres, the mesh's own size), before anything is scaled or set on the
ground.
"""

import warnings
from collections.abc import Iterator

import numpy as np

from lowalt.files.errors import InputError, InputWarning
from lowalt.targets.mesh_parts import Pool

ACROSS = np.cos(np.radians(20.0))
"""Least cosine between a wheel's axis and the car's width; models have their front wheels straight."""
ROUND = 1.1
"""Largest ratio of a wheel's width to the smaller of its two extents across the axis."""
OFF_HUB = 1.0
"""Largest distance from a rotor's hub to the middle of its surface, in parts of the rotor's own largest extent; a
single blade without its hub may have up to 1."""
FEWEST_WHEELS = 3


def _faults(kind: str, pool: Pool, body: np.ndarray) -> Iterator[str]:
    """What of a part's place, axis or shape is not that of its kind; body (2, 3): the body's low and high corner."""
    low, high = pool.points.min(axis=0), pool.points.max(axis=0)
    middle, (width, length, height) = (low + high) / 2, high - low
    if kind == "wheel":
        below, above = body[:, 2]
        if middle[2] > (below + above) / 2:
            yield (f"its centre lies {middle[2] - below:.3g} m above the lowest point of a body {above - below:.3g} m "
                   "high, expected the lower half: is `up` reversed?")  # fmt: skip
        if abs(pool.axis[0]) < ACROSS:
            yield f"its axis is {np.round(pool.axis, 3).tolist()} (right, front, up), expected right or left"
        if width > ROUND * min(length, height):
            yield (f"it measures {width:.3g} m along its axis and {length:.3g} x {height:.3g} m across, expected a "
                   "wheel that is thinnest along its axis")  # fmt: skip
    elif kind == "rotor":
        reach, away = float((high - low).max()), float(np.linalg.norm(middle - pool.hinge))
        if away > OFF_HUB * reach:
            yield (f"its hinge lies {away:.3g} m from the middle of its surface, which reaches {reach:.3g} m, expected "
                   "the hub")  # fmt: skip
    else:
        hinge, centre = (place[0] - body[:, 0].mean() for place in (pool.hinge, pool.points.mean(axis=0)))
        if abs(hinge) > abs(centre) or (hinge * centre < 0 and abs(hinge) > 0.1 * abs(centre)):
            yield (f"its hinge lies {hinge:.3g} m and its surface {centre:.3g} m right of the body's middle, expected "
                   "the hinge between body and wing")  # fmt: skip


def _doubts(of_kind: dict[str, list[Pool]], category: str, count: int | None) -> Iterator[str]:
    """What is unusual but possible about the parts of each kind; wings are those on the body."""
    wheels, rotors = len(of_kind["wheel"]), len(of_kind["rotor"])
    if category == "Vehicle" and wheels < FEWEST_WHEELS:
        yield f"{wheels} wheels, expected at least {FEWEST_WHEELS}"
    if category == "UAV" and count and rotors != count:
        yield f"{rotors} rotors, expected the {count} of its row"
    for kind in ("wheel", "wing"):
        sides = {float(np.sign(pool.points[:, 0].mean())) for pool in of_kind[kind]}
        if len(of_kind[kind]) > 1 and len(sides) < 2:
            yield f"every {kind} is on one side of the target, expected both sides"


def refuse_implausible(
    parts: dict[str, Pool], kinds: dict[str, str], parents: dict[str, str], category: str, where: str,
    count: int | None = None,
) -> None:  # fmt: skip
    """Refuse parts whose shape contradicts their kind, and warn of unusual ones.

    `parts` are pools in body axes by name, `kinds` their kinds, `parents` the parent of each part that has one,
    `category` the published class that the target is like, `count` the rotors of its row.
    Raises: InputError naming `where`, the part, the measures and what was expected. Warns: InputWarning.
    """
    points = next(pool.points for name, pool in parts.items() if kinds[name] == "body")
    body = np.stack([points.min(axis=0), points.max(axis=0)])
    of_kind: dict[str, list[Pool]] = {"rotor": [], "wheel": [], "wing": []}
    faults = []
    for name, pool in parts.items():
        kind = kinds[name]
        if kind == "body" or (kind == "wing" and name in parents):
            continue
        of_kind[kind].append(pool)
        faults += [f"{name}: {fault}" for fault in _faults(kind, pool, body)]
    if faults:
        raise InputError(f"{where}: " + "; ".join(faults))
    for doubt in _doubts(of_kind, category, count):
        warnings.warn(f"{where}: {doubt}", InputWarning, stacklevel=2)
