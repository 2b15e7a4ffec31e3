"""Which way the front of a target points: what its parts, their names and its shape say, and whether they agree.

Strong evidence are names such as front_left, wheel axles and the axes of propellers. Weak evidence is the shape alone:
a mirror plane, the long axis of a car, the span of a plane without lift rotors.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from lowalt.extensions.drafting.guesses import ASYMMETRIC, SYMMETRIC, off_mirror
from lowalt.files.errors import InputError

LEVEL, ALONG = 0.5, 0.9
"""Cosines: an axis is horizontal if its cosine to `up` is below LEVEL, and along an axis of the file from ALONG on."""

CLEAR, OFF_MIDDLE = 2.0, 0.05
"""A direction lies along one of the two horizontal axes if its part there is at least CLEAR times that along the other,
and OFF_MIDDLE times the target's largest extent."""

LONG_CAR, LONG_WING = 1.2, 1.5
"""Least ratio of the horizontal extents at which the longer is a vehicle's length or a plane's span."""

NOTHING_TELLS = "no part tells"
SPAN = "the span"
MOST_POINTS = 4000
"""Most points whose mirror image is searched for."""

WORDS = {
    "front": {"front", "fore", "fwd", "forward", "nose", "fl", "fr", "lf", "rf"},
    "rear": {"rear", "back", "aft", "tail", "rl", "rr", "bl", "br", "lb", "rb"},
    "left": {"left", "fl", "rl", "bl", "lf", "lb"},
    "right": {"right", "fr", "rr", "br", "rf", "rb"},
}
"""Words in the names of parts that say where a part is."""


@dataclass(frozen=True)
class Turning:
    """A rotor or wheel along the file's axes: its `name`, its `hub` (3,) m, and its `axis` (3,) of length one, whose
    sign counts where it is `signed`."""

    name: str
    hub: np.ndarray
    axis: np.ndarray
    signed: bool = False


@dataclass(frozen=True)
class Shape:
    """What is seen of a target along its file's axes: its `category`, `up` (3,) of length one, `points` (N, 3) m of its
    surface, the centre (3,) m of each of its parts by name, the parts that turn, and the centres of steered wheels."""

    category: str
    up: np.ndarray
    points: np.ndarray
    named: dict[str, np.ndarray]
    turning: list[Turning] = field(default_factory=list)
    steered: list[np.ndarray] = field(default_factory=list)


@dataclass(frozen=True)
class Evidence:
    """A reason, in `words`, for a front along the `axis` (0 to 2): towards `sign`, or either way where that is 0, and
    then rather towards `hint`. A front that contradicts `binding` evidence cannot be made."""

    words: str
    axis: int
    sign: int = 0
    hint: int = 0
    strong: bool = True
    binding: bool = False


@dataclass(frozen=True)
class Front:
    """The front of a target: an axis such as "-y", the reasons in `words`, and whether it is `sure`."""

    axis: str
    words: str
    sure: bool

    @property
    def comment(self) -> str:
        """The comment that the line of a draft ends in."""
        other = self.axis[1:] if self.axis[0] == "-" else f"-{self.axis}"
        if self.sure:
            return f"  # {self.words}" * bool(self.words)
        return f"  # GUESSED, please confirm: {self.axis} or {other}; {self.words}"


def _axis(number: int, sign: int) -> str:
    """The name of an axis, such as -y."""
    return "-" * (sign < 0) + "xyz"[number]


def _clear(way: np.ndarray, level: list[int], size: float) -> tuple[int, int] | None:
    """The axis along which a direction (3,) m clearly lies, and its sign."""
    first, second = sorted(level, key=lambda axis: -abs(way[axis]))
    if abs(way[first]) < max(CLEAR * abs(way[second]), OFF_MIDDLE * size):
        return None
    return first, int(np.sign(way[first]))


def _words(name: str) -> set[str]:
    """The words of a part's name, which underscores, spaces or capitals set apart."""
    return set(map(str.lower, re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)))


def _from_names(shape: Shape, level: list[int], middle: np.ndarray, size: float) -> Iterator[Evidence]:
    """What names such as front_left say by the places of the parts that have them."""
    ways, examples = {}, {}
    for word, opposite in (("front", "rear"), ("right", "left")):
        sides = [[name for name in shape.named if _words(name) & WORDS[side]] for side in (word, opposite)]
        if any(sides):
            ends = [np.mean([shape.named[name] for name in names], axis=0) if names else middle for names in sides]
            ways[word], examples[word] = ends[0] - ends[1], (sides[0] or sides[1])[0]
    # Left and right may be the viewer's, so they count only where front and rear do not tell.
    if "front" in ways and (clear := _clear(ways["front"], level, size)):
        yield Evidence(f"names such as {examples['front']!r}", *clear)
        return
    ahead = {(axis, sign): sign * np.eye(3)[axis] for axis in level for sign in (1, -1)}
    axes = {front: {"front": along, "right": np.cross(along, shape.up)} for front, along in ahead.items()}
    # Propellers at opposite corners lie neither ahead nor aside alone, but only one front suits both of their words.
    fits = [front for front in axes if all(axes[front][word] @ way > OFF_MIDDLE * size for word, way in ways.items())]
    if len(ways) == 2 and len(fits) == 1:
        yield Evidence(f"names such as {examples['front']!r}", *fits[0])
        return
    if "right" in ways and (clear := _clear(ways["right"], level, size)):
        fitting = next(front for front in axes if axes[front]["right"] @ ahead[clear] > LEVEL)
        yield Evidence(f"names such as {examples['right']!r}", *fitting)


