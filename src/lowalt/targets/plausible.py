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


def _wheel_faults(wheel: Pool, low: float, high: float) -> Iterator[str]:
    """What of a wheel's place, axis or shape is not that of a wheel; low, high: the body's height, from and to (m)."""
    lowest, highest = wheel.points.min(axis=0), wheel.points.max(axis=0)
    centre, (width, length, height) = (lowest[2] + highest[2]) / 2, highest - lowest
    if centre > (low + high) / 2:
        yield (f"its centre lies {centre - low:.3g} m above the lowest point of a body {high - low:.3g} m high, "
               "expected the lower half: is `up` reversed?")  # fmt: skip
    if abs(wheel.axis[0]) < ACROSS:
        yield f"its axis is {np.round(wheel.axis, 3).tolist()} (right, front, up), expected right or left"
    if width > ROUND * min(length, height):
        yield (f"it measures {width:.3g} m along its axis and {length:.3g} x {height:.3g} m across, expected a wheel "
               "that is thinnest along its axis")  # fmt: skip


def _rotor_faults(rotor: Pool) -> Iterator[str]:
    """Whether a rotor's hub is too far from the middle of its blades."""
    low, high = rotor.points.min(axis=0), rotor.points.max(axis=0)
    reach, away = float((high - low).max()), float(np.linalg.norm((low + high) / 2 - rotor.hinge))
    if away > OFF_HUB * reach:
        yield (f"its hinge lies {away:.3g} m from the middle of its surface, which reaches {reach:.3g} m, expected the "
               "hub")  # fmt: skip


def _wing_faults(wing: Pool, middle: float) -> Iterator[str]:
    """Whether the hinge of a wing on the body lies at the wing's tip; middle: of the body, to the right (m)."""
    hinge, centre = wing.hinge[0] - middle, wing.points[:, 0].mean() - middle
    if abs(hinge) > abs(centre) or (hinge * centre < 0 and abs(hinge) > 0.1 * abs(centre)):
        yield (f"its hinge lies {hinge:.3g} m and its surface {centre:.3g} m right of the body's middle, expected the "
               "hinge between body and wing")  # fmt: skip


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
    body = next(pool.points for name, pool in parts.items() if kinds[name] == "body")
    (left, _, low), (right, _, high) = body.min(axis=0), body.max(axis=0)
    of_kind: dict[str, list[Pool]] = {"rotor": [], "wheel": [], "wing": []}
    faults = []
    for name, pool in parts.items():
        kind = kinds[name]
        if kind == "body" or (kind == "wing" and name in parents):
            continue
        of_kind[kind].append(pool)
        if kind == "wheel":
            of_part = _wheel_faults(pool, low, high)
        else:
            of_part = _rotor_faults(pool) if kind == "rotor" else _wing_faults(pool, (left + right) / 2)
        faults += [f"{name}: {fault}" for fault in of_part]
    if faults:
        raise InputError(f"{where}: " + "; ".join(faults))
    for doubt in _doubts(of_kind, category, count):
        warnings.warn(f"{where}: {doubt}", InputWarning, stacklevel=2)
