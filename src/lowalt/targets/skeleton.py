"""The 31 nodes of a pedestrian: their names, parents and forward kinematics; limbs to known feet.

Shared by recordings (`mocap`) and the built-in gait (`gait`), so that both give the same cloud. A
node is the far end of the bone that carries its name, as in the CMU skeleton files. `cyclist` and
`quadruped` have nodes of their own: limbs of two bones from a fixed joint to a moving point. Axes:
x right, y front, z up, metres.
"""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.targets.cloud import Cloud

LIMBS = {
    "lhipjoint": "root",
    "lfemur": "lhipjoint",
    "ltibia": "lfemur",
    "lfoot": "ltibia",
    "ltoes": "lfoot",
    "rhipjoint": "root",
    "rfemur": "rhipjoint",
    "rtibia": "rfemur",
    "rfoot": "rtibia",
    "rtoes": "rfoot",
    "lowerback": "root",
    "upperback": "lowerback",
    "thorax": "upperback",
    "lowerneck": "thorax",
    "upperneck": "lowerneck",
    "head": "upperneck",
    "lclavicle": "thorax",
    "lhumerus": "lclavicle",
    "lradius": "lhumerus",
    "lwrist": "lradius",
    "lhand": "lwrist",
    "lfingers": "lhand",
    "lthumb": "lwrist",
    "rclavicle": "thorax",
    "rhumerus": "rclavicle",
    "rradius": "rhumerus",
    "rwrist": "rradius",
    "rhand": "rwrist",
    "rfingers": "rhand",
    "rthumb": "rwrist",
}
"""Each bone and the bone it hangs on, parents first."""

NODES = ("root", *LIMBS)
"""The 31 node names in the order of every pedestrian cloud; that of the CMU skeleton files."""

PARENTS = (-1, *(NODES.index(parent) for parent in LIMBS.values()))
"""Index of each node's parent in NODES, -1 for the root."""

FEET = tuple(NODES.index(name) for name in ("lfoot", "ltoes", "rfoot", "rtoes"))
"""Indices of the nodes that touch the ground."""

_LEG = ("femur", "tibia")
_SPINE = ("lowerback", "upperback", "thorax", "lowerneck", "upperneck", "head")


def forward_kinematics(
    root_m: np.ndarray, rotations: np.ndarray, offsets_m: np.ndarray
) -> np.ndarray:
    """Return node positions (F, 31, 3) in metres.

    `root_m` (F, 3) position of the root, `rotations` (F, 31, 3, 3) global rotation of every bone,
    `offsets_m` (31, 3) each bone from its parent's node to its own, unrotated. Source: plain tree
    kinematics.
    """
    positions = np.empty((len(root_m), len(NODES), 3))
    positions[:, 0] = root_m
    for node in range(1, len(NODES)):
        bone = portable.applied(rotations[:, node], offsets_m[node])
        positions[:, node] = positions[:, PARENTS[node]] + bone
    return positions


def stature_m(offsets_m: np.ndarray) -> float:
    """Return the height (m) of a skeleton that stands straight, from the toes to the node `head`.

    `offsets_m` (31, 3) bones in the rest pose. Legs and spine count with their whole length, hip
    joint and foot with their vertical extent in the rest pose; the mean of both legs.
    """

    def bone(name: str) -> np.ndarray:
        """Return the bone (3,) of a node."""
        return offsets_m[NODES.index(name)]

    spine = sum(portable.norm(bone(name)) for name in _SPINE)
    legs = 0.0
    for side in "lr":
        legs += float(sum(portable.norm(bone(side + name)) for name in _LEG))
        legs -= sum(bone(side + name)[2] for name in ("hipjoint", "foot", "toes"))
    return float(spine + legs / 2)


def rotation(axis: str, angle_rad: np.ndarray) -> np.ndarray:
    """Return right-handed rotations (..., 3, 3) by `angle_rad` (...) about "x", "y" or "z"."""
    first, second = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    angle_rad = np.asarray(angle_rad, float)
    result = np.zeros((*angle_rad.shape, 3, 3))
    about = "xyz".index(axis)
    result[..., about, about] = 1.0
    sin, cos = portable.sine_cosine(angle_rad)
    result[..., first, first] = cos
    result[..., second, second] = cos
    result[..., first, second] = -sin
    result[..., second, first] = sin
    return result


def node_cloud(track_m: np.ndarray, record: dict, names: tuple[str, ...] = NODES) -> Cloud:
    """Return the cloud of a cyclic recording: one part a node, the track's first frame as points.

    `track_m` (F, L, 3) metres, body-centred; `names` of the L nodes; `record` the cloud's record,
    with `track_rate_hz` and `rcs_m2_per_point`. Nodes have no surface, so normals are NaN.
    """
    count = len(names)
    nothing = np.full((count, 3), np.nan)
    return Cloud(
        points=track_m[0].copy(),
        part=np.arange(count),
        kinds=("node",) * count,
        names=names,
        parents=np.full(count, -1),
        hinges=nothing,
        axes=nothing.copy(),
        normals=nothing.copy(),
        rcs_m2=np.full(count, float(record["rcs_m2_per_point"])),
        record=record,
        track=track_m,
    )


def both_sides(start: str, *limb: str) -> list[tuple[str, ...]]:
    """Return the nodes' names of a right and a left limb that both begin at the node `start`."""
    right = [f"right {name}" for name in limb]
    left = [f"left {name}" for name in limb]
    return [(start, *right), (start, *left)]


def joint(
    start: np.ndarray, end: np.ndarray, upper_m: float, lower_m: float, bend: float
) -> np.ndarray:
    """Return the joint (F, 3) of two bones that reach from `start` (F, 3) to `end` (F, 3).

    They bend in a plane along y and z. upper_m, lower_m: lengths of the bones; bend: 1 where the
    joint points to the front, -1 to the back.
    Raises: InputError where the end is farther away than both bones reach, or too near.
    Source: law of cosines.
    """
    way = end - start
    flat = np.sqrt(way[:, 1] ** 2 + way[:, 2] ** 2)
    if not ((flat < upper_m + lower_m).all() and (flat > abs(upper_m - lower_m)).all()):
        raise InputError(
            f"limb: ends are {flat.min():.3g} to {flat.max():.3g} m apart, expected what bones of "
            f"{upper_m:.3g} and {lower_m:.3g} m reach"
        )
    along = (upper_m**2 - lower_m**2 + flat**2) / (2 * flat)
    across = np.sqrt(upper_m**2 - along**2)
    unit = way / flat[:, None]
    # A quarter turn of the way in the plane of y and z.
    side = np.stack([np.zeros(len(way)), -unit[:, 2], unit[:, 1]], 1)
    result = start + along[:, None] * unit + bend * across[:, None] * side
    result[:, 0] = start[:, 0] + (along / flat) * way[:, 0]
    return result


def circle(turns: np.ndarray, radius_m: float) -> np.ndarray:
    """Return points (F, 3) on a circle about x, which turns as a wheel that rolls to the front.

    turns (F,): angle in turns, 0 at the top, a quarter at the front (+y).
    """
    sine, cosine = portable.sine_cosine_turns(turns)
    return radius_m * np.stack([np.zeros(len(turns)), sine, cosine], 1)
