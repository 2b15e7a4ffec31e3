"""The motion of a recording: angles turn the bones of the skeleton, and one cycle is closed.

The stretch whose end is most like its start is found and closed to a cycle without a jump.

Axes of the result: x right, y front, z up, metres. The files themselves are read in `mocap_files`.
"""

import math
from dataclasses import dataclass

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.numerics.matrices import nearest_rotations
from lowalt.numerics.portable import applied, product
from lowalt.targets.mocap_files import Skeleton
from lowalt.targets.skeleton import NODES, PARENTS, forward_kinematics, rotation

FROM_FILE = np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
"""File axes (x left, y up, z front) to ours (x right, y front, z up): a proper rotation."""

FADE_S = 0.15
"""Length of the cross-fade that closes a cycle.

It is about a quarter of a step, at most a sixth of the recording.
"""

SHORTEST_S = 0.5
"""Shortest cycle that is looked for in a long recording: about two steps of the fastest sprinters.
"""

SHORTEST_GAIT_S = 0.3
"""Shortest cycle that is accepted in a short recording: half of the shortest stride."""

WALK_RATIO_S = (0.29, 0.62)
"""Step length (m) times the time of a step (s), of a person of USUAL_M.

Adults have 0.38 at every speed of walking and runners 0.4 to 0.55; a rate that is wrong by two
doubles or halves it. Source: Sekiya and Nagasaki, Gait and Posture 7 (1998); our own limits around
CMU's walks and runs, which have 0.34 to 0.52.
"""
USUAL_M = 1.75
ALIKE = 1.5
"""Cycles whose mismatch is at most this many times the least one count as equally good."""

BLOCK = 256
"""Number of starts of a cycle that are compared with all ends in one matrix product."""


@dataclass(frozen=True)
class Motion:
    """A recording in our axes.

    root_m: (F, 3) positions of the root; turned: (F, 31, 3, 3) global rotations of the bones;
    bones_m: (31, 3) bones before they are turned; rate_hz: frames per second.
    """

    root_m: np.ndarray
    turned: np.ndarray
    bones_m: np.ndarray
    rate_hz: float


def _euler(angles_rad: np.ndarray) -> np.ndarray:
    """Return rotations (..., 3, 3) for angles (..., 3).

    They turn about x first, then y, then z (ASF's order XYZ).
    """
    x, y, z = np.moveaxis(np.asarray(angles_rad, float), -1, 0)
    return product(product(rotation("z", z), rotation("y", y)), rotation("x", x))


def posed(skeleton: Skeleton, channels: dict[str, np.ndarray], rate_hz: float) -> Motion:
    """Return the motion that channels (F, channels; file units and degrees) give a skeleton.

    A bone turns by its parent's rotation times C M C^-1; C is the bone's own frame, M the rotation
    of its channels.
    Source: Acclaim's ASF/AMC.
    """
    frames = len(channels["root"])
    turned = np.empty((frames, len(NODES), 3, 3))
    for index, name in enumerate(NODES):
        angles = np.zeros((frames, 3))
        for column, dof in enumerate(skeleton.dofs[name]):
            if dof[0] == "r":
                angles[:, "xyz".index(dof[1])] = np.radians(channels[name][:, column])
        frame = _euler(skeleton.axes_rad[index])
        local = product(product(frame, _euler(angles)), frame.T)
        turned[:, index] = local
        if index > 0:
            turned[:, index] = product(turned[:, PARENTS[index]], local)
    order = [skeleton.dofs["root"].index(name) for name in ("tx", "ty", "tz")]
    root = applied(FROM_FILE, channels["root"][:, order] * skeleton.unit_m)
    # With P = FROM_FILE, a rotation R becomes P R P^T in our axes and a bone b becomes P b.
    seen = product(product(FROM_FILE, turned), FROM_FILE.T)
    return Motion(root, seen, applied(FROM_FILE, skeleton.bones * skeleton.unit_m), rate_hz)


