"""The built-in pedestrian: a parametric walk or run that drives the 31 nodes.

It stands in where no recording is given.

The modules `cyclist` and `quadruped` make a cyclist and a dog in the same way, from nodes of their
own. This module holds the human body: the lengths of its segments, the rotations of its bones by
the curves of `gait_walk` and `gait_run`, and the cloud. Axes: x right, y front, z up, metres; the
root's mean position is the origin.
"""

import hashlib
import json
from collections.abc import Sequence

import numpy as np

from lowalt.config.classes import like
from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.numerics.portable import product
from lowalt.targets import cyclist, gait_run, gait_walk, quadruped
from lowalt.targets.cloud import Cloud
from lowalt.targets.skeleton import FEET, NODES, forward_kinematics, node_cloud, rotation

STANCE_M = 0.02
"""A foot within this height of the ground carries the body."""
HIP_HEIGHT = 0.530
"""Hip (greater trochanter) above ground, in statures.

Source: Drillis and Contini 1966, in Winter's handbook.
"""

# Segment lengths are Winter's. The division of spine, neck, hand and foot among CMU's bones is an
# estimate.
_RIGHT = {
    "hipjoint": (0.0955, 0, -0.045),
    "femur": (0, 0, -0.245),
    "tibia": (0, 0, -0.246),
    "foot": (0, 0.077, -0.035),
    "toes": (0, 0.035, -0.004),
    "clavicle": (0.1295, 0, 0),
    "humerus": (0, 0, -0.186),
    "radius": (0, 0, -0.146 * 2 / 3),
    "wrist": (0, 0, -0.146 / 3),
    "hand": (0, 0, -0.05),
    "fingers": (0, 0, -0.058),
    "thumb": (0, 0.035, -0.03),
}
"""Bones of the right side: right, front and up, as shares of the stature."""
_MIDDLE = {
    "lowerback": (0, 0, 0.081),
    "upperback": (0, 0, 0.081),
    "thorax": (0, 0, 0.081),
    "lowerneck": (0, 0, 0.026),
    "upperneck": (0, 0, 0.026),
    "head": (0, 0, 0.130),
}
_TRUNK_SHARE = {
    "lowerback": 1 / 3,
    "upperback": 2 / 3,
    "thorax": 1,
    "lowerneck": 2 / 3,
    "upperneck": 1 / 3,
    "head": 0,
}


def bones_m(stature_m: float) -> np.ndarray:
    """Return the bones (31, 3) m of an average adult of `stature_m`, standing, arms down."""
    result = np.zeros((len(NODES), 3))
    for index, name in enumerate(NODES[1:], start=1):
        if name in _MIDDLE:
            result[index] = _MIDDLE[name]
        else:
            result[index] = _RIGHT[name[1:]]
            if name[0] == "l":
                result[index] *= [-1, 1, 1]
    return result * stature_m


def _toe_pitch(foot_rad: np.ndarray) -> np.ndarray:
    """The toes' pitch (rad).

    It is that of the foot while the foot points up, about a third of it where the heel is lifted.
    """
    # The ball of the foot bends at push-off, else the toes would enter the ground. A smooth
    # estimate.
    down = np.minimum(foot_rad, 0)
    width = np.radians(5)
    return np.maximum(foot_rad, 0) + 0.35 * down + 0.65 * width * (portable.exp(down / width) - 1)


def _rotations(phase: np.ndarray, leg, arm, trunk: dict[str, np.ndarray]) -> np.ndarray:
    """Return every bone's global rotation (F, 31, 3, 3).

    leg, arm: functions of the phase that give the right side's angles.
    """
    pelvis = product(rotation("z", trunk["turn"]), rotation("y", trunk["list"]))
    chest = product(rotation("z", trunk["twist"]), rotation("x", -trunk["lean"]))
    turned = {"root": pelvis}
    for name, share in _TRUNK_SHARE.items():
        # Along the neck, the yaw falls to zero.
        below = 0.0
        if name in ("lowerback", "upperback"):
            below = 1 - share
        yaw = share * trunk["twist"] + below * trunk["turn"]
        turned[name] = product(rotation("z", yaw), rotation("x", -share * trunk["lean"]))
        turned[name] = product(turned[name], rotation("y", below * trunk["list"]))
    for side, later in (("r", 0.0), ("l", 0.5)):
        hip, knee, ankle = leg((phase + later) % 1.0)
        shoulder, elbow = arm((phase + later) % 1.0)
        turned[side + "hipjoint"] = pelvis
        # The hips move with the pelvis, but the legs swing in planes along the path. A walker
        # abducts and turns the hip against the pelvis; otherwise the feet would move sideways at 1
        # m/s while they carry the body.
        turned[side + "femur"] = rotation("x", hip)
        turned[side + "tibia"] = rotation("x", hip - knee)
        turned[side + "foot"] = rotation("x", hip - knee + ankle)
        turned[side + "toes"] = rotation("x", _toe_pitch(hip - knee + ankle))
        turned[side + "clavicle"] = chest
        turned[side + "humerus"] = product(chest, rotation("x", shoulder))
        for name in ("radius", "wrist", "hand", "fingers", "thumb"):
            turned[side + name] = product(chest, rotation("x", shoulder + elbow))
    return np.stack([turned[name] for name in NODES], axis=1)


