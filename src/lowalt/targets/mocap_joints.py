"""Recordings of joints, BVH and arrays of positions (AMASS, SMPL), as a motion of the 31 nodes.

Joints are known by their names; nodes between joints lie on the line between them, and those beyond
the wrists and the head go on straight. Sources: Biovision's BVH as Meredith and Maddock describe it
(2001); the joint order of SMPL.
"""

import re
import zipfile
from pathlib import Path
from typing import NamedTuple

import numpy as np

from lowalt.files.array_files import UNREADABLE, checked_archive
from lowalt.files.atomic import text_of
from lowalt.files.errors import InputError, reading
from lowalt.numerics import portable
from lowalt.targets.mocap_motion import Motion
from lowalt.targets.skeleton import NODES, PARENTS, rotation, stature_m

SMPL = (
    "pelvis",
    "lefthip",
    "righthip",
    "spine1",
    "leftknee",
    "rightknee",
    "spine2",
    "leftankle",
    "rightankle",
    "spine3",
    "lefttoe",
    "righttoe",
    "neck",
    "leftcollar",
    "rightcollar",
    "head",
    "leftshoulder",
    "rightshoulder",
    "leftelbow",
    "rightelbow",
    "leftwrist",
    "rightwrist",
)
NAMES = {
    "root": "hips pelvis hip root",
    "hip": "hip upleg thigh femur upperleg leg",
    "knee": "knee shin leg tibia lowleg lowerleg calf",
    "ankle": "ankle foot",
    "toe": "toe toebase ball forefoot foot",
    "shoulder": "shoulder arm uparm upperarm humerus",
    "elbow": "elbow forearm lowarm lowerarm radius",
    "wrist": "wrist hand",
    "neck": "neck neck1 lowerneck spine3",
    "head": "head",
}
"""Names of a joint by what it joins, the surest first, without the side and in small letters."""
WORDS = tuple(dict.fromkeys(" ".join(NAMES.values()).split()))
"""Every name of a joint once; after l or r it shows that the letter is a side."""
BEYOND = {"wrist": 0.1, "hand": 0.35, "fingers": 0.6, "thumb": 0.35}
"""Nodes beyond the wrist, as shares of the forearm."""
RATES = ("mocap_framerate", "mocap_frame_rate", "fps")
"""Names of a frame rate (Hz) in an .npz file, the surest first."""
MOST_NUMBERS = 100_000_000
FREE_NUMBERS = 3_000_000
MOST_EXPANSION = 100
"""Numbers of positions and turns that a file may make: this many, or so many times its own."""
MOST_BVH_BYTES = 256 << 20


class _Joint(NamedTuple):
    """A joint of a BVH file: its parent ("" at the root), its OFFSET (3,) and its CHANNELS."""

    name: str
    parent: str
    offset: np.ndarray
    channels: list[str]


def _plain(name: str) -> tuple[str, str]:
    """A joint's side ("l", "r" or "") and its name without it, in small letters."""
    word = re.sub(r"[^a-z0-9]", "", re.sub(r"^.*[:|]", "", name).lower())
    side = re.match(f"left|right|[lr](?={'|'.join(WORDS)})", word)
    if side is None:
        return "", word
    return side[0][0], word[side.end() :]


