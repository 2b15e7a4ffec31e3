"""Walking angles over one cycle: the curves of Boulic, Magnenat-Thalmann and Thalmann.

Source: "A global human walking model with real-time kinematic personification", The Visual Computer
6 (1990) 344-358. Everything depends on the relative speed rv = v / (hip height), 0 < rv <= 3, and
on the phase in [0, 1), 0 at the right heel strike. The paper has degrees, the functions return
radians; flexion is positive.
"""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics.portable import sine_cosine_turns

SLOW = 0.5
"""Relative speed up to which most amplitudes grow."""


def through(points: list[tuple[float, float]], phase: np.ndarray) -> np.ndarray:
    """Return a periodic, continuously differentiable curve through control points, at `phase`.

    points: (phase, value) of each.

    The curve is monotone between control points (Fritsch and Carlson 1980), so it does not
    overshoot. `phase` may have any values.
    """
    times, values = np.array(sorted((time % 1.0, value) for time, value in points)).T
    phase = np.asarray(phase) % 1.0
    width = np.diff(times, append=times[0] + 1)
    rise = np.diff(values, append=values[0])
    steep = rise / width
    before = np.roll(width, 1)
    earlier = np.roll(rise / width, 1)
    # The weighted harmonic mean of the slopes on both sides, 0 at a peak or a dip.
    same = steep * earlier > 0
    safe = np.where(same, steep * earlier, 1.0)
    first = 2 * width + before
    second = width + 2 * before
    weighted = first * np.where(same, steep, 1.0) + second * earlier
    slope = np.where(same, (first + second) * safe / weighted, 0.0)
    left = np.searchsorted(times, phase, side="right") - 1
    along = np.where(left < 0, phase + 1, phase) - times[left]
    near = slope[left]
    far = np.roll(slope, -1)[left]
    long = width[left]
    share = along / long
    mean = steep[left]
    square = along * (3 * mean - 2 * near - far) / long
    return values[left] + along * (near + square - share * share * (2 * mean - near - far))


def timing(rv: float) -> tuple[float, float, float]:
    """Return (cycle length / hip height, duration in s, share of support) at relative speed rv.

    Raises: InputError where rv is outside the model's 0 < rv <= 3.
    """
    if not 0 < rv <= 3:
        raise InputError(
            f"gait: relative speed {rv:.3g} hip heights a second, expected more than 0 and at most "
            "3"
        )
    length = 1.346 * np.sqrt(rv)
    duration = length / rv
    support = (0.752 * duration - 0.143) / duration
    return float(length), float(duration), float(support)


def leg(rv: float, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return flexion (rad) of hip, knee and ankle of the right leg, each shaped like `phase`.

    The left leg is half a cycle later. There are three ranges of relative speed: the amplitudes
    grow up to 0.5, stay constant up to 1.3, and change a little up to 3.
    """
    _, _, support = timing(rv)
    slow = min(rv, 0.5) / 0.5
    fast = max(rv - 1.3, 0) / 1.7
    hip = [(0.2 * fast - 0.1, 25 * slow + 5 * fast), (0.5, -15 * slow), (0.9, 25 * slow + 6 * fast)]
    if fast == 0:
        hip = hip[1:]  # the first control point is the last one, a cycle earlier
    knee = [
        (0.17 - 0.05 * fast, 3 + 22 * fast),
        (0.4, 3),
        (0.75 - 0.05 * fast, 70 * slow - 5 * fast),
        (1 - 0.03 * fast, 3 + 3 * fast),
    ]
    ankle = [
        (0, -3 + 5 * fast),
        (0.08, -3 - 15 * slow + 4 * fast),
        (0.5 - 0.1 * fast, -3 + 11 * slow - 3 * fast),
        (support, -3 - 17 * slow - 8 * fast),
        (0.85, -3 + 5 * fast),
    ]
    return (
        np.radians(through(hip, phase)),
        np.radians(through(knee, phase)),
        np.radians(through(ankle, phase)),
    )


def arm(rv: float, phase: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return flexion (rad) of shoulder and elbow of the right arm, each shaped like `phase`."""
    swing = 9.88 * rv
    shoulder = 3 - swing / 2 - swing * sine_cosine_turns(phase)[1]
    slow = min(rv, 0.5)
    middle = min(max(rv - 0.5, 0) / 0.8, 1)
    fast = max(rv - 1.3, 0) / 1.7
    elbow = [
        (0.05, 3 + 6 * slow + 8 * middle - 6 * fast),
        (0.5 + 0.01 * middle + 0.04 * fast, 3 + 34 * slow + 24 * middle + 26 * fast),
        (0.9 - 0.1 * fast, 3 + 10 * slow + 9 * middle - 6 * fast),
    ]
    return np.radians(shoulder), np.radians(through(elbow, phase))


def trunk(rv: float, phase: np.ndarray) -> dict[str, np.ndarray]:
    """Return the trunk's rotations (rad), each shaped like `phase`.

    `list` lowers the swinging side (positive lowers the right hip), `turn` brings the right hip
    forward, `lean` tilts the trunk forward, `twist` brings the right shoulder forward.
    """
    phase = np.asarray(phase) % 1.0
    drop = 1.66 * rv
    first = phase < 0.15
    second = phase < 0.5
    third = phase < 0.65
    sway = np.select(
        [first, second, third],
        [
            -drop + drop * sine_cosine_turns(phase * 10 / 3)[1],
            -drop - drop * sine_cosine_turns((phase - 0.15) * 10 / 7)[1],
            drop - drop * sine_cosine_turns((phase - 0.5) * 10 / 3)[1],
        ],
        drop + drop * sine_cosine_turns((phase - 0.65) * 10 / 7)[1],
    )
    tilt = 2.0
    if rv < SLOW:
        tilt = -8 * rv * rv + 8 * rv
    lean = tilt - tilt * sine_cosine_turns(2 * phase - 0.1)[0]
    twist = [(0.1, -4 / 3 * rv), (0.4, 1.5 * rv), (0.6, 4 / 3 * rv), (0.9, -1.5 * rv)]
    angles = {
        "list": sway,
        "turn": 4 * rv * sine_cosine_turns(phase)[1],
        "lean": lean,
        "twist": through(twist, phase),
    }
    return {name: np.radians(value) for name, value in angles.items()}


def shift(rv: float, phase: np.ndarray) -> np.ndarray:
    """Return the root's periodic translation (..., 3): right, front, up, in hip heights.

    To the right over the right foot's support, forward in both double supports, lowest in double
    support.
    """
    _, _, support = timing(rv)
    side = 0.032
    along = -0.021
    if rv < SLOW:
        side = 0.128 * rv * (1 - rv)
        along = -0.084 * rv * (1 - rv)
    phase = np.asarray(phase)
    up = 0.015 * rv
    return np.stack(
        [
            side * sine_cosine_turns(phase - 0.1)[0],
            along * sine_cosine_turns(2 * phase + 2 * (0.625 - support))[0],
            -up + up * sine_cosine_turns(2 * phase - 0.35)[0],
        ],
        axis=-1,
    )