def cycle_m(
    kind: str, stature_m: float, speed_mps: float, frames: int
) -> tuple[np.ndarray, float, float]:
    """Return one cycle (frames, 31, 3) m, its duration (s) and its distance on the ground (m).

    `kind` "walk" follows Boulic et al. 1990 at `speed_mps`; "run" follows `gait_run`, whose stride
    rate is fixed, so that the stride grows with the speed. Horizontal progress is left out; the
    root's mean is the origin.
    Raises: InputError where the kind is unknown or the speed outside the model.
    """
    phase = np.arange(frames) / frames
    hip_m = HIP_HEIGHT * stature_m
    if kind == "walk":
        rv = speed_mps / hip_m
        length, duration, _ = gait_walk.timing(rv)
        turned = _rotations(
            phase,
            lambda at: gait_walk.leg(rv, at),
            lambda at: gait_walk.arm(rv, at),
            gait_walk.trunk(rv, phase),
        )
        root = gait_walk.shift(rv, phase) * hip_m
        stride = length * hip_m
    elif kind == "run":
        duration = 1 / gait_run.STRIDES_PER_SECOND
        turned = _rotations(phase, gait_run.leg, gait_run.arm, gait_run.trunk(phase))
        root = gait_run.shift_m(phase)
        stride = speed_mps * duration
    else:
        raise InputError(f"gait: {kind!r}, expected walk or run")
    nodes = forward_kinematics(root - portable.mean(root, 0), turned, bones_m(stature_m))
    return nodes, duration, stride


def stance_speed_mps(
    cycle: np.ndarray,
    rate_hz: float,
    speed_mps: float,
    feet: Sequence[int] = FEET,
) -> float:
    """Return the mean ground speed (m/s) of the lowest foot node while it carries the body.

    A foot carries the body while it is within STANCE_M of the ground. `cycle` (F, L, 3) cyclic,
    `feet` the numbers of the foot nodes, front +y, horizontal progress left out; `speed_mps` is
    added back. A foot that stands still has the speed zero. The ground is the feet's lowest point.
    """
    positions = cycle[:, feet]
    after = np.roll(positions, -1, axis=0)
    before = np.roll(positions, 1, axis=0)
    velocity = (after - before) * rate_hz / 2
    velocity[..., 1] += speed_mps
    height = positions[..., 2]
    lowest = height.argmin(axis=1)
    frames = np.arange(len(positions))
    down = height[frames, lowest] < height.min() + STANCE_M
    speeds = portable.norm(velocity[frames, lowest, :2])
    return float(portable.mean(speeds[down]))


def _cycle(record: dict, frames: int) -> tuple[np.ndarray, tuple[str, ...], float, float]:
    """One cycle (frames, L, 3) m, the nodes' names, its duration (s) and its distance (m)."""
    kind = record["gait"]
    stature = record["stature_m"]
    speed = record["speed_mps"]
    if kind not in ("cycle", "trot"):
        if stature < 0.5:
            raise InputError(f"gait: stature_m is {stature}, expected 0.5 m or more of a person")
        if speed > 6:
            raise InputError(f"gait: speed_mps is {speed}, expected 6 m/s or less of a person")
        track, duration, stride = cycle_m(kind, stature, speed, frames)
        return track, NODES, duration, stride
    if kind == "cycle":
        track, names, stride = cyclist.cycle_m(stature, frames)
        duration = stride / speed
    else:
        track, names, duration, stride = quadruped.cycle_m(
            stature, record["mass_kg"], speed, frames
        )
    middle = (track[..., 2].max() + track[..., 2].min()) / 2
    return track - [0, 0, middle], names, duration, stride


def check_record(merged: dict, where: str) -> dict:
    """Return the merged record of a built-in walk or run, checked, with its defaults.

    They are `stature_m` (the published height), `rate_hz` (400 frames per second) and `points` (one
    per node).
    Raises: InputError naming `where`, the key, the value and what was expected.
    """
    if like(merged) != "Pedestrian":
        raise InputError(
            f"{where}: source is 'gait' for a target like a {like(merged)}, expected builtin or "
            "mesh"
        )
    result = {"stature_m": merged["published"]["hgt_m"], "rate_hz": 400, **merged}
    if result.get("gait") == "trot":
        result = {"mass_kg": 30, **result}
    elif "mass_kg" in result:
        raise InputError(
            f"{where}: mass_kg is given with gait {result.get('gait')!r}, expected it with trot "
            "alone"
        )
    try:
        _, names, _, _ = _cycle(result, 8)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    return result | {"points": len(names)}


def gait_cloud(record: dict, seed: int) -> Cloud:
    """Return the cloud of a built-in pedestrian, cyclist or dog: one cycle of its nodes.

    `record` is a merged record that `check_record` has passed. The cloud's record gets cycle (s),
    stride (m), cadence, height of the origin above ground (m) and foot speed in stance (m/s). The
    model draws no random numbers; `seed` is only written into the record.
    """
    _, _, duration, _ = _cycle(record, 2)
    # A cycle has a whole number of frames and keeps its duration, so the frame rate is adjusted a
    # little.
    track, names, duration, stride = _cycle(record, max(2, round(duration * record["rate_hz"])))
    rate = len(track) / duration
    speed = stride / duration
    facts = {
        "track_rate_hz": rate,
        "cycle_s": duration,
        "stride_m": stride,
        "track_speed_mps": speed,
        "cadence_steps_per_min": 120 / duration,
        "origin_height_m": float(-track[..., 2].min()),
        "checksum": hashlib.sha256(json.dumps(record, sort_keys=True).encode()).hexdigest(),
        "seed": seed,
    }
    if record["gait"] == "cycle":
        facts["cadence"] = "tied"  # wheels turn with the speed whatever `motion.cadence` is
    else:
        feet: Sequence[int] = FEET
        if names != NODES:
            feet = [number for number, name in enumerate(names) if name.endswith("paw")]
        facts["stance_foot_speed_mps"] = stance_speed_mps(track, rate, speed, feet=feet)
    return node_cloud(track, record | facts, names)
