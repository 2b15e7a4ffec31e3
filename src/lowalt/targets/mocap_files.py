"""Reading CMU's skeleton (.asf) and motion (.amc) text files into arrays.

Every error names the file and the frame. This module knows only the formats; `mocap` turns the
bones by the angles. File axes: x left, y up, z front.
Source: Acclaim's ASF/AMC format as the CMU Graphics Lab Motion Capture Database writes it.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lowalt.files.atomic import existing, text_file
from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.targets.skeleton import LIMBS, NODES

INCH_M = 0.0254
_ROTATIONS = ("rx", "ry", "rz")
_MOVES = ("tx", "ty", "tz")


@dataclass(frozen=True)
class Skeleton:
    """The contents of a skeleton file.

    bones: (31, 3) in file units and file axes; axes_rad: (31, 3), angles of each bone's own frame;
    dofs: the channels of each node in the order of the file; unit_m: metres per file unit.
    """

    bones: np.ndarray
    axes_rad: np.ndarray
    dofs: dict[str, tuple[str, ...]]
    unit_m: float


def _lines(path: Path) -> Iterator[list[str]]:
    """The words of each line of a file, without comments; lines without a word are left out."""
    with text_file(path, "motion file", errors="replace") as file:
        for line in file:
            if words := line.split("#", 1)[0].split():
                yield words


def _sections(path: Path) -> dict[str, list[list[str]]]:
    """The file's sections by keyword, each a list of lines split into words."""
    sections: dict[str, list[list[str]]] = {}
    section: list[list[str]] = []
    for words in _lines(path):
        if words[0].startswith(":"):
            section = sections.setdefault(words[0].lower(), [])
            words = words[1:]
        if words:
            section.append(words)
    return sections


def _blocks(lines: list[list[str]]) -> dict[str, dict[str, list[str]]]:
    """The begin/end blocks by their names, as mappings of first words to the words after them."""
    blocks: list[dict[str, list[str]]] = []
    for words in lines:
        if words[0] == "begin":
            blocks.append({})
        elif words[0] != "end" and blocks:
            blocks[-1].setdefault(words[0].lower(), words[1:])
    return {block["name"][0]: block for block in blocks}


def _refuse_other_nodes(path: Path, hierarchy: list[list[str]]) -> None:
    """Raise InputError where the lines `parent child child ...` are not those of the 31 nodes."""
    parents: dict[str, str] = {}
    for parent, *children in hierarchy:
        parents |= dict.fromkeys(children, parent)
    if parents != LIMBS:
        wrong = sorted(name for name in {*parents, *LIMBS} if parents.get(name) != LIMBS.get(name))
        raise InputError(f"{path}: hierarchy differs from CMU's 31 nodes at {wrong}")


def _strange_channels(dofs: dict[str, tuple[str, ...]]) -> dict[str, tuple[str, ...]]:
    """The nodes whose channels CMU's files do not have: all turn, and the root alone moves."""
    result = {}
    for name, channels in dofs.items():
        allowed = {*_MOVES, *_ROTATIONS} if name == "root" else set(_ROTATIONS)
        if not set(channels) <= allowed:
            result[name] = channels
    return result


def read_skeleton(path: str | Path) -> Skeleton:
    """Return the skeleton of an .asf file.

    Raises: InputError naming the file and what is missing, unknown or no number; also where the
    bones are not the 31 nodes, or angles are not in degrees.
    """
    path = existing(path, "skeleton file")
    sections = _sections(path)
    for name in (":units", ":root", ":bonedata", ":hierarchy"):
        if name not in sections:
            raise InputError(f"{path}: no section {name}, expected an ASF skeleton")
    units = {words[0].lower(): words[1:] for words in sections[":units"]}
    if units.get("angle") != ["deg"]:
        raise InputError(f"{path}: units angle is {units.get('angle')}, expected deg")
    _refuse_other_nodes(path, sections[":hierarchy"])
    root = {words[0].lower(): words[1:] for words in sections[":root"]}
    bones = np.zeros((len(NODES), 3))
    axes = np.zeros((len(NODES), 3))
    dofs = {"root": tuple(word.lower() for word in root.get("order", []))}
    try:
        unit_m = INCH_M / float(units["length"][0])
        fixed = [float(word) for word in root["position"][:3] + root["orientation"][:3]]
        named = _blocks(sections[":bonedata"])
        for name in LIMBS:
            block = named[name]
            index = NODES.index(name)
            direction = np.array([float(word) for word in block["direction"]])
            length = block["length"][0]
            if float(length) < 0:
                raise InputError(f"{path}: length of {name} is {length}, expected at least 0")
            bones[index] = direction / portable.norm(direction) * float(length)
            axis_order = block["axis"][3]
            if axis_order.upper() != "XYZ":
                raise InputError(f"{path}: axis order of {name} is {axis_order!r}, expected XYZ")
            axes[index] = np.radians([float(word) for word in block["axis"][:3]])
            dofs[name] = tuple(word.lower() for word in block.get("dof", []))
    except (KeyError, IndexError, ValueError, ZeroDivisionError) as error:
        raise InputError(
            f"{path}: missing or no number: {error}, expected an ASF skeleton"
        ) from None
    order = root.get("axis", ["xyz"])[0].upper()
    if order != "XYZ":
        raise InputError(f"{path}: axis order of root is {order!r}, expected XYZ")
    wrong = _strange_channels(dofs)
    if wrong or len(dofs["root"]) != 6 or any(fixed):
        raise InputError(
            f"{path}: root order, offset or dof not as in CMU's files "
            f"({wrong or fixed or dofs['root']})"
        )
    if not (np.isfinite(bones).all() and np.isfinite(axes).all() and 0 < unit_m < math.inf):
        raise InputError(f"{path}: a length, direction or axis is not finite")
    return Skeleton(bones, axes, dofs, unit_m)


