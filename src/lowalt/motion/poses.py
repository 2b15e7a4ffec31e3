"""Poses: position and orientation of each rigid part at each symbol.

They follow in closed form from the initial pose.

Angles are beta_0 + 2 pi F t instead of products of many small rotations, so errors do not
accumulate. All poses have the same bits on every processor: sines and products are those of
`pose_kernels` and `portable`.
"""

from typing import NamedTuple

import numpy as np

from lowalt.files.errors import InputError
from lowalt.motion.rotations import attitude, compiled, rodrigues, turns
from lowalt.numerics.portable import applied, product
from lowalt.targets.cloud import Cloud


class Poses(NamedTuple):
    """Rigid transforms: point u of part p is at rotation[n, p] @ u + translation[n, p].

    rotation: (N, P, 3, 3); translation: (N, P, 3) m, global frame.
    """

    rotation: np.ndarray
    translation: np.ndarray


class Perturbation(NamedTuple):
    """Changes that are added to a target's own motion at N symbols.

    A field that is None changes nothing.

    angle_rad: part -> (N,) rad, added to that part's turn; offset_m: (N, 3) m, added to the whole
    target's position, global frame; tilt_rad: (N, 3) rad, added to the row's yaw, pitch and roll.
    """

    angle_rad: dict[int, np.ndarray] | None = None
    offset_m: np.ndarray | None = None
    tilt_rad: np.ndarray | None = None


def _hinged(axes: np.ndarray, hinges: np.ndarray) -> np.ndarray:
    """Matrices (3, Q, 4, 4) that turn about hinged axes (Q, 3).

    The first plus cos(angle) times the second plus sin(angle) times the third is the turn.
    """
    result = np.zeros((3, len(axes), 4, 4))
    turn = result[..., :3, :3]
    still, cosine, sine = turn  # Views, so that what is written stands in the result.
    still[:] = axes[:, :, None] * axes[:, None]
    cosine[:] = np.eye(3) - still
    x, y, z = axes.T
    sine[:, 2, 1] = x
    sine[:, 0, 2] = y
    sine[:, 1, 0] = z
    sine -= sine.swapaxes(1, 2)
    result[..., :3, 3] = -applied(turn, hinges)
    result[0, :, :3, 3] += hinges
    result[0, :, 3, 3] = 1.0
    return result


def _angles(
    cloud: Cloud, row: dict, times_s: np.ndarray
) -> tuple[dict[str, np.ndarray], dict[int, tuple[str, float]]]:
    """Angles that change with time, (N,) rad by name, and of each moving part (angle, phase).

    A moving part has the name of its angle and a phase (rad) that is added to it. A rotor or wheel
    turns at the row's rate times its own factor; those of one factor differ by a constant angle
    only.
    Raises: InputError naming the parts without a rate or phase.
    """
    angles = {"cycle": 2 * np.pi * turns(row["rate_hz"], times_s)}
    phases = {}
    factors = cloud.rate_factors
    for kind in ("rotor", "wheel"):
        for order, part in enumerate(cloud.parts_of(kind)):
            name = "cycle" if factors[part] == 1 else f"cycle times {factors[part]!r}"
            if name not in angles:
                angles[name] = 2 * np.pi * turns(row["rate_hz"] * factors[part], times_s)
            phases[part] = (name, row[f"phase_{order}_rad"])
    wings = cloud.parts_of("wing")
    if wings:
        flap = cloud.record["flap"]
        beat = row["phase_0_rad"] + angles.pop("cycle")
        _, now = compiled().sines_cosines(beat)
        _, later = compiled().sines_cosines(beat - np.radians(flap["fold_lag_deg"]))
        angles["shoulder"] = np.radians(flap["mean_deg"]) + np.radians(flap["amplitude_deg"]) * now
        angles["fold"] = np.radians(flap["fold_amplitude_deg"]) * later
        for part in wings:
            name = "shoulder" if cloud.parents[part] < 0 else "fold"
            phases[part] = (name, 0.0)
    known = {name: np.isfinite(angle).all() for name, angle in angles.items()}
    bad = []
    for part, (name, phase) in phases.items():
        if not (known[name] and np.isfinite(phase)):
            bad.append(cloud.names[part])
    if bad:
        raise InputError(
            f"motion of {cloud.subtype}, model {row['model']}: no finite rate or phase for parts "
            f"{bad}"
        )
    return angles, phases


