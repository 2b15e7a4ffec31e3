"""Running angles over one cycle at about 3 m/s, and where each figure comes from.

Phase 0 is the right foot's first contact. Control points are joined by the same monotone periodic
curves as those of the walk. The tables are in degrees, the functions return radians; flexion is
positive. Sources: [H] Heiderscheit et al. 2011, Med Sci Sports Exerc 43(2) 296-302, table 3,
preferred step rate; [L] Lieberman et al. 2015, J Exp Biol 218, 3406-3414: 84.8 strides a minute at
3.0 m/s; [N] Novacheck 1998, "The biomechanics of running", Gait and Posture 7, 77-95: toe-off at 39
% of the cycle, swing knee about 90 degrees, ankle from about 25 degrees up in mid-stance to 20 down
at toe-off (read from curves); [E] estimate; estimates for the leg are fitted so that at 3 m/s the
foot stays on the ground and slides least. Hip angles are those of the thigh against the vertical:
[H] minus 1 degree, which is fitted to the pelvis.
"""

import numpy as np

from lowalt.numerics.portable import sine_cosine_turns
from lowalt.targets.gait_walk import through

STRIDES_PER_SECOND = 84.8 / 60
"""Stride rate in Hz [L]."""

SUPPORT = 0.39
"""Share of the cycle with the foot on the ground [N]."""

HIP = ((0.0, 26.0), (0.12, 17.0), (0.44, -20.0), (0.82, 45.0))
"""[H] at contact; [E] the rest."""

KNEE = ((0.0, 17.8), (0.15, 46.3), (0.40, 27.0), (0.68, 90.0), (0.95, 16.0))
"""[H] at contact and in stance; [N] swing; [E] toe-off and before contact."""

ANKLE = ((0.0, 1.0), (0.20, 26.0), (0.46, -20.0), (0.70, 0.0))
"""[N] stance and toe-off; [E] the rest."""

ELBOW_DEG = 90.0
ELBOW_SWING_DEG = 12.0
SHOULDER_DEG = -15.0
SHOULDER_SWING_DEG = 27.0
TURN_DEG = 8.0
TWIST_DEG = 14.0
LEAN_DEG = 7.0
BOB_M = 0.035
"""All [E]; `BOB_M` is half the range of the bob."""


def leg(phase: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return flexion (rad) of hip, knee and ankle of the right leg, each shaped like `phase`."""
    hip = np.radians(through(list(HIP), phase))
    knee = np.radians(through(list(KNEE), phase))
    ankle = np.radians(through(list(ANKLE), phase))
    return hip, knee, ankle


def arm(phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return flexion (rad) of shoulder and elbow of the right arm, each shaped like `phase`."""
    swing = sine_cosine_turns(phase)[1]
    shoulder = SHOULDER_DEG - SHOULDER_SWING_DEG * swing
    return np.radians(shoulder), np.radians(ELBOW_DEG - ELBOW_SWING_DEG * swing)


def trunk(phase: np.ndarray) -> dict[str, np.ndarray]:
    """Return the trunk's rotations (rad) by name, as `gait_walk.trunk` does.

    Each is shaped like `phase`.
    """
    swing = sine_cosine_turns(phase)[1]
    angles = {
        "list": np.zeros_like(swing),
        "turn": TURN_DEG * swing,
        "lean": np.full_like(swing, LEAN_DEG),
        "twist": -TWIST_DEG * swing,
    }
    return {name: np.radians(value) for name, value in angles.items()}


def shift_m(phase: np.ndarray) -> np.ndarray:
    """Return the root's periodic translation (..., 3) in metres.

    It is lowest in each mid-stance, highest in flight.
    """
    up = -BOB_M * sine_cosine_turns(2 * np.asarray(phase) - SUPPORT)[1]
    return np.stack([np.zeros_like(up), np.zeros_like(up), up], axis=-1)
