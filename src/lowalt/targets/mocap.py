"""Recordings: from CMU's skeleton and motion files to a cyclic track of the 31 nodes.

Here the angles turn the bones, the best cycle of the recording is found and closed, and the result is turned to the
front and scaled. What the files look like is in `mocap_files`. Axes of the result: x right, y front, z up, metres.
"""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lowalt.common import portable
from lowalt.common.classes import like
from lowalt.common.errors import InputError
from lowalt.common.files import sha256
from lowalt.common.portable import applied, product
from lowalt.common.rotations import nearest_rotations
from lowalt.targets import record_schema
from lowalt.targets.cloud import Cloud
from lowalt.targets.gait import stance_speed_mps
from lowalt.targets.input_files import check_file_name
from lowalt.targets.mocap_files import Skeleton, read_motion, read_skeleton
from lowalt.targets.skeleton import NODES, PARENTS, forward_kinematics, node_cloud, rotation, stature_m

FROM_FILE = np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
"""File axes (x left, y up, z front) to ours (x right, y front, z up): a proper rotation."""

FADE_S = 0.15
"""Length of the cross-fade that closes a cycle; about a quarter of a step, shorter where the recording is."""

SHORTEST_S = 0.5
"""Shortest cycle looked for: two steps of the fastest sprinters take about that."""

SHORTEST_GAIT_S = 0.3
"""A recording whose cycle is shorter than this holds no gait: half of the shortest stride."""

BLOCK = 256
"""Starts of a cycle that are compared with all ends at once."""


@dataclass(frozen=True)
class Motion:
    """A recording in our axes: `root_m` (F, 3), `turned` (F, 31, 3, 3) global rotations of the bones, `bones_m`
    (31, 3) unturned bones, `rate_hz`."""

    root_m: np.ndarray
    turned: np.ndarray
    bones_m: np.ndarray
    rate_hz: float


def _euler(angles_rad: np.ndarray) -> np.ndarray:
    """Return rotations (..., 3, 3) for angles (..., 3): about x first, then y, then z (ASF's order XYZ)."""
    x, y, z = np.moveaxis(np.asarray(angles_rad, float), -1, 0)
    return product(product(rotation("z", z), rotation("y", y)), rotation("x", x))


def posed(skeleton: Skeleton, channels: dict[str, np.ndarray], rate_hz: float) -> Motion:
    """Return the motion that channels (F, channels; file units and degrees) give a skeleton.

    A bone turns by C M C^-1, C its own frame and M its channels, after its parent. Source: Acclaim's ASF/AMC.
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
        turned[:, index] = local if index == 0 else product(turned[:, PARENTS[index]], local)
    order = [skeleton.dofs["root"].index(name) for name in ("tx", "ty", "tz")]
    root = applied(FROM_FILE, channels["root"][:, order] * skeleton.unit_m)
    # Seen from our axes a rotation is P R P^T, a bone P b.
    seen = product(product(FROM_FILE, turned), FROM_FILE.T)
    return Motion(root, seen, applied(FROM_FILE, skeleton.bones * skeleton.unit_m), rate_hz)


def nodes_m(motion: Motion) -> np.ndarray:
    """Return the positions (F, 31, 3) in metres of a motion's nodes."""
    return forward_kinematics(motion.root_m, motion.turned, motion.bones_m)


def refuse_glitches(positions: np.ndarray, rate_hz: float, limit_mps2: float, where: str, first: int) -> None:
    """Raise InputError naming `where` and the frame if a node accelerates by more than `limit_mps2`.

    `positions` (F, 31, 3) metres, the first of them frame number `first`.
    """
    acceleration = np.linalg.norm(np.diff(positions, n=2, axis=0), axis=2) * rate_hz**2
    if len(acceleration) and acceleration.max() > limit_mps2:
        frame, node = np.unravel_index(acceleration.argmax(), acceleration.shape)
        raise InputError(
            f"{where}: frame {first + 1 + frame}: {NODES[node]} accelerates by {acceleration.max():.0f} m/s2, "
            f"expected at most {limit_mps2:.0f} (a glitch? trim it)"
        )


def refuse_short(frames: int, rate_hz: float, where: str) -> None:
    """Raise InputError naming `where` if so few frames hold no cycle of SHORTEST_GAIT_S.

    The shortest cycle looked for is half of a short recording (see `find_cycle`).
    """
    needed = math.ceil(2 * SHORTEST_GAIT_S * rate_hz)
    if frames < needed:
        raise InputError(
            f"{where}: {frames} frames, {frames / rate_hz:.3g} s, expected at least {needed} "
            f"({2 * SHORTEST_GAIT_S:g} s at {rate_hz:g} Hz) for a cycle of a walk or run"
        )


