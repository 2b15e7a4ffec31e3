"""Which way the front of a target points: what its parts, names and shape say about it.

Strong evidence are names such as front_left, wheel axles and the axes of propellers. Weak evidence
is the shape alone: a mirror plane, the long axis of a car, the span of a plane without lift rotors.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from lowalt.config.classes import listed
from lowalt.extensions.drafting.guesses import ASYMMETRIC, SYMMETRIC, off_mirror
from lowalt.files.errors import InputError

LEVEL = 0.5
ALONG = 0.9
"""Cosines: an axis is horizontal below LEVEL to `up`, along an axis of the file from ALONG on."""

CLEAR = 2.0
OFF_MIDDLE = 0.05
"""A direction lies along one of the two horizontal axes if its component there is large enough.

It must be at least CLEAR times the component along the other axis, and OFF_MIDDLE times the
target's largest extent.
"""

LONG_CAR = 1.2
LONG_WING = 1.5
"""Least ratio of horizontal extents at which the longer is a car's length or a plane's span."""

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
    """A rotor or wheel along the file's axes.

    hub: (3,) m; axis: (3,) of length one, whose sign counts where it is `signed`.
    """

    name: str
    hub: np.ndarray
    axis: np.ndarray
    signed: bool = False


@dataclass(frozen=True)
class Shape:
    """What is seen of a target along its file's axes.

    up: (3,) of length one; points: (N, 3) m of its surface; named: the centre (3,) m of each of its
    parts by name; turning: the parts that turn; steered: the centres of steered wheels.
    """

    category: str
    up: np.ndarray
    points: np.ndarray
    named: dict[str, np.ndarray]
    turning: list[Turning] = field(default_factory=list)
    steered: list[np.ndarray] = field(default_factory=list)


@dataclass(frozen=True)
class Evidence:
    """A reason, in `words`, for a front along the `axis` (0 to 2).

    The front points towards `sign`, or either way where that is 0, and then rather towards `hint`.
    A front that contradicts `binding` evidence cannot be made.
    """

    words: str
    axis: int
    sign: int = 0
    hint: int = 0
    strong: bool = True
    binding: bool = False


@dataclass(frozen=True)
class Front:
    """The front of a target: an axis such as "-y", the reasons in `words`, whether it is `sure`."""

    axis: str
    words: str
    sure: bool

    @property
    def comment(self) -> str:
        """The comment that the line of a draft ends in."""
        if self.sure and self.words:
            return f"  # {self.words}"
        if self.sure:
            return ""
        other = f"-{self.axis}".removeprefix("--")
        return f"  # GUESSED, please confirm: {self.axis} or {other}; {self.words}"


def _axis(number: int, sign: int) -> str:
    """The name of an axis, such as -y."""
    return "-" * (sign < 0) + "xyz"[number]


def _clear(way: np.ndarray, level: list[int], size: float) -> tuple[int, int] | None:
    """The axis along which a direction (3,) m clearly lies, and its sign; None where none does."""
    first, second = sorted(level, key=lambda axis: -abs(way[axis]))
    if abs(way[first]) < max(CLEAR * abs(way[second]), OFF_MIDDLE * size):
        return None
    return first, int(np.sign(way[first]))


def _words(name: str) -> set[str]:
    """The words of a part's name, which underscores, spaces or capitals set apart."""
    return set(map(str.lower, re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)))


def _called(shape: Shape, side: str) -> list[str]:
    """The names of the parts that WORDS place on a side."""
    return [name for name in shape.named if _words(name) & WORDS[side]]


def _mean_centre(shape: Shape, names: list[str], otherwise: np.ndarray) -> np.ndarray:
    """The mean centre (3,) m of named parts, `otherwise` where there is none."""
    if not names:
        return otherwise
    return np.mean([shape.named[name] for name in names], axis=0)


def _suiting(
    ahead: dict[tuple[int, int], np.ndarray],
    up: np.ndarray,
    ways: dict[str, np.ndarray],
    least_m: float,
) -> list[tuple[int, int]]:
    """Which fronts suit the ways (3,) m to the front and to the right.

    ahead: their directions (3,). A front suits both by at least least_m; none does where one of the
    two ways is unknown.
    """
    if len(ways) < 2:
        return []
    fits = []
    for front, along in ahead.items():
        forward_m = along @ ways["front"]
        rightward_m = np.cross(along, up) @ ways["right"]
        if forward_m > least_m and rightward_m > least_m:
            fits.append(front)
    return fits


def _from_names(
    shape: Shape, level: list[int], middle: np.ndarray, size: float
) -> Iterator[Evidence]:
    """What names such as front_left say by the positions of the parts that have them."""
    ways = {}
    examples = {}
    for word, opposite in (("front", "rear"), ("right", "left")):
        names = _called(shape, word)
        opposite_names = _called(shape, opposite)
        if names or opposite_names:
            end = _mean_centre(shape, names, middle)
            opposite_end = _mean_centre(shape, opposite_names, middle)
            ways[word] = end - opposite_end
            examples[word] = (names or opposite_names)[0]
    # Left and right may be the viewer's, so they count only where front and rear do not tell.
    ahead_of_rear = "front" in ways and _clear(ways["front"], level, size)
    if ahead_of_rear:
        yield Evidence(f"names such as {examples['front']!r}", *ahead_of_rear)
        return
    ahead = {}
    for axis in level:
        for sign in (1, -1):
            ahead[axis, sign] = sign * np.eye(3)[axis]
    # Propellers at opposite corners lie neither ahead nor aside alone, but only one front suits
    # both of their words.
    fits = _suiting(ahead, shape.up, ways, OFF_MIDDLE * size)
    if len(fits) == 1:
        yield Evidence(f"names such as {examples['front']!r}", *fits[0])
        return
    right_of_left = "right" in ways and _clear(ways["right"], level, size)
    if right_of_left:
        for front, along in ahead.items():
            if np.cross(along, shape.up) @ ahead[right_of_left] > LEVEL:
                yield Evidence(f"names such as {examples['right']!r}", *front)
                return


