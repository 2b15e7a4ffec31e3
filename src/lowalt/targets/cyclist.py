"""The built-in cyclist: a rider of 18 nodes who pedals, and a bicycle with turning wheels.

The rider sits still above the hips; feet follow the pedals, knees follow from the lengths of thigh
and shank. Segment lengths are shares of the stature: Drillis and Contini 1966, in Winter's
handbook. A wheel is a hub and points on its rim. Other numbers (metres, and unit vectors of the
back's and the head's direction) are estimates.
"""

import numpy as np

from lowalt.targets.skeleton import both_sides, circle, joint

WHEEL_M = 0.678
"""Diameter of a road wheel: ISO 5775 size 28-622, 622 mm and twice 28 mm."""
CRANK_M = 0.170
"""Length of a crank; estimate."""
WHEEL_BASE_M = 1.02
"""Distance between the hubs; estimate."""
GEAR = 3
"""Turns of the wheels for each turn of the cranks.

A whole number closes the cycle. 1.0 turn/s is then 6.4 m/s.
"""
RIM = 8
"""Points on each rim."""


def _rim(wheel: str) -> tuple[str, ...]:
    """The nodes around a wheel's rim, the first one again at the end."""
    return (*(f"{wheel} rim {point + 1}" for point in range(RIM)), f"{wheel} rim 1")


CHAINS = (
    ("head", "neck", "chest", "pelvis"),
    *both_sides("neck", "shoulder", "elbow", "hand"),
    *both_sides("pelvis", "hip", "knee", "ankle", "foot"),
    ("rear hub", "bracket", "saddle", "rear hub"),
    ("bracket", "steerer", "saddle"),
    ("steerer", "front hub"),
    _rim("front"),
    _rim("rear"),
)
"""Nodes that a line joins in pictures."""
SEAT_TUBE = np.array([0, -0.29, 0.957])
"""Direction from the cranks to the hips: 17 degrees (estimate) behind the vertical, rounded."""
_BRACKET = np.array([0.0, -0.04, 0.27])
"""Axle of the cranks: behind the middle of the wheel base, above the ground (m); estimate."""


def cycle_m(stature_m: float, frames: int) -> tuple[np.ndarray, tuple[str, ...], float]:
    """Return one turn of the cranks (frames, nodes, 3) m, the nodes' names, and its distance (m).

    The origin lies in the middle of the wheel base on the ground.
    Raises: InputError where the rider's legs do not reach the pedals.
    """
    phase = np.arange(frames) / frames
    still = np.zeros((frames, 3))
    thigh = 0.245 * stature_m
    shank = 0.285 * stature_m
    # The saddle lets the leg stretch to 96 % at the lowest pedal (estimate).
    reach = 0.96 * (thigh + shank) - CRANK_M
    hip = _BRACKET + reach * SEAT_TUBE
    lean = np.array([0, 0.72, 0.69])
    shoulder = hip + 0.288 * stature_m * lean
    grip = np.array([0.0, 0.36, 0.98])
    nodes = {
        "pelvis": hip,
        "chest": hip + 0.17 * stature_m * lean,
        "neck": shoulder,
        "head": shoulder + 0.13 * stature_m * np.array([0, 0.35, 0.94]),
    }
    # Frame 0 has the right pedal at the top; the left one is half a turn from it. `circle` turns
    # over the front, as the wheels do.
    for side, name, start in ((1, "right", 0.0), (-1, "left", 0.5)):
        out = np.array([side * 0.09, 0, 0])
        foot = still + _BRACKET + out + circle(phase + start, CRANK_M)
        # The ankle stands above and behind the ball of the foot, which is on the pedal.
        ankle = foot + np.array([0, -0.09, 0.07])
        nodes |= {
            f"{name} hip": hip + out,
            f"{name} knee": joint(still + hip + out, ankle, thigh, shank, bend=1.0),
            f"{name} ankle": ankle,
            f"{name} foot": foot,
        }
        wide = np.array([side * 0.2, 0, 0])
        hand = grip + wide
        upper = shoulder + 0.9 * wide
        elbow = (hand + upper) / 2 + np.array([0.05 * side, -0.02, -0.05])
        nodes |= {f"{name} shoulder": upper, f"{name} elbow": elbow, f"{name} hand": hand}
    nodes["saddle"] = hip - [0, 0, 0.1]
    nodes["bracket"] = _BRACKET
    nodes["steerer"] = np.array([0, 0.33, 0.9])
    radius = WHEEL_M / 2
    for name, y in (("front", WHEEL_BASE_M / 2), ("rear", -WHEEL_BASE_M / 2)):
        hub = np.array([0, y, radius])
        nodes[f"{name} hub"] = hub
        for point in range(RIM):
            turns = GEAR * phase + point / RIM
            nodes[f"{name} rim {point + 1}"] = hub + circle(turns, radius)
    track = np.stack([still + position for position in nodes.values()], 1)
    return track, tuple(nodes), GEAR * np.pi * WHEEL_M
