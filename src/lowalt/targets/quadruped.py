"""The built-in dog: a trot on 27 nodes, diagonal legs together.

Stride rate follows the animal's mass, feet stand still on the ground in stance and are lifted on an
arc in swing.
Sources: rate and speed of a trot that is about to become a gallop, 269 M^-0.14 strides a minute at
5.5 M^0.24 km/h (M in kg): Heglund, Taylor and McMahon 1974, Science 186, 1112-1113; pairs and the
share of stance (0.42): Hildebrand 1968, J Mammalogy 49, 353-360. Lengths in heights at the withers,
and the sway of back, head and tail: estimates.
"""

from typing import NamedTuple

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.targets.skeleton import both_sides, joint

STANCE = 0.42
"""Share of a stride in which a foot is on the ground."""
CHAINS = (
    ("nose", "skull", "neck", "withers", "back", "loin", "croup", "tail", "tail tip"),
    ("neck", "chest", "belly", "loin"),
    *both_sides("withers", "fore shoulder", "fore elbow", "fore wrist", "fore paw"),
    *both_sides("croup", "hind hip", "hind knee", "hind hock", "hind paw"),
)
"""Nodes that a line joins in pictures."""
LIFT = 0.16
"""Height of a foot in mid swing, in heights at the withers."""


class Leg(NamedTuple):
    """A leg: lengths and positions in heights at the withers; estimates.

    joints: names from the top down; x, y, z: where its top joint stands, to the right, to the front
    and up; upper, lower: lengths of its bones; bend: as for `skeleton.joint`; start: its phase in
    frame 0, in strides after its foot has met the ground.
    """

    name: str
    joints: tuple[str, str, str, str]
    x: float
    y: float
    z: float
    upper: float
    lower: float
    bend: float
    start: float


_FORE = ("shoulder", "elbow", "wrist", "paw")
_HIND = ("hip", "knee", "hock", "paw")
LEGS = (
    Leg("right fore", _FORE, 0.13, 0.42, 0.74, upper=0.36, lower=0.44, bend=-1.0, start=0.0),
    Leg("left fore", _FORE, -0.13, 0.42, 0.74, upper=0.36, lower=0.44, bend=-1.0, start=0.5),
    Leg("right hind", _HIND, 0.13, -0.5, 0.8, upper=0.42, lower=0.44, bend=1.0, start=0.5),
    Leg("left hind", _HIND, -0.13, -0.5, 0.8, upper=0.42, lower=0.44, bend=1.0, start=0.0),
)
"""In a trot the left fore leg steps with the right hind leg, and the other two step together."""


def stride_hz(mass_kg: float, speed_mps: float) -> float:
    """Return the stride rate (Hz) of a trot.

    It is the rate at the change to a gallop, times the root of the share of its speed.

    Source: the module's; the root is an estimate between a fixed rate and a fixed stride.
    """
    # From km/h to m/s, and from strides a minute to strides a second.
    gallop_mps = 5.5 * portable.power(mass_kg, 0.24) / 3.6
    gallop_hz = 269 / 60 / portable.power(mass_kg, 0.14)
    return float(gallop_hz * np.sqrt(speed_mps / gallop_mps))


def _foot(phase: np.ndarray, stride_m: float, lift_m: float) -> np.ndarray:
    """Return a foot's path (F, 3) about the point below its joint (m).

    phase (F,): in strides after the foot meets the ground. It goes back at the ground's speed, then
    forward in the air.
    """
    at = phase % 1.0
    half = STANCE * stride_m / 2
    swing = np.clip((at - STANCE) / (1 - STANCE), 0, 1)
    # Leaves and meets the ground at its speed: a cubic from -half to half with both end slopes
    # those of stance.
    slope = -2 * half / STANCE * (1 - STANCE)
    # Products, since the last bit of a library's cube depends on the processor.
    cubic = -half + swing * (
        slope + swing * (6 * half - 3 * slope + swing * (2 * slope - 4 * half))
    )
    y = np.where(at < STANCE, half - 2 * half * at / STANCE, cubic)
    sine = portable.sine_cosine_turns(swing / 2)[0]
    return np.stack([np.zeros(len(at)), y, lift_m * sine * sine], 1)


_TRUNK = {
    "withers": (0, 0.48, 0.98),
    "back": (0, 0.1, 0.94),
    "loin": (0, -0.25, 0.94),
    "croup": (0, -0.5, 0.9),
    "neck": (0, 0.7, 1.12),
    "skull": (0, 0.86, 1.28),
    "nose": (0, 1.1, 1.2),
    "chest": (0, 0.45, 0.62),
    "belly": (0, -0.05, 0.62),
    "tail": (0, -0.7, 0.85),
}
"""Nodes of trunk, neck and head: right, front and up, as shares of the height at the withers."""


def cycle_m(
    height_m: float, mass_kg: float, speed_mps: float, frames: int
) -> tuple[np.ndarray, tuple[str, ...], float, float]:
    """Return one stride (frames, 27, 3) m, the nodes' names, its duration (s) and its length (m).

    height_m: at the withers. The origin lies on the ground below the middle of the back.
    Raises: InputError where the legs do not reach the ground at this speed.
    """
    duration = 1 / stride_hz(mass_kg, speed_mps)
    stride = speed_mps * duration
    phase = np.arange(frames) / frames
    still = np.zeros((frames, 3))
    h = height_m
    sine, cosine = portable.sine_cosine_turns(2 * phase)
    bob = np.stack([np.zeros(frames), np.zeros(frames), 0.02 * h * cosine], 1)
    sway = portable.sine_cosine_turns(phase)[0]
    nodes = {name: still + h * np.array(shares) + bob for name, shares in _TRUNK.items()}
    nodes["nose"] = nodes["nose"] + 0.03 * h * sine[:, None] * [0, 0, 1.0]
    wag = np.stack([0.06 * sway, np.full(frames, -0.25), 0.04 * sine + 0.02], 1)
    nodes["tail tip"] = nodes["tail"] + h * wag
    for leg in LEGS:
        top = still + h * np.array([leg.x, leg.y, leg.z]) + bob
        step = _foot(phase + leg.start, stride, LIFT * h)
        foot = still + h * np.array([leg.x, leg.y, 0.02]) + step
        wrist = foot + h * np.array([0, -0.03, 0.08])
        try:
            middle = joint(top, wrist, leg.upper * h, leg.lower * h, leg.bend)
        except InputError as error:
            raise InputError(f"quadruped of {height_m} m at {speed_mps} m/s: {error}") from None
        for name, positions in zip(leg.joints, (top, middle, wrist, foot), strict=True):
            nodes[f"{leg.name} {name}"] = positions
    return np.stack(list(nodes.values()), 1), tuple(nodes), duration, stride