def find_cycle(motion: Motion) -> tuple[int, int, int, float]:
    """Return (start, end, fade, mismatch) of the cycle start..end-1 that closes best, in frames and metres.

    The mismatch of two frames is the root mean square over the nodes of their distance in place and, over the fade's
    time, in velocity, horizontal root motion left out. Of the cycles within half again of the least mismatch the
    longest is taken, for variety. A cycle must move at least half as fast as the recording at its fastest, so
    standing is no cycle. `fade` frames must follow its end.
    """
    frames = len(motion.root_m)
    fade = max(1, min(round(FADE_S * motion.rate_hz), frames // 6))
    shortest = max(2 * fade, 2, min(round(SHORTEST_S * motion.rate_hz), frames // 2))
    positions = nodes_m(motion)
    positions[..., :2] -= positions[:, :1, :2]
    velocity = np.gradient(positions, axis=0) * fade
    state = np.concatenate([positions, velocity], axis=1).reshape(frames, -1)
    place = motion.root_m[:, :2]
    # Only pairs (start, end) of a few starts at a time: all pairs of a long recording would take gigabytes.
    blocks = [np.arange(first, min(first + BLOCK, frames)) for first in range(0, frames, BLOCK)]
    fastest = max(_speeds(place, starts, shortest, fade).max() for starts in blocks)
    least, candidates = np.inf, []
    for starts in blocks:
        distance = _mismatches(state, starts)
        distance[_speeds(place, starts, shortest, fade) < max(fastest / 2, 0.0)] = np.inf
        least = min(least, float(distance.min()))
        row, end = np.nonzero(distance <= 1.5 * least)
        candidates.append(np.stack([starts[row], end, distance[row, end]], axis=1))
    start, end, distance = np.concatenate(candidates).T
    good = distance <= 1.5 * least
    longest = (end - start)[good].max()
    best = np.flatnonzero(good & (end - start == longest))
    best = best[np.argmin(distance[best])]
    found = int(start[best]), int(end[best])
    return *found, fade, float(portable.norm(state[found[0]] - state[found[1]]) / np.sqrt(len(NODES)))


def _speeds(place: np.ndarray, starts: np.ndarray, shortest: int, fade: int) -> np.ndarray:
    """Horizontal speed (S, F) in metres a frame from each start to each end; -1 where there is no cycle from one to the
    other: it would be shorter than `shortest` frames, or fewer than `fade` frames would follow it."""
    ends = np.arange(len(place))[None]
    length = ends - starts[:, None]
    way = portable.norm(place[None] - place[starts, None])
    return np.where((length >= shortest) & (ends + fade <= len(place)), way / np.maximum(length, 1), -1.0)


def _mismatches(state: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """Root mean square distance (S, F) over the nodes between the states at each start and at each end."""
    square = portable.dot(state, state)
    both = product(state[starts], state.T)
    return np.sqrt(np.maximum(square[starts, None] + square - 2 * both, 0) / len(NODES))


def closed(motion: Motion, start: int, end: int, fade: int) -> tuple[Motion, np.ndarray]:
    """Return the cycle start..end-1, closed in place and velocity, and the drift (2,) in m/s taken out of it.

    The root's uniform horizontal drift over the cycle goes, its bob and sway stay. Over the first `fade` frames the
    cycle goes over from what followed its end to what it was, by weights whose slope is zero at both ends; rotations
    are blended and made orthogonal again, so bones keep their lengths.
    """
    count = end - start
    drift = (motion.root_m[end] - motion.root_m[start]) / count * [1, 1, 0]
    root = motion.root_m - np.arange(-start, len(motion.root_m) - start)[:, None] * drift
    turned = motion.turned[start:end].copy()
    place = np.arange(fade) / fade
    weight = place**2 * (3 - 2 * place)
    after = slice(end, end + fade)
    looped = root[start:end].copy()
    looped[:fade] = weight[:, None] * looped[:fade] + (1 - weight[:, None]) * root[after]
    weight = weight[:, None, None, None]
    turned[:fade] = nearest_rotations(weight * turned[:fade] + (1 - weight) * motion.turned[after])
    return Motion(looped, turned, motion.bones_m, motion.rate_hz), drift[:2] * motion.rate_hz


def front(motion: Motion, direction: np.ndarray) -> Motion:
    """Return the motion turned about the vertical so that the horizontal `direction` (2,) becomes +y, and moved so
    that the root's mean is the origin."""
    sine, cosine = direction / portable.norm(direction)
    spin = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    root = applied(spin, motion.root_m)
    return Motion(root - portable.mean(root, 0), product(spin, motion.turned), motion.bones_m, motion.rate_hz)


KEYS = record_schema.keys("mocap")
"""Keys that a recording's record has in addition to those of every record; `where` says where a user gets the files."""


def check_record(merged: dict, extra: dict, where: str) -> dict:
    """Return the merged record of a recording, checked, with its defaults: 120 Hz, scaled to the published height, at
    most 1500 m/s2, a cycle that closes to 0.15 m. `first_frame` and `last_frame` count from 1, inclusive; None is the
    recording's own end.

    `extra` are the keys of the record as written that are not common to all sources.
    Raises: InputError naming `where`, the key, the value and what was expected.
    """
    unknown, missing = sorted(set(extra) - set(KEYS)), sorted({"skeleton", "motion"} - set(extra))
    if unknown or missing:
        raise InputError(f"{where}: unknown keys {unknown}, missing keys {missing}, expected some of {sorted(KEYS)}")
    if like(merged) != "Pedestrian":
        raise InputError(f"{where}: source is 'mocap' for a target like a {like(merged)}, expected builtin or mesh")
    defaults = {
        "first_frame": 1,
        "last_frame": None,
        "rate_hz": 120,
        "scale": "published",
        "max_acceleration_mps2": 1500,
        "max_mismatch_m": 0.15,
    }
    result = defaults | merged | {"points": len(NODES)}
    for key in ("skeleton", "motion"):
        check_file_name(result[key], f"{where}: {key}")
    first, last = result["first_frame"], result["last_frame"]
    if not (isinstance(first, int) and first >= 1 and (last is None or (isinstance(last, int) and last > first))):
        raise InputError(
            f"{where}: first_frame {first!r}, last_frame {last!r}, expected frame numbers from 1, in order"
        )
    for key in ("rate_hz", "max_acceleration_mps2"):
        if isinstance(result[key], bool) or not isinstance(result[key], (int, float)) or not 1 <= result[key] <= 1e5:
            raise InputError(f"{where}: {key} is {result[key]!r}, expected a number from 1 to 100000")
    mismatch = result["max_mismatch_m"]
    if isinstance(mismatch, bool) or not isinstance(mismatch, (int, float)) or not 0 < mismatch <= 10:
        raise InputError(f"{where}: max_mismatch_m is {mismatch!r}, expected metres, more than 0 and at most 10")
    if result["scale"] not in ("published", "none"):
        raise InputError(f"{where}: scale is {result['scale']!r}, expected published or none")
    return result


def record_files(record: dict) -> list[str]:
    """Return the user's files a recording's record needs, relative to the folder of inputs."""
    return [record["skeleton"], record["motion"]]


def mocap_cloud(record: dict, inputs_dir: str | Path, seed: int) -> Cloud:
    """Return the cloud of a recording: its best cycle on the 31 nodes, front +y, drift taken out, bob kept.

    `record` is a merged record that `check_record` has passed; its files are relative to `inputs_dir`. The cloud's
    record says which frames were used, the mismatch that the fade closes (m), speed, scale and the height of the
    origin above ground. Nothing is drawn at random, so `seed` is only noted.
    Raises: InputError naming file and frame for a faulty recording, and where it does not move.
    """
    paths = [Path(inputs_dir) / name for name in record_files(record)]
    skeleton = read_skeleton(paths[0])
    first = record["first_frame"]
    motion = posed(skeleton, read_motion(paths[1], skeleton, first, record["last_frame"]), record["rate_hz"])
    refuse_glitches(nodes_m(motion), motion.rate_hz, record["max_acceleration_mps2"], str(paths[1]), first)
    refuse_short(len(motion.root_m), motion.rate_hz, str(paths[1]))
    start, end, fade, mismatch = find_cycle(motion)
    if mismatch > record["max_mismatch_m"]:
        raise InputError(
            f"{paths[1]}: the best cycle, frames {first + start} to {first + end - 1}, closes to {mismatch:.3f} m "
            f"(root mean square over the nodes), expected at most max_mismatch_m = {record['max_mismatch_m']} m: "
            "choose first_frame and last_frame around a steady gait"
        )
    cycle, drift = closed(motion, start, end, fade)
    looped = nodes_m(cycle)
    seam = np.concatenate([looped, looped[:2]])
    refuse_glitches(
        seam, motion.rate_hz, record["max_acceleration_mps2"], f"{paths[1]} (its closed cycle)", first + start
    )
    speed = float(portable.norm(drift))
    if speed < 0.05:
        raise InputError(f"{paths[1]}: moves {speed:.3f} m/s, expected a walk or run to turn to the front")
    stature = stature_m(motion.bones_m)
    scale = record["published"]["hgt_m"] / stature if record["scale"] == "published" else 1.0
    track = nodes_m(front(cycle, drift)) * scale
    sums = {name: sha256(path) for name, path in zip(record_files(record), paths, strict=True)}
    facts = {
        "track_rate_hz": float(motion.rate_hz), "cycle_s": len(track) / motion.rate_hz,
        "track_speed_mps": speed * scale, "frames_used": [first + start, first + end - 1], "fade_frames": fade,
        "loop_mismatch_m": mismatch * scale, "recorded_stature_m": stature, "scale_factor": scale,
        "origin_height_m": float(-track[..., 2].min()),
        "stance_foot_speed_mps": stance_speed_mps(track, motion.rate_hz, speed * scale),
        "files_sha256": sums, "checksum": sums[record["motion"]], "seed": seed,
    }  # fmt: skip
    return node_cloud(track, record | facts)
