"""The built-in dog: a trot on 27 nodes, diagonal legs together.

Stride rate follows the animal's mass, feet stand still on the ground in stance and are lifted on an
arc in swing.
Sources: rate and speed of a trot that is about to become a gallop, 269 M^-0.14 strides a minute at
5.5 M^0.24 km/h (M in kg): Heglund, Taylor and McMahon 1974, Science 186, 1112-1113; pairs and the
share of stance (0.42): Hildebrand 1968, J Mammalogy 49, 353-360. Lengths in heights at the withers,
and the sway of back, head and tail: estimates.
"""

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


def stride_hz(mass_kg: float, speed_mps: float) -> float:
    """Return the stride rate (Hz) of a trot.

    It is the rate at the change to a gallop, times the root of the share of its speed.

    Source: the module's; the root is an estimate between a fixed rate and a fixed stride.
    """
    fastest = 5.5 * portable.power(mass_kg, 0.24) / 3.6
    return float(269 / 60 / portable.power(mass_kg, 0.14) * np.sqrt(speed_mps / fastest))


def _foot(phase: np.ndarray, stride_m: float, lift_m: float) -> np.ndarray:
    """A foot's path (F, 3) about the point below its joint.

    It goes back at the ground's speed, then forward in the air.
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
    nodes["tail tip"] = nodes["tail"] + h * np.stack(
        [0.06 * sway, np.full(frames, -0.25), 0.04 * sine + 0.02], 1
    )
    # Left fore with right hind, right fore with left hind.
    for name, x, y, upper, lower, bend, later in (
        ("right fore", 0.13, 0.42, 0.36, 0.44, -1.0, 0.0),
        ("left fore", -0.13, 0.42, 0.36, 0.44, -1.0, 0.5),
        ("right hind", 0.13, -0.5, 0.42, 0.44, 1.0, 0.5),
        ("left hind", -0.13, -0.5, 0.42, 0.44, 1.0, 0.0),
    ):
        if "fore" in name:
            height = 0.74
            words = ("shoulder", "elbow", "wrist", "paw")
        else:
            height = 0.8
            words = ("hip", "knee", "hock", "paw")
        top = still + h * np.array([x, y, height]) + bob
        foot = still + h * np.array([x, y, 0.02]) + _foot(phase + later, stride, LIFT * h)
        wrist = foot + h * np.array([0, -0.03, 0.08])
        try:
            middle = joint(top, wrist, upper * h, lower * h, bend)
        except InputError as error:
            raise InputError(f"quadruped of {height_m} m at {speed_mps} m/s: {error}") from None
        for word, positions in zip(words, (top, middle, wrist, foot), strict=True):
            nodes[f"{name} {word}"] = positions
    return np.stack(list(nodes.values()), 1), tuple(nodes), duration, stride
