"""The response of flying targets to wind by class and size: mass, drag and lag of the attitude."""

import math

from lowalt.files.errors import InputError
from lowalt.numerics.portable import log, power
from lowalt.scene.target_classes import size_m
from lowalt.targets.cloud import Cloud

SOURCE = (
    "masses: makers' 0.249 kg at 0.2192 m (DJI Mini 2) and 620 kg at 5.2704 m (EH216-S), straight "
    "between in log over log size; rotor drag 0.465/s: Faessler, Franchi & Scaramuzza, IEEE Robot. "
    "Autom. Lett. 3, 2018, both axes; flat plate of 0.15 L^2: estimate; birds: Rayner, Current "
    "Ornithology 5, 1988 (span 1.17 m^0.39, wing area 0.16 m^0.72), lift to drag 6: Pennycuick, J. "
    "Exp. Biol. 49, 1968; slower with the root of the length: Froude's scaling"
)

AIR_KG_M3 = 1.225
GRAVITY_MPS2 = 9.80665
SMALL_UAV = (0.2192, 0.249)
LARGE_UAV = (5.2704, 620.0)
"""Length (m) and mass (kg) of two multirotors."""
PLATE = 0.15
"""Drag area of a multirotor's body over the square of its length."""
ROTOR_DRAG_HZ = 0.465
ROTOR_DRAG_M = 0.3
"""Rotor drag over mass and speed (1/s), of a craft of this length (m)."""
LIFT_SLOPE = 4.5
"""Lift coefficient per radian of a bird's wing."""
LIFT_TO_DRAG = 6.0
ATTITUDE_S = 0.1
ATTITUDE_M = 0.4
"""Lag of the attitude (s) of a craft of this length (m): estimate."""


def length_m(cloud: Cloud) -> float:
    """Return a flying target's length (m): the published one, or that of its body.

    Raises: InputError where neither is known.
    """
    length = float(cloud.record.get("published", {}).get("size_m") or size_m(cloud))
    if length == 0:
        raise InputError(
            f"{cloud.subtype}: its body is one point and has no size, by which it answers the "
            "wind, expected size_m in the table of targets"
        )
    return length


def mass_kg(cloud: Cloud) -> float:
    """Return the mass (kg) of a multirotor by its length, of a bird by its wing span."""
    if cloud.like == "Bird":
        span = float(cloud.record.get("wing_span_m") or 2 * length_m(cloud))
        return float(power(span / 1.17, 1 / 0.39))
    slope = float(log(LARGE_UAV[1] / SMALL_UAV[1]) / log(LARGE_UAV[0] / SMALL_UAV[0]))
    return SMALL_UAV[1] * float(power(length_m(cloud) / SMALL_UAV[0], slope))


def response_s(cloud: Cloud, airspeed_mps: float) -> tuple[float, float]:
    """Return the time constants (s) with which the air carries a target along.

    They are those for horizontal and for vertical motion.

    A body's drag, linear in small gusts, accelerates it by rho C_D A V / m times the gust. Rotors
    add theirs. A bird's drag is its weight over its lift-to-drag ratio; vertically its wing's lift
    acts, with the rate rho S V C_L' / (2 m).
    """
    mass = mass_kg(cloud)
    if cloud.like == "Bird":
        area = 0.16 * float(power(mass, 0.72))
        up = AIR_KG_M3 * area * airspeed_mps * LIFT_SLOPE / (2 * mass)
        return LIFT_TO_DRAG * airspeed_mps / (2 * GRAVITY_MPS2), 1 / up
    length = length_m(cloud)
    body = AIR_KG_M3 * PLATE * length**2 * airspeed_mps / mass
    rate = body + ROTOR_DRAG_HZ * math.sqrt(ROTOR_DRAG_M / length)
    return 1 / rate, 1 / rate


def attitude_s(cloud: Cloud) -> float:
    """Return the time constant (s) with which a target turns its thrust."""
    return ATTITUDE_S * math.sqrt(length_m(cloud) / ATTITUDE_M)