def to_nodes(joints: dict[str, np.ndarray], where: str) -> np.ndarray:
    """Return the positions (F, 31, 3) of the nodes from those (F, 3) of joints, in their unit.

    A joint `NAME/end` is the end of a chain. Raises: InputError naming the joint that no name
    tells.
    """
    known = {_plain(name): name for name in reversed(list(joints)) if not name.endswith("/end")}

    def joint(meaning: str, side: str = "", but: str = "") -> str:
        """The name of the joint that joins what `meaning` says, other than the joint `but`."""
        for word in NAMES[meaning].split():
            if (side, word) in known and known[side, word] != but:
                return known[side, word]
        side = {"l": "left ", "r": "right "}.get(side, "")
        raise InputError(
            f"{where}: no joint is called a {side}{meaning}, expected {NAMES[meaning].split()} "
            f"among {sorted(joints)[:40]}"
        )

    positions = {"root": joints[joint("root")]}
    for side in "lr":
        ankle = joint("ankle", side)
        knee = joint("knee", side)
        # A foot without a toe ends in the end of its chain.
        toe = f"{ankle}/end"
        if toe not in joints:
            toe = joint("toe", side, but=ankle)
        elbow = joints[joint("elbow", side)]
        wrist = joints[joint("wrist", side)]
        toes = joints.get(f"{toe}/end", joints[toe] + 0.3 * (joints[toe] - joints[ankle]))
        limbs = {
            "hipjoint": joints[joint("hip", side, but=knee)],
            "femur": joints[knee],
            "tibia": joints[ankle],
            "foot": joints[toe],
            "toes": toes,
            "clavicle": joints[joint("shoulder", side)],
            "humerus": elbow,
            "radius": wrist,
        }
        limbs |= {name: wrist + share * (wrist - elbow) for name, share in BEYOND.items()}
        positions |= {side + name: position for name, position in limbs.items()}
    head = joint("head")
    skull = joints[head]
    # Between the shoulders, where no joint is a neck.
    neck = (positions["lclavicle"] + positions["rclavicle"]) / 2
    if any(("", word) in known for word in NAMES["neck"].split()):
        neck = joints[joint("neck")]
    top = joints.get(f"{head}/end", skull + 0.8 * (skull - neck))
    for name, share in (("lowerback", 1 / 3), ("upperback", 2 / 3), ("thorax", 1.0)):
        positions[name] = positions["root"] + share * (neck - positions["root"])
    positions |= {"lowerneck": (neck + skull) / 2, "upperneck": skull, "head": top}
    return np.stack([positions[name] for name in NODES], axis=1)


def moved(nodes: np.ndarray, rate_hz: float, height_m: float | None, where: str) -> Motion:
    """Return the motion of nodes (F, 31, 3) whose unit and vertical axis are their own.

    height_m: the stature of whom they show, which gives the unit; None where they are in metres.
    Bones have their mean lengths; each turns from its mean direction to that of the frame on the
    shortest way. The vertical axis is the one along which the head is farthest from the feet.
    Raises: InputError naming `where` for positions that are not finite or a body without height.
    """
    if not np.isfinite(nodes).all() or len(nodes) < 2 or np.abs(nodes).max() > 1e6:
        raise InputError(
            f"{where}: {len(nodes)} frames with places that are not finite, expected two good ones "
            "or more"
        )
    head = nodes[:, NODES.index("head")]
    shin = nodes[:, NODES.index("ltibia")]
    reach = np.mean(head - shin, axis=0)
    axis = int(np.abs(reach).argmax())
    order = [(axis + 1) % 3, (axis + 2) % 3, axis]  # a proper rotation: z becomes the vertical
    nodes = nodes[..., order]
    if reach[axis] <= 0:
        nodes = nodes * [1, -1, -1]
    bones = nodes - nodes[:, PARENTS]
    bones[:, 0] = 0
    length = portable.norm(bones).mean(axis=0)
    mean = bones.mean(axis=0)
    size = portable.norm(mean)
    directions = mean / np.where(size > 0, size, 1)[:, None]
    rest_bones = np.where((size > 0)[:, None], directions * length[:, None], 0.0)
    unit = 1.0
    if height_m:
        unit = height_m / stature_m(rest_bones)
    if not 0 < unit < np.inf:
        raise InputError(f"{where}: a body of no height, expected joints of a person")
    return Motion(nodes[:, 0] * unit, _shortest(rest_bones, bones), rest_bones * unit, rate_hz)


def _shortest(rest_bones: np.ndarray, bones: np.ndarray) -> np.ndarray:
    """Return the rotations (F, N, 3, 3) from bones (N, 3) to the directions of bones (F, N, 3)."""
    a = rest_bones / np.maximum(portable.norm(rest_bones), 1e-12)[:, None]
    b = bones / np.maximum(portable.norm(bones), 1e-12)[..., None]
    cross = np.cross(a, b)
    cosine = portable.dot(a, b)
    x, y, z = np.moveaxis(cross, -1, 0)
    zero = np.zeros_like(x)
    entries = [zero, -z, y, z, zero, -x, -y, x, zero]
    skew = np.stack(entries, axis=-1).reshape(*x.shape, 3, 3)
    factor = 1 / np.maximum(1 + cosine, 1e-6)
    return np.eye(3) + skew + factor[..., None, None] * portable.product(skew, skew)