def _frames(
    path: Path, skeleton: Skeleton, first: int, last: int | None
) -> tuple[dict[int, dict[str, list[float]]], bool]:
    """Return the numbers of each node by frame, and whether the file's angles are in radians.

    Frames are `first` to `last` by the file's own numbers; a clip cut out of a longer one may begin
    at any frame. A file says before its first frame that its angles are in radians.
    Raises: InputError naming file and frame, as `read_motion`.
    """
    frames: dict[int, dict[str, list[float]]] = {}
    frame = None
    radians = False
    for words in _lines(path):
        if words[0].startswith(":"):
            radians |= frame is None and words[0].upper() == ":RADIANS"
        elif len(words) == 1 and words[0].isdecimal():
            number = int(words[0])
            if last is not None and number > last:
                break
            if frame is not None and number != frame + 1:
                raise InputError(
                    f"{path}: frame {number} follows frame {frame}, expected {frame + 1}"
                )
            frame = number
        elif frame is None:
            raise InputError(
                f"{path}: {' '.join(words)[:60]!r} stands before frame 1, expected an AMC motion"
            )
        elif frame >= first:
            values = frames.setdefault(frame, {})
            if words[0] in values:
                raise InputError(
                    f"{path}: frame {frame} has {words[0]} twice, expected each node once"
                )
            values[words[0]] = _values(f"{path}: frame {frame}", words, skeleton)
    return frames, radians


def _values(where: str, words: list[str], skeleton: Skeleton) -> list[float]:
    """Return the numbers of a line of a frame.

    Raises: InputError naming `where` for a fault in it.
    """
    expected = len(skeleton.dofs.get(words[0], ()))
    try:
        values = [float(word) for word in words[1:]]
    except ValueError:
        values = []
    if not expected or len(values) != expected or not all(map(math.isfinite, values)):
        text = " ".join(words)[:80]
        raise InputError(
            f"{where}: {text!r}, expected a node of the skeleton and {expected} finite numbers"
        )
    return values


def read_motion(
    path: str | Path, skeleton: Skeleton, first: int = 1, last: int | None = None
) -> tuple[dict[str, np.ndarray], int]:
    """Return the channels (F, channels) of each node that has any, and the first frame's number.

    Frames are `first` to `last` by the file's own numbers, both inclusive; a file that begins later
    is read from its first frame. Values in file units and degrees; a file that says `:RADIANS` is
    converted. Frames outside first..last are not checked, so that a record can leave out frames
    with known faults.
    Raises: InputError naming file and frame: a frame that lacks a node or comes out of order, a
    value that is no finite number, a node twice, an all-zero root, a frame equal to the one before
    it, fewer than two frames left.
    """
    path = existing(path, "motion file")
    frames, radians = _frames(path, skeleton, first, last)
    first = max(first, min(frames, default=first))
    count = (max(frames) if frames else 0) - first + 1
    if count < 2 or (last is not None and max(frames) < last):
        present = f"frames up to {max(frames)}" if frames else "no frame in that range"
        raise InputError(
            f"{path}: {present}, expected frames {first} to {last or 'the end'}, at least two"
        )
    needed = [name for name, dofs in skeleton.dofs.items() if dofs]
    for frame in range(first, first + count):
        lacking = [name for name in needed if name not in frames.get(frame, {})]
        if lacking:
            raise InputError(
                f"{path}: frame {frame} lacks {lacking}, expected all nodes (end it by last_frame)"
            )
    motion = {}
    for name in needed:
        rows = [frames[frame][name] for frame in range(first, first + count)]
        motion[name] = np.array(rows)
    if radians:
        for name, values in motion.items():
            turns = [dof[0] == "r" for dof in skeleton.dofs[name]]
            values[:, turns] = np.degrees(values[:, turns])
    empty = first + np.flatnonzero(~motion["root"].any(axis=1))
    if len(empty):
        raise InputError(
            f"{path}: frame {empty[0]} has an all-zero root, expected a tracked one (begin by "
            "first_frame)"
        )
    same = [(values[1:] == values[:-1]).all(axis=1) for values in motion.values()]
    still = np.all(same, axis=0)
    if still.any():
        frame = first + 1 + int(np.argmax(still))
        raise InputError(
            f"{path}: frame {frame} repeats frame {frame - 1}, expected a recording that is not "
            "frozen"
        )
    return motion, first