def nodes_m(motion: Motion) -> np.ndarray:
    """Return the positions (F, 31, 3) in metres of a motion's nodes."""
    return forward_kinematics(motion.root_m, motion.turned, motion.bones_m)


def front(motion: Motion, direction: np.ndarray) -> Motion:
    """Return the motion turned about the vertical so that `direction` (2,) becomes +y.

    direction: horizontal. The motion is moved so that the root's mean is the origin.
    """
    sine, cosine = direction / portable.norm(direction)
    spin = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    root = applied(spin, motion.root_m)
    return Motion(
        root - portable.mean(root, 0), product(spin, motion.turned), motion.bones_m, motion.rate_hz
    )


def refuse_glitches(
    positions: np.ndarray, rate_hz: float, limit_mps2: float, where: str, first: int
) -> None:
    """Raise InputError naming `where` and the frame if a node accelerates by too much.

    limit_mps2: the largest acceleration.

    `positions` (F, 31, 3) metres, the first of them frame number `first`.
    """
    acceleration = np.linalg.norm(np.diff(positions, n=2, axis=0), axis=2) * rate_hz**2
    if len(acceleration) and acceleration.max() > limit_mps2:
        frame, node = np.unravel_index(acceleration.argmax(), acceleration.shape)
        raise InputError(
            f"{where}: frame {first + 1 + frame}: {NODES[node]} accelerates by "
            f"{acceleration.max():.0f} m/s2, expected at most {limit_mps2:.0f}: a glitch or a pose "
            "before the motion, to leave out by first_frame or last_frame"
        )


def refuse_short(frames: int, rate_hz: float, where: str) -> None:
    """Raise InputError naming `where` if the recording is shorter than two shortest cycles.

    A cycle takes at least SHORTEST_GAIT_S.

    In a short recording `find_cycle` looks for cycles of half its length and longer.
    """
    needed = math.ceil(2 * SHORTEST_GAIT_S * rate_hz)
    if frames < needed:
        raise InputError(
            f"{where}: {frames} frames, {frames / rate_hz:.3g} s, expected at least {needed} "
            f"({2 * SHORTEST_GAIT_S:g} s at {rate_hz:g} Hz) for a cycle of a walk or run"
        )


def refuse_strange_rate(
    track: np.ndarray, rate_hz: float, speed_mps: float, stature: float, where: str
) -> None:
    """Raise InputError naming `where` if the steps of a closed cycle do not fit their length.

    They may be too quick or too slow for it.

    track: (F, 31, 3) m, front +y; stature: of the person, in m. Nothing is said of a cycle whose
    feet do not swing.
    """
    apart = track[:, NODES.index("ltibia"), 1] - track[:, NODES.index("rtibia"), 1]
    swing = np.abs(np.fft.rfft(apart - apart.mean()))
    if np.ptp(apart) < 0.05 * stature or len(swing) < 2:
        return
    step_s = len(track) / rate_hz / int(swing[1:].argmax() + 1) / 2
    ratio = speed_mps * step_s**2 * USUAL_M / stature
    least, most = WALK_RATIO_S
    if not least <= ratio <= most:
        other = rate_hz / 2 if ratio < least else rate_hz * 2
        raise InputError(
            f"{where}: at {rate_hz:g} frames per second it moves {speed_mps:.2f} m/s with "
            f"{1 / step_s:.2g} steps per second, unlike a person; is it of {other:g}? Write the "
            f"right rate, `rate_hz: {other:g}`, or to insist `rate_hz: {rate_hz:g}`"
        )