def read_bvh(path: str | Path) -> tuple[dict[str, np.ndarray], float]:
    """Return the positions (F, 3) of each joint of a BVH file in its unit, and its rate (Hz).

    The end of a chain is named `NAME/end` after the chain's last joint.
    Raises: InputError naming the file and the joint or frame that is wrong.
    """
    head, _, data = text_of(path, "motion file", MOST_BVH_BYTES, "replace").partition("MOTION")
    stack: list[str] = []
    joints: list[_Joint] = []
    words = iter(re.sub(r"#.*", "", head).split())
    with reading(path, "BVH motion"):
        for word in words:
            if word in ("ROOT", "JOINT", "End"):
                parent = stack[-1] if stack else ""
                name = next(words)
                if word == "End":  # followed by the word Site, which is no name
                    name = f"{stack[-1]}/end"
                joints.append(_Joint(name, parent, np.zeros(3), []))
                stack.append(name)
            elif word == "OFFSET":
                joints[-1].offset[:] = [float(next(words)) for _ in range(3)]
            elif word == "CHANNELS":
                joints[-1].channels.extend(next(words) for _ in range(int(next(words))))
            elif word == "}":
                stack.pop()
        timing = re.match(r"\s*Frames:\s*(\d+)\s*Frame Time:\s*(\S+)", data)
        if timing is None:
            raise ValueError("no lines Frames and Frame Time after MOTION")
        frames = int(timing[1])
        step = float(timing[2])
        values = np.array(re.sub(r"#.*", "", data[timing.end() :]).split(), float)
        width = sum(len(joint.channels) for joint in joints)
        timed = frames > 0 and 1e-5 <= step <= 1
        if not timed or len(values) != frames * width or not np.isfinite(values).all():
            raise ValueError(
                f"{len(values)} finite numbers, expected {frames} frames of {width}, {step} s apart"
            )
        positions = _followed(joints, values.reshape(frames, width))
    return positions, 1 / step


def _followed(joints: list[_Joint], values: np.ndarray) -> dict[str, np.ndarray]:
    """Return the positions (F, 3) of joints, parents first, from their channels (F, C)."""
    twice = len({joint.name for joint in joints}) < len(joints)
    numbers = len(joints) * len(values) * 9  # a rotation (3, 3) of each joint in each frame
    # Ends of chains have no numbers of their own in the file.
    most = min(MOST_NUMBERS, max(FREE_NUMBERS, MOST_EXPANSION * values.size))
    if twice or numbers > most:
        raise ValueError("a joint that stands twice, or too many joints and frames")
    positions: dict[str, np.ndarray] = {}
    turns: dict[str, np.ndarray] = {}
    column = 0
    for name, parent, offset, channels in joints:
        turn = np.eye(3)
        shift = np.tile(offset, (len(values), 1))
        for channel in channels:
            axis = channel[0].lower()
            if channel.endswith("position"):
                # A position takes the place of the offset's, as readers of BVH have it.
                shift[:, "xyz".index(axis)] = values[:, column]
            else:
                turn = portable.product(turn, rotation(axis, np.radians(values[:, column])))
            column += 1
        above = np.eye(3)
        start = np.zeros(3)
        if parent:
            above = turns[parent]
            start = positions[parent]
        positions[name] = portable.applied(above, shift) + start
        turns[name] = portable.product(above, turn)
    return positions


def read_joints(path: str | Path) -> tuple[dict[str, np.ndarray], float | None]:
    """Return the positions (F, 3) m of an .npz file's joints, and its rate where it says one.

    The file has an array `joints` (F, J, 3), J of at least 22 in SMPL's order or named by an array
    `names` (J,), and maybe `mocap_framerate` or `fps`. AMASS itself keeps angles: its users compute
    joints by a body model, as SMPL's.
    Raises: InputError naming the file and what is wrong with it.
    """
    checked_archive(path, "motion file")
    try:
        with np.load(path, allow_pickle=False) as data:
            rates = [float(data[key]) for key in RATES if key in data.files]
            if "joints" not in data.files:
                raise ValueError(
                    f"arrays {data.files[:20]}, expected `joints` (F, J, 3) in metres: a body "
                    "model makes them of poses"
                )
            positions = np.asarray(data["joints"], float)
            names = [str(name) for name in data["names"]] if "names" in data.files else SMPL
    except (*UNREADABLE, zipfile.BadZipFile, TypeError, MemoryError) as error:
        raise InputError(f"{path}: not a readable file of joints ({error})") from None
    shape = positions.shape
    if positions.ndim != 3 or shape[1] < len(names) or shape[-1] != 3:
        raise InputError(
            f"{path}: joints has shape {shape}, expected (frames, at least {len(names)}, 3)"
        )
    rate = rates[0] if rates else None
    return {name: positions[:, index] for index, name in enumerate(names)}, rate
