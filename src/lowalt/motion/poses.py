"""Poses: where each rigid part of a target stands at each symbol, in closed form from the initial pose.

Angles are beta_0 + 2 pi F t, never a product of many small rotations, so nothing drifts however long the look.
"""

from typing import NamedTuple

import numpy as np

from lowalt.errors import InputError
from lowalt.targets.cloud import Cloud


class Poses(NamedTuple):
    """Rigid transforms of every part: a point u of part p stands at rotation[n, p] @ u + translation[n, p].

    rotation: (N, P, 3, 3); translation: (N, P, 3) m, global frame.
    """

    rotation: np.ndarray
    translation: np.ndarray


def turns(rate_hz: float, times_s: np.ndarray) -> np.ndarray:
    """Return the fraction of a turn, in [-1/2, 1/2], that rate_hz * times_s ends on; shape of `times_s`.

    The product is carried in two doubles (Dekker 1971), so the fraction keeps full precision after 10^6 turns.
    """
    split = 134217729.0  # 2^27 + 1
    product = rate_hz * times_s
    a = split * rate_hz
    a_high = a - (a - rate_hz)
    a_low = rate_hz - a_high
    b = split * times_s
    b_high = b - (b - times_s)
    b_low = times_s - b_high
    error = ((a_high * b_high - product) + a_high * b_low + a_low * b_high) + a_low * b_low
    return (product - np.rint(product)) + error


def rodrigues(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return the matrices that turn by `angle` (N,) rad about the unit vector `axis` (3,); shape (N, 3, 3).

    Source: Rodrigues' rotation formula, paper Eq. 17.
    """
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    cosine, sine = np.cos(angle)[:, None, None], np.sin(angle)[:, None, None]
    return cosine * np.eye(3) + sine * cross + (1.0 - cosine) * np.outer(axis, axis)


def attitude(yaw_rad: float, pitch_rad: float, roll_rad: float) -> np.ndarray:
    """Return R_Y(yaw) R_P(pitch) R_R(roll), turns about z, x and y; shape (3, 3). Source: paper Eq. 18."""
    turn = np.array([yaw_rad, pitch_rad, roll_rad])
    yaw, pitch, roll = (rodrigues(axis, turn[i : i + 1])[0] for i, axis in enumerate(np.eye(3)[[2, 0, 1]]))
    return yaw @ pitch @ roll


def _part_angles(cloud: Cloud, row: dict, times_s: np.ndarray) -> dict[int, np.ndarray]:
    """Angle (N,) in rad of every moving part of a rigid-part cloud."""
    cycle = 2 * np.pi * turns(row["rate_hz"], times_s)
    result = {}
    for kind in ("rotor", "wheel"):
        for order, part in enumerate(cloud.parts_of(kind)):
            result[part] = row[f"phase_{order}_rad"] + cycle
    wings = cloud.parts_of("wing")
    if wings:
        flap = cloud.record["flap"]
        beat = row["phase_0_rad"] + cycle
        shoulder = np.radians(flap["mean_deg"]) + np.radians(flap["amplitude_deg"]) * np.cos(beat)
        fold = np.radians(flap["fold_amplitude_deg"]) * np.cos(beat - np.radians(flap["fold_lag_deg"]))
        for part in wings:
            result[part] = shoulder if cloud.parents[part] < 0 else fold
    bad = [cloud.names[part] for part, angle in result.items() if not np.isfinite(angle).all()]
    if bad:
        raise InputError(f"motion of {cloud.subtype}, model {row['model']}: no finite rate or phase for parts {bad}")
    return result


def _track(cloud: Cloud, row: dict, times_s: np.ndarray) -> np.ndarray:
    """Node positions (N, L, 3) of a cyclic recording, linear between its frames (paper Eq. 21)."""
    frames = len(cloud.track)
    place = (row["start_s"] + row["playback"] * times_s) * cloud.record["track_rate_hz"] % frames
    first = np.minimum(place.astype(np.int64), frames - 1)
    part = (place - first)[:, None, None]
    return cloud.track[first] + part * (cloud.track[(first + 1) % frames] - cloud.track[first])


def poses(cloud: Cloud, row: dict, times_s: np.ndarray) -> Poses:
    """Return the poses of all parts of `cloud` under the motion of `row` (motion table) at `times_s` (N,) s.

    A node cloud gets zero rotations, and translations that carry the whole position.
    Raises: InputError where the row lacks a value the cloud needs. Source: paper Eqs. 17-21, Rodrigues' formula.
    """
    times_s = np.asarray(times_s, dtype=np.float64)
    body = attitude(row["yaw_rad"], row["pitch_rad"], row["roll_rad"])
    origin = np.array([row["x_m"], row["y_m"], row["z_m"]])
    velocity = np.array([row["vx_mps"], row["vy_mps"], row["vz_mps"]])
    if not np.isfinite([*origin, *velocity, *body.flat]).all():
        raise InputError(f"motion of {cloud.subtype}, model {row['model']}: position, velocity or attitude not finite")
    path = origin + times_s[:, None] * velocity
    count, parts = len(times_s), len(cloud.kinds)
    if "node" in cloud.kinds:
        translation = _track(cloud, row, times_s) @ body.T + path[:, None]
        return Poses(np.zeros((count, parts, 3, 3)), np.ascontiguousarray(translation))
    rotation = np.broadcast_to(np.eye(3), (count, parts, 3, 3)).copy()
    translation = np.zeros((count, parts, 3))
    angles = _part_angles(cloud, row, times_s)
    for part in range(parts):
        if part in angles:
            turn, hinge = rodrigues(cloud.axes[part], angles[part]), cloud.hinges[part]
            rotation[:, part] = turn
            translation[:, part] = hinge - turn @ hinge
        parent = cloud.parents[part]
        if parent >= 0:
            translation[:, part] = (rotation[:, parent] @ translation[:, part, :, None])[..., 0] + translation[
                :, parent
            ]
            rotation[:, part] = rotation[:, parent] @ rotation[:, part]
    return Poses(body @ rotation, translation @ body.T + path[:, None])


def positions(cloud: Cloud, row: dict, times_s: np.ndarray) -> np.ndarray:
    """Return every point's position (N, L, 3) in metres, global frame; arguments and errors as `poses`."""
    rotation, translation = poses(cloud, row, times_s)
    turned = np.einsum("nlij,lj->nli", rotation[:, cloud.part], cloud.points)
    return turned + translation[:, cloud.part]