def find_cycle(motion: Motion) -> tuple[int, int, int, float]:
    """Return (start, end, fade, mismatch) of the cycle start..end-1 that closes best.

    They are in frames and metres.

    The mismatch of two frames is a root mean square over the nodes: of the difference in position,
    and of the difference in velocity times the fade's length. It leaves out the horizontal motion
    of the root. Among the cycles whose mismatch is at most 1.5 times the least, the longest is
    taken, for variety. A cycle must move at least half as fast as the fastest one, so that standing
    is no cycle. At least `fade` frames follow its end.
    """
    frames = len(motion.root_m)
    fade = max(1, min(round(FADE_S * motion.rate_hz), frames // 6))
    shortest = max(2 * fade, 2, min(round(SHORTEST_S * motion.rate_hz), frames // 2))
    positions = nodes_m(motion)
    positions[..., :2] -= positions[:, :1, :2]
    velocity = np.gradient(positions, axis=0) * fade
    state = np.concatenate([positions, velocity], axis=1).reshape(frames, -1)
    root = motion.root_m[:, :2]
    square = portable.dot(state, state)
    # Only pairs (start, end) of a few starts at a time: all pairs of a long recording would take
    # gigabytes.
    blocks = [np.arange(first, min(first + BLOCK, frames)) for first in range(0, frames, BLOCK)]
    fastest = max(_speeds(root, starts, shortest, fade).max() for starts in blocks)
    least = np.inf
    candidates = []
    for starts in blocks:
        distance = square[starts, None] + square - 2 * product(state[starts], state.T)
        distance = np.sqrt(np.maximum(distance, 0) / len(NODES))
        slow = _speeds(root, starts, shortest, fade) < max(fastest / 2, 0.0)
        distance[slow] = np.inf
        least = min(least, float(distance.min()))
        row, end = np.nonzero(distance <= ALIKE * least)
        candidates.append(np.stack([starts[row], end, distance[row, end]], axis=1))
    start, end, distance = np.concatenate(candidates).T
    good = distance <= ALIKE * least
    longest = (end - start)[good].max()
    candidates_left = np.flatnonzero(good & (end - start == longest))
    best = candidates_left[np.argmin(distance[candidates_left])]
    first = int(start[best])
    last = int(end[best])
    mismatch = float(portable.norm(state[first] - state[last]) / np.sqrt(len(NODES)))
    return first, last, fade, mismatch


def _speeds(root: np.ndarray, starts: np.ndarray, shortest: int, fade: int) -> np.ndarray:
    """Return the horizontal speed (S, F) in metres a frame from each start to each end.

    The value is -1 where the two are no cycle: fewer than `shortest` frames lie between them, or
    fewer than `fade` frames follow the end. root: (F, 2) m.
    """
    ends = np.arange(len(root))[None]
    length = ends - starts[:, None]
    way = portable.norm(root[None] - root[starts, None])
    is_cycle = (length >= shortest) & (ends + fade <= len(root))
    return np.where(is_cycle, way / np.maximum(length, 1), -1.0)


def closed(motion: Motion, start: int, end: int, fade: int) -> tuple[Motion, np.ndarray]:
    """Return the cycle start..end-1, closed in position and velocity, and its drift (2,) in m/s.

    The drift is taken out of the cycle.

    The root's uniform horizontal drift over the cycle is taken out; its bob and sway stay. The
    first `fade` frames of the cycle are blended with the frames that follow its end, by weights w
    that rise from 0 to 1 with slope zero at both ends: w x first frames + (1 - w) x following
    frames. Blended rotations are made orthogonal again, so bones keep their lengths.
    """
    count = end - start
    drift = (motion.root_m[end] - motion.root_m[start]) / count * [1, 1, 0]
    root = motion.root_m - np.arange(-start, len(motion.root_m) - start)[:, None] * drift
    turned = motion.turned[start:end].copy()
    along = np.arange(fade) / fade
    weight = along**2 * (3 - 2 * along)
    after = slice(end, end + fade)
    looped = root[start:end].copy()
    share = weight[:, None]
    looped[:fade] = share * looped[:fade] + (1 - share) * root[after]
    weight = weight[:, None, None, None]
    turned[:fade] = nearest_rotations(weight * turned[:fade] + (1 - weight) * motion.turned[after])
    return Motion(looped, turned, motion.bones_m, motion.rate_hz), drift[:2] * motion.rate_hz