def _from_wheels(shape: Shape, level: list[int], size: float) -> Iterator[Evidence]:
    """What the axles of wheels say, and which of them are steered."""
    axles = [np.abs(part.axis) for part in shape.turning if abs(part.axis @ shape.up) < LEVEL]
    axes = {int(axle.argmax()) for axle in axles if axle.max() > ALONG}
    if len(axes) == 1:
        yield Evidence("the wheel axles", sum(level) - axes.pop(), binding=True)
    if shape.steered and len(shape.steered) < len(shape.turning):
        middle = np.mean([part.hub for part in shape.turning], axis=0)
        way = np.mean(shape.steered, axis=0) - middle
        along = _clear(way, level, size)
        if along:
            yield Evidence("the steered wheels", *along)


def _from_propellers(shape: Shape, level: list[int], size: float) -> Iterator[Evidence]:
    """What propellers with level axes say.

    The tail rotor of a helicopter points sideways, behind the main rotor.
    """
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
    hint = signs.pop() if len(signs) == 1 else 0
    yield Evidence("the axis of the propeller", axis, hint=hint)


def evidence(shape: Shape) -> list[Evidence]:
    """Return what says where the front of a target is, strong evidence first."""
    vertical = int(np.abs(shape.up).argmax())
    level = [axis for axis in range(3) if axis != vertical]
    low = shape.points.min(axis=0)
    high = shape.points.max(axis=0)
    extent = high - low
    size = float(extent.max())
    found = list(_from_names(shape, level, (low + high) / 2, size))
    if shape.category == "Vehicle":
        found += _from_wheels(shape, level, size)
    elif shape.category == "UAV":
        found += _from_propellers(shape, level, size)
    count = len(shape.points)
    some = np.unique(np.linspace(0, count - 1, min(count, MOST_POINTS)).astype(int))
    off = off_mirror(shape.points[some])[level]
    if off.min() < SYMMETRIC and off.max() > ASYMMETRIC and off.min() < off.max() / 2:
        along = level[int(off.argmax())]
        found.append(Evidence("the mirror plane", along, strong=shape.category == "Bird"))
    short, long = sorted(level, key=lambda axis: extent[axis])
    ratio = extent[long] / max(extent[short], 1e-300)
    if shape.category == "Vehicle" and ratio > LONG_CAR:
        found.append(Evidence("the long axis", long, strong=False))
    lifting = any(abs(part.axis @ shape.up) > LEVEL for part in shape.turning)
    if shape.category == "UAV" and not lifting and ratio > LONG_WING:
        found.append(Evidence(SPAN, short, strong=False))
    return sorted(found, key=lambda item: not item.strong)


def _refuse_given(given: str, found: list[Evidence]) -> None:
    """Refuse a given front that contradicts binding evidence.

    Raises: InputError naming the option that resolves it.
    """
    for item in found:
        ahead = "xyz"[item.axis]
        if item.binding and ahead != given[-1]:
            raise InputError(
                f"--front is {given}, but {item.words} say that the front is {ahead} or -{ahead}: "
                f"give --front {ahead} or --front=-{ahead}"
            )


def front_of(shape: Shape, given: str | None, usual: str | None, otherwise: str) -> Front:
    """Return the front of a target, from evidence, and the evidence in words.

    given: the front that the user states; usual: the front that files of this format have by
    convention; otherwise: the front without evidence.
    Raises: InputError where strong evidence contradicts itself or binding evidence contradicts the
    user, naming both and the option that resolves it.
    """
    found = evidence(shape)
    if given:
        _refuse_given(given, found)
        return Front(given, "", True)
    if usual:
        # Long sides alone do not outweigh the convention.
        found = [item for item in found if item.words != SPAN or "xyz"[item.axis] == usual[-1]]
    strong = [item for item in found if item.strong]
    ways = {_axis(item.axis, item.sign): item for item in strong if item.sign}
    axes = {item.axis: item for item in strong}
    if len(axes) > 1 or len(ways) > 1:
        one, other, *_ = axes.values() if len(axes) > 1 else ways.values()
        one_front = _axis(one.axis, one.sign or 1)
        other_front = _axis(other.axis, other.sign or 1)
        raise InputError(
            f"{one.words} say that the front is {one_front}, {other.words} that it is "
            f"{other_front}: give --front={one_front} or --front={other_front}"
        )
    lifting = sum(abs(part.axis @ shape.up) > LEVEL for part in shape.turning) > 2
    if not strong and usual and (not found or (shape.category == "UAV" and lifting)):
        return Front(usual, f"{usual} is the front of such files; no part tells", False)
    if not found:
        return Front(otherwise, NOTHING_TELLS, False)
    axis = found[0].axis
    agreeing = [item for item in found if item.axis == axis]
    words = listed(dict.fromkeys(item.words for item in agreeing))
    if ways:
        return Front(next(iter(ways)), words, True)
    if usual and usual[-1] == "xyz"[axis]:
        return Front(usual, f"{words}; {usual} is the front of such files", True)
    hint = next((item.hint for item in agreeing if item.hint), 1)
    return Front(_axis(axis, hint), words, False)
