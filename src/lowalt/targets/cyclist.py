"""The built-in cyclist: a rider of 18 nodes who pedals, and a bicycle with turning wheels.

The rider sits still above the hips; feet follow the pedals, knees follow from the lengths of thigh
and shank. Segment lengths are shares of the stature: Drillis and Contini 1966, in Winter's
handbook. A wheel is a hub and points on its rim.
"""

import numpy as np

from lowalt.targets.skeleton import both_sides, circle, joint

WHEEL_M = 0.678
"""Diameter of a road wheel: ISO 5775 size 28-622, 622 mm and twice 28 mm."""
CRANK_M = 0.170
WHEEL_BASE_M = 1.02
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
_BRACKET = np.array([0.0, -0.04, 0.27])
"""Axle of the cranks: behind the middle of the wheel base, above the ground (m)."""


def cycle_m(stature_m: float, frames: int) -> tuple[np.ndarray, tuple[str, ...], float]:
    """Return one turn of the cranks (frames, nodes, 3) m, the nodes' names, and its distance (m).

    The origin lies in the middle of the wheel base on the ground.
    Raises: InputError where the rider's legs do not reach the pedals.
    """
    phase = np.arange(frames) / frames
    still = np.zeros((frames, 3))
    thigh = 0.245 * stature_m
    shank = 0.285 * stature_m
    # The saddle lets the leg stretch to 96 % at the lowest pedal; the seat tube leans back by 17
    # degrees.
    reach = 0.96 * (thigh + shank) - CRANK_M
    hip = _BRACKET + reach * np.array([0, -0.29, 0.957])
    lean = np.array([0, 0.72, 0.69])
    shoulder = hip + 0.288 * stature_m * lean
    grip = np.array([0.0, 0.36, 0.98])
    nodes = {
        "pelvis": hip,
        "chest": hip + 0.17 * stature_m * lean,
        "neck": shoulder,
        "head": shoulder + 0.13 * stature_m * np.array([0, 0.35, 0.94]),
    }
    for side, name, later in ((1, "right", 0.0), (-1, "left", 0.5)):
        out = np.array([side * 0.09, 0, 0])
        foot = still + _BRACKET + out + circle(phase + later, CRANK_M)
        # The ankle stands above and behind the ball of the foot, which is on the pedal.
        ankle = foot + np.array([0, -0.09, 0.07])
        nodes |= {
            f"{name} hip": hip + out,
            f"{name} knee": joint(still + hip + out, ankle, thigh, shank, 1.0),
            f"{name} ankle": ankle,
            f"{name} foot": foot,
        }
        wide = np.array([side * 0.2, 0, 0])
        hand = grip + wide
        upper = shoulder + 0.9 * wide
        elbow = (hand + upper) / 2 + np.array([0.05 * side, -0.02, -0.05])
        nodes |= {f"{name} shoulder": upper, f"{name} elbow": elbow, f"{name} hand": hand}
    nodes |= {"saddle": hip - [0, 0, 0.1], "bracket": _BRACKET, "steerer": np.array([0, 0.33, 0.9])}
    for name, y in (("front", WHEEL_BASE_M / 2), ("rear", -WHEEL_BASE_M / 2)):
        hub = np.array([0, y, WHEEL_M / 2])
        nodes[f"{name} hub"] = hub
        for point in range(RIM):
            nodes[f"{name} rim {point + 1}"] = hub + circle(GEAR * phase + point / RIM, WHEEL_M / 2)
    track = np.stack([still + position for position in nodes.values()], 1)
    return track, tuple(nodes), GEAR * np.pi * WHEEL_M
