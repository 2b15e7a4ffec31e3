"""The motion of a recording: angles turn the bones of the skeleton.

Axes of the result: x right, y front, z up, metres. The files themselves are read in `mocap_files`.
"""

from dataclasses import dataclass

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.numerics.portable import applied, product
from lowalt.targets.mocap_files import Skeleton
from lowalt.targets.skeleton import NODES, PARENTS, forward_kinematics, rotation

FROM_FILE = np.array([[-1.0, 0, 0], [0, 0, 1], [0, 1, 0]])
"""File axes (x left, y up, z front) to ours (x right, y front, z up): a proper rotation."""


@dataclass(frozen=True)
class Motion:
    """A recording in our axes.

    root_m: (F, 3) places of the root; turned: (F, 31, 3, 3) global rotations of the bones; bones_m: (31, 3) bones
    before they are turned; rate_hz: frames a second.
    """

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

    A bone turns by its parent's rotation times C M C^-1; C is the bone's own frame, M the rotation of its channels.
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
        turned[:, index] = local if index == 0 else product(turned[:, PARENTS[index]], local)
    order = [skeleton.dofs["root"].index(name) for name in ("tx", "ty", "tz")]
    root = applied(FROM_FILE, channels["root"][:, order] * skeleton.unit_m)
    # With P = FROM_FILE, a rotation R becomes P R P^T in our axes and a bone b becomes P b.
    seen = product(product(FROM_FILE, turned), FROM_FILE.T)
    return Motion(root, seen, applied(FROM_FILE, skeleton.bones * skeleton.unit_m), rate_hz)


def nodes_m(motion: Motion) -> np.ndarray:
    """Return the positions (F, 31, 3) in metres of a motion's nodes."""
    return forward_kinematics(motion.root_m, motion.turned, motion.bones_m)


def front(motion: Motion, direction: np.ndarray) -> Motion:
    """Return the motion turned about the vertical so that the horizontal `direction` (2,) becomes +y, and moved so
    that the root's mean is the origin."""
    sine, cosine = direction / portable.norm(direction)
    spin = np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1]])
    root = applied(spin, motion.root_m)
    return Motion(root - portable.mean(root, 0), product(spin, motion.turned), motion.bones_m, motion.rate_hz)


def refuse_glitches(positions: np.ndarray, rate_hz: float, limit_mps2: float, where: str, first: int) -> None:
    """Raise InputError naming `where` and the frame if a node accelerates by more than `limit_mps2`.

    `positions` (F, 31, 3) metres, the first of them frame number `first`.
    """
    acceleration = np.linalg.norm(np.diff(positions, n=2, axis=0), axis=2) * rate_hz**2
    if len(acceleration) and acceleration.max() > limit_mps2:
        frame, node = np.unravel_index(acceleration.argmax(), acceleration.shape)
        raise InputError(
            f"{where}: frame {first + 1 + frame}: {NODES[node]} accelerates by {acceleration.max():.0f} m/s2, "
            f"expected at most {limit_mps2:.0f}: a glitch or a pose before the motion, to leave out by first_frame or "
            "last_frame"
        )