def _from_wheels(shape: Shape, level: list[int], size: float) -> Iterator[Evidence]:
    """What the axles of wheels say, and which of them are steered."""
    axles = [np.abs(part.axis) for part in shape.turning if abs(part.axis @ shape.up) < LEVEL]
    axes = {int(axle.argmax()) for axle in axles if axle.max() > ALONG}
    if len(axes) == 1:
        yield Evidence("the wheel axles", sum(level) - axes.pop(), binding=True)
    if shape.steered and len(shape.steered) < len(shape.turning):
        way = np.mean(shape.steered, axis=0) - np.mean([part.hub for part in shape.turning], axis=0)
        if along := _clear(way, level, size):
            yield Evidence("the steered wheels", *along)


def _from_propellers(shape: Shape, level: list[int], size: float) -> Iterator[Evidence]:
    """What propellers with level axes say; the tail rotor of a helicopter points sideways, behind the main rotor."""
    upright = [part for part in shape.turning if abs(part.axis @ shape.up) > LEVEL]
    others = [part for part in shape.turning if abs(part.axis @ shape.up) <= LEVEL]
    axes = {int(np.abs(part.axis).argmax()) for part in others}
    if len(axes) != 1 or any(np.abs(part.axis).max() < ALONG for part in others):
        return
    axis = axes.pop()
    if len(upright) == len(others) == 1:
        way = others[0].hub - upright[0].hub
        along = _clear(way, level, size)
        if along and along[0] != axis:
            yield Evidence("the tail rotor", along[0], -along[1])
            return
    signs = {int(np.sign(part.axis[axis])) for part in others if part.signed}
    yield Evidence("the axis of the propeller", axis, hint=signs.pop() if len(signs) == 1 else 0)


def evidence(shape: Shape) -> list[Evidence]:
    """Return what says where the front of a target is, strong evidence first."""
    vertical = int(np.abs(shape.up).argmax())
    level = [axis for axis in range(3) if axis != vertical]
    low, high = shape.points.min(axis=0), shape.points.max(axis=0)
    extent, size = high - low, float((high - low).max())
    found = list(_from_names(shape, level, (low + high) / 2, size))
    if shape.category == "Vehicle":
        found += _from_wheels(shape, level, size)
    elif shape.category == "UAV":
        found += _from_propellers(shape, level, size)
    some = np.unique(np.linspace(0, len(shape.points) - 1, min(len(shape.points), MOST_POINTS)).astype(int))
    off = off_mirror(shape.points[some])[level]
    if off.min() < SYMMETRIC and off.max() > ASYMMETRIC and off.min() < off.max() / 2:
        found.append(Evidence("the mirror plane", level[int(off.argmax())], strong=shape.category == "Bird"))
    short, long = sorted(level, key=lambda axis: extent[axis])
    ratio = extent[long] / max(extent[short], 1e-300)
    if shape.category == "Vehicle" and ratio > LONG_CAR:
        found.append(Evidence("the long axis", long, strong=False))
    lifting = any(abs(part.axis @ shape.up) > LEVEL for part in shape.turning)
    if shape.category == "UAV" and not lifting and ratio > LONG_WING:
        found.append(Evidence(SPAN, short, strong=False))
    return sorted(found, key=lambda item: not item.strong)


def _refuse_given(given: str, found: list[Evidence]) -> None:
    """Refuse a given front that contradicts binding evidence. Raises: InputError naming the option that resolves it."""
    for item in found:
        if item.binding and "xyz"[item.axis] != given[-1]:
            ahead = "xyz"[item.axis]
            raise InputError(f"--front is {given}, but {item.words} say that the front is {ahead} or -{ahead}: give "
                             f"--front {ahead} or --front=-{ahead}")  # fmt: skip


def front_of(shape: Shape, given: str | None, usual: str | None, otherwise: str) -> Front:
    """Return the front of a target, from evidence, and the evidence in words.

    given: the front that the user states; usual: the front that files of this format have by convention; otherwise: the
    front without evidence.
    Raises: InputError where strong evidence contradicts itself or binding evidence contradicts the user, naming both
    and the option that resolves it.
    """
    found = evidence(shape)
    if given:
        _refuse_given(given, found)
        return Front(given, "", True)
    if usual:  # long sides alone do not outweigh the convention
        found = [item for item in found if item.words != SPAN or "xyz"[item.axis] == usual[-1]]
    strong = [item for item in found if item.strong]
    ways = {_axis(item.axis, item.sign): item for item in strong if item.sign}
    axes = {item.axis: item for item in strong}
    if len(axes) > 1 or len(ways) > 1:
        one, other, *_ = axes.values() if len(axes) > 1 else ways.values()
        told = [_axis(item.axis, item.sign or 1) for item in (one, other)]
        raise InputError(f"{one.words} say that the front is {told[0]}, {other.words} that it is {told[1]}: give "
                         f"--front={told[0]} or --front={told[1]}")  # fmt: skip
    lifting = sum(abs(part.axis @ shape.up) > LEVEL for part in shape.turning) > 2
    if not strong and usual and (not found or (shape.category == "UAV" and lifting)):
        return Front(usual, f"{usual} is the front of such files; no part tells", False)
    if not found:
        return Front(otherwise, NOTHING_TELLS, False)
    axis = found[0].axis
    agreeing = [item for item in found if item.axis == axis]
    *others, last = dict.fromkeys(item.words for item in agreeing)
    words = f"{', '.join(others)} and {last}" if others else last
    if ways:
        return Front(next(iter(ways)), words, True)
    if usual and usual[-1] == "xyz"[axis]:
        return Front(usual, f"{words}; {usual} is the front of such files", True)
    hint = next((item.hint for item in agreeing if item.hint), 1)
    return Front(_axis(axis, hint), words, False)
