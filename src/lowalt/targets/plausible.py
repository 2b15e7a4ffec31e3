"""Whether the parts of a user's mesh fit their kinds: wheels below a car, a hub in the middle of its blades.

A wrong direction, unit or hinge still gives a cloud; this module finds it by the geometry of the parts. Pure functions
over pools in body axes (x right, y front, z up, metres, the mesh's own size), before anything is scaled or set on the
ground.
"""

import warnings

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


def _extent(points: np.ndarray) -> np.ndarray:
    """Extents (3,) of points (N, 3)."""
    return np.ptp(points, axis=0)


def _wheel_faults(parts: dict[str, Pool], kinds: dict[str, str]) -> list[str]:
    """Return a sentence for each wheel whose place, axis or shape is not that of a wheel."""
    body = next(pool.points for name, pool in parts.items() if kinds[name] == "body")
    low, high = body[:, 2].min(), body[:, 2].max()
    found = []
    for name, pool in parts.items():
        if kinds[name] != "wheel":
            continue
        centre = (pool.points[:, 2].min() + pool.points[:, 2].max()) / 2
        if centre > (low + high) / 2:
            found.append(
                f"{name}: its centre lies {centre - low:.3g} m above the lowest point of a body {high - low:.3g} m "
                "high, expected the lower half: is `up` reversed?"
            )
        if abs(pool.axis[0]) < ACROSS:
            found.append(
                f"{name}: its axis is {np.round(pool.axis, 3).tolist()} (right, front, up), expected right or left"
            )
        width, length, height = _extent(pool.points)
        if width > ROUND * min(length, height):
            found.append(f"{name}: it measures {width:.3g} m along its axis and {length:.3g} x {height:.3g} m across, "
                         "expected a wheel that is thinnest along its axis")  # fmt: skip
    return found


def _rotor_faults(parts: dict[str, Pool], kinds: dict[str, str]) -> list[str]:
    """Return a sentence for each rotor whose hub is too far from the middle of its blades."""
    found = []
    for name, pool in parts.items():
        if kinds[name] == "rotor":
            reach = float(_extent(pool.points).max())
            away = float(np.linalg.norm((pool.points.min(axis=0) + pool.points.max(axis=0)) / 2 - pool.hinge))
            if away > OFF_HUB * reach:
                found.append(
                    f"{name}: its hinge lies {away:.3g} m from the middle of its surface, which reaches {reach:.3g} "
                    "m, expected the hub"
                )
    return found


def _wing_faults(parts: dict[str, Pool], kinds: dict[str, str], parents: dict[str, str]) -> list[str]:
    """One sentence for each wing whose hinge lies at its tip."""
    body = next(pool.points for name, pool in parts.items() if kinds[name] == "body")
    middle = (body[:, 0].min() + body[:, 0].max()) / 2
    found = []
    for name, pool in parts.items():
        if kinds[name] == "wing" and name not in parents:
            hinge, centre = pool.hinge[0] - middle, pool.points[:, 0].mean() - middle
            if abs(hinge) > abs(centre) or (hinge * centre < 0 and abs(hinge) > 0.1 * abs(centre)):
                found.append(
                    f"{name}: its hinge lies {hinge:.3g} m and its surface {centre:.3g} m right of the body's middle, "
                    "expected the hinge between body and wing"
                )
    return found


def _doubts(
    parts: dict[str, Pool], kinds: dict[str, str], parents: dict[str, str], category: str, count: int | None
) -> list[str]:
    """One sentence for each thing that is unusual but possible."""
    found = []
    wheels = [pool for name, pool in parts.items() if kinds[name] == "wheel"]
    if category == "Vehicle" and len(wheels) < FEWEST_WHEELS:
        found.append(f"{len(wheels)} wheels, expected at least {FEWEST_WHEELS}")
    rotors = sum(kind == "rotor" for kind in kinds.values())
    if category == "UAV" and count and rotors != count:
        found.append(f"{rotors} rotors, expected the {count} of its row")
    for kind, roots in (
        ("wheel", wheels),
        ("wing", [parts[name] for name in parts if kinds[name] == "wing" and name not in parents]),
    ):
        sides = {float(np.sign(pool.points[:, 0].mean())) for pool in roots}
        if len(roots) > 1 and len(sides) < 2:
            found.append(f"every {kind} is on one side of the target, expected both sides")
    return found


def refuse_implausible(
    parts: dict[str, Pool], kinds: dict[str, str], parents: dict[str, str], category: str, where: str,
    count: int | None = None,
) -> None:  # fmt: skip
    """Refuse parts whose shape contradicts their kind, and warn of unusual ones.

    `parts` are pools in body axes by name, `kinds` their kinds, `parents` the parent of each part that has one,
    `category` the published class that the target is like, `count` the rotors of its row.
    Raises: InputError naming `where`, the part, the measures and what was expected. Warns: InputWarning.
    """
    faults = _wheel_faults(parts, kinds) + _rotor_faults(parts, kinds) + _wing_faults(parts, kinds, parents)
    if faults:
        raise InputError(f"{where}: " + "; ".join(faults))
    for doubt in _doubts(parts, kinds, parents, category, count):
        warnings.warn(f"{where}: {doubt}", InputWarning, stacklevel=2)