def _perturbed(
    cloud: Cloud,
    angles: dict[str, np.ndarray],
    phases: dict[int, tuple[str, float]],
    added: dict[int, np.ndarray],
) -> None:
    """Give each part in `added` its own angle: its previous angle plus added[part] (N,) rad.

    Raises: InputError naming the parts that do not move.
    """
    still = sorted(set(added) - set(phases))
    if still:
        raise InputError(
            f"motion of {cloud.subtype}: angles added to parts {still}, expected some of "
            f"{sorted(phases)}"
        )
    for part, angle in added.items():
        name, phase = phases[part]
        own_name = f"{name} {part}"
        angles[own_name] = angles[name] + angle
        phases[part] = (own_name, phase)


def _series(
    cloud: Cloud, row: dict, times_s: np.ndarray, added: dict[int, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return functions of time (N, K) and matrices (K, P, 4, 4); their product is the motion.

    A turn by angle a about a hinge is A + cos(a) B + sin(a) C; the motion of a part on a moving
    part is a product of such sums. The cost is a few cosines per symbol and one matrix product, for
    any number of parts. The body's own motion is not included.
    """
    angles, phases = _angles(cloud, row, times_s)
    _perturbed(cloud, angles, phases, added)
    constant: tuple[str, ...] = ()
    columns = {constant: np.ones(len(times_s))}
    for name in dict.fromkeys(name for name, _ in phases.values()):
        sine_of_time, cosine_of_time = compiled().sines_cosines(angles[name])
        columns[("sin " + name,)] = sine_of_time
        columns[("cos " + name,)] = cosine_of_time
    moving = list(phases)
    still, cosine, sine = _hinged(cloud.axes[moving], cloud.hinges[moving])
    of_parts = np.array([phase for _, phase in phases.values()], dtype=np.float64)
    s, c = compiled().sines_cosines(of_parts)
    s = s[:, None, None]
    c = c[:, None, None]
    turning = np.stack([still, c * cosine + s * sine, c * sine - s * cosine])
    terms: list[tuple[list[tuple[str, ...]], np.ndarray]] = []
    for part, parent in enumerate(cloud.parents):
        names = [constant]
        matrices = np.eye(4)[None]
        if part in phases:
            name, _ = phases[part]
            names = [constant, ("cos " + name,), ("sin " + name,)]
            matrices = turning[:, moving.index(part)]
        if parent >= 0:
            before, carrier = terms[parent]
            products = []
            for outer in before:
                for inner in names:
                    if outer + inner not in columns:
                        columns[outer + inner] = columns[outer] * columns[inner]
                    products.append(outer + inner)
            names = products
            matrices = product(carrier[:, None], matrices).reshape(-1, 4, 4)
        terms.append((names, matrices))
    indices = {name: index for index, name in enumerate(columns)}
    result = np.zeros((len(columns), len(terms), 4, 4))
    for part, (names, matrices) in enumerate(terms):
        result[[indices[name] for name in names], part] = matrices
    return np.stack(list(columns.values()), axis=1), result


def _attitudes(row: dict, tilt_rad: np.ndarray) -> np.ndarray:
    """Attitudes (N, 3, 3) of the row's yaw, pitch and roll plus `tilt_rad` (N, 3)."""
    yaw = row["yaw_rad"] + tilt_rad[:, 0]
    pitch = row["pitch_rad"] + tilt_rad[:, 1]
    roll = row["roll_rad"] + tilt_rad[:, 2]
    right, front, up = np.eye(3)
    return product(product(rodrigues(up, yaw), rodrigues(right, pitch)), rodrigues(front, roll))


def _curved(row: dict, times_s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Deviation (N, 3) m of a track's path from its tangent, and change (N, 3) rad of attitude."""
    acceleration = np.array([row["ax_mps2"], row["ay_mps2"], row["az_mps2"]])
    jerk = np.array([row["jx_mps3"], row["jy_mps3"], row["jz_mps3"]])
    turned_rad = np.zeros((len(times_s), 3))
    turned_rad[:, 0] = row["turn_radps"] * times_s  # Pitch and roll stay.
    deviation_m = (times_s**2)[:, None] * (acceleration / 2 + times_s[:, None] * (jerk / 6))
    return deviation_m, turned_rad


def _track(cloud: Cloud, row: dict, times_s: np.ndarray, body: np.ndarray) -> np.ndarray:
    """Return the nodes' positions (N, L, 3) in a recording turned by `body`.

    They are linear between frames.
    Source: paper Eq. 22.
    """
    frames = len(cloud.track)
    recorded_s = row["start_s"] + row["playback"] * times_s
    frame = recorded_s * cloud.record["track_rate_hz"] % frames
    first = np.minimum(frame.astype(np.int64), frames - 1)
    turned = compiled().product(cloud.track.reshape(-1, 3), body.T).reshape(frames, -1)
    before = turned.take(first, axis=0)
    result = turned.take((first + 1) % frames, axis=0)
    result -= before
    result *= (frame - first)[:, None]
    result += before
    return result.reshape(len(times_s), -1, 3)


def poses(
    cloud: Cloud, row: dict, times_s: np.ndarray, perturbation: Perturbation | None = None
) -> Poses:
    """Return the poses of all parts of `cloud` at `times_s` (N,) s; `row` is of a motion table.

    `perturbation` is added to that motion. A cloud of nodes gets rotations of zeros (read-only),
    and its translations are the positions of its nodes.
    Raises: InputError where the row lacks a value the cloud needs, or a part that does not move is
    to be turned.
    Source: paper Eqs. 17 to 20 and 22, Rodrigues' formula.
    """
    times_s = np.asarray(times_s, dtype=np.float64)
    added, offset, tilt = perturbation or Perturbation()
    body = attitude(row["yaw_rad"], row["pitch_rad"], row["roll_rad"])
    origin = np.array([row["x_m"], row["y_m"], row["z_m"]])
    velocity = np.array([row["vx_mps"], row["vy_mps"], row["vz_mps"]])
    if not np.isfinite([*origin, *velocity, *body.flat]).all():
        raise InputError(
            f"motion of {cloud.subtype}, model {row['model']}: position, velocity or attitude not "
            "finite"
        )
    path = origin + times_s[:, None] * velocity
    if "turn_radps" in row:
        course, turned_rad = _curved(row, times_s)
        path += course
        if tilt is not None:
            turned_rad = tilt + turned_rad
        tilt = turned_rad
    if offset is not None:
        path += offset
    if tilt is not None:
        turned = _attitudes(row, tilt)
        body = np.eye(3)
    count = len(times_s)
    parts = len(cloud.kinds)
    if "node" in cloud.kinds:
        _perturbed(cloud, {}, {}, added or {})
        translation = _track(cloud, row, times_s, body)
        if tilt is not None:
            translation = applied(turned[:, None], translation)
        translation += path[:, None]
        return Poses(np.broadcast_to(np.zeros(()), (count, parts, 3, 3)), translation)
    functions, matrices = _series(cloud, row, times_s, added or {})
    matrices = product(body, matrices[..., :3, :])
    terms = functions.shape[1]
    rotation = compiled().product(functions, matrices[..., :3].reshape(terms, -1))
    rotation = rotation.reshape(count, parts, 3, 3)
    translation = compiled().product(functions, matrices[..., 3].reshape(terms, -1))
    translation = translation.reshape(count, parts, 3)
    if tilt is not None:
        rotation = product(turned[:, None], rotation)
        translation = applied(turned[:, None], translation)
    translation += path[:, None]
    return Poses(rotation, translation)


def positions(cloud: Cloud, row: dict, times_s: np.ndarray) -> np.ndarray:
    """Return every point's position (N, L, 3) m, global frame; arguments and errors as `poses`."""
    rotation, translation = poses(cloud, row, times_s)
    if "node" in cloud.kinds:
        return translation
    result = translation[:, cloud.part]
    for part in np.unique(cloud.part):
        mine = cloud.part == part
        result[:, mine] += cloud.points[mine] @ rotation[:, part].swapaxes(1, 2)
    return result
