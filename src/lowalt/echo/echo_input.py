"""The input of the echo kernels and its checks: rigid parts with poses, or plain positions.

Rigid parts need less memory, because no array of symbols x points is made.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.files.errors import InputError


class Rigid(NamedTuple):
    """Points on rigid parts with a pose of each part at each symbol.

    Point l of part p = part[l] stands at rotation[n, p] @ points[l] + translation[n, p].
    rotation: (N, P, 3, 3); translation: (N, P, 3) m, global frame; points: (L, 3) m; part: (L,)
    int.
    """

    rotation: np.ndarray
    translation: np.ndarray
    points: np.ndarray
    part: np.ndarray


class Target(NamedTuple):
    """A checked motion with the points' cross sections and their square roots, for all stations.

    For plain positions, `rotation` has shape (0, 0, 3, 3) and `translation` (N, L, 3) holds the
    positions.
    """

    rotation: np.ndarray
    translation: np.ndarray
    points: np.ndarray
    part: np.ndarray
    root_rcs: np.ndarray
    rcs_m2: np.ndarray


class EchoInput(NamedTuple):
    """Checked input of the kernels: the fields of `Target`, and the beams' aim point.

    The fields are repeated for type checkers.
    """

    rotation: np.ndarray
    translation: np.ndarray
    points: np.ndarray
    part: np.ndarray
    root_rcs: np.ndarray
    rcs_m2: np.ndarray
    aim: np.ndarray

    @property
    def first(self) -> int:
        """The part whose translation is the reference; without rotations, the point."""
        if len(self.part) == 0:
            return 0
        return int(self.part[0])


def named(sample: str) -> str:
    """Return the sample's name as the start of a message."""
    return f"{sample}: " if sample else ""


def _float(name: str, value, shape: tuple[int | str, ...], sample: str) -> np.ndarray:
    """Return `value` as contiguous float64 of this shape, where a letter is any size >= 1."""
    try:
        array = np.ascontiguousarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{sample}{name} is {value!r:.80}, expected real numbers") from error
    fits = array.ndim == len(shape) and all(
        have == want or (isinstance(want, str) and have > 0)
        for have, want in zip(array.shape, shape, strict=True)
    )
    if not fits:
        expected = str(shape).replace("'", "")
        raise InputError(f"{sample}{name} has shape {array.shape}, expected {expected}")
    # Where the sum is finite all numbers are, so that each number is tested only where it is not.
    if not math.isfinite(array.sum()) and not np.isfinite(array).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise InputError(
            f"{sample}{name}[{', '.join(map(str, index))}] is {array[index]}, expected a finite "
            "number"
        )
    # Copy a read-only array, because numba would compile the kernels a second time for it.
    if not array.flags.writeable:
        return array.copy()
    return array


def target(motion: Rigid | np.ndarray, rcs_m2: np.ndarray | float, sample: str = "") -> Target:
    """Return the checked target of a motion and its cross sections.

    motion: `Rigid` or positions (N, L, 3) m; rcs_m2: (L,) m2 or one number for all points. The
    check takes 5 % of the time of a signal, so a caller with several stations calls this once and
    passes the result to each `echo_signal`.
    Raises: InputError naming the argument, its value and the sample for NaN, infinite, empty or
    wrongly shaped input, and for a negative cross section.
    """
    where = named(sample)
    if isinstance(motion, Rigid):
        rotation = _float("motion.rotation", motion.rotation, ("N", "P", 3, 3), where)
        symbols, parts = rotation.shape[:2]
        translation = _float("motion.translation", motion.translation, (symbols, parts, 3), where)
        points = _float("motion.points", motion.points, ("L", 3), where)
        part = np.ascontiguousarray(motion.part)
        if part.shape != (len(points),) or part.dtype.kind not in "iu":
            raise InputError(
                f"{where}motion.part has shape {part.shape} and type {part.dtype}, expected "
                f"({len(points)},) integers"
            )
        if part.min() < 0 or part.max() >= parts:
            raise InputError(
                f"{where}motion.part spans {part.min()}..{part.max()}, expected 0..{parts - 1}"
            )
        part = part.astype(np.int64)
        count = len(points)
        if count == parts and np.array_equal(part, np.arange(count)) and not rotation.any():
            rotation, points, part = _no_rotation()
    else:
        translation = _float("positions", motion, ("N", "L", 3), where)
        count = translation.shape[1]
        rotation, points, part = _no_rotation()
    if np.ndim(rcs_m2) == 0:
        rcs_m2 = np.broadcast_to(np.asarray(rcs_m2), (count,))
    rcs = _float("rcs_m2", rcs_m2, (count,), where)
    if rcs.min() < 0:
        raise InputError(
            f"{where}rcs_m2[{int(rcs.argmin())}] is {rcs.min()}, expected square metres >= 0"
        )
    return Target(rotation, translation, points, part, np.sqrt(rcs), rcs)


def check(network: Network, station: Station, motion, rcs_m2, aim_m, sample: str = "") -> EchoInput:
    """Return the checked input for one motion and one station.

    rcs_m2 is None if `motion` is a `Target`.
    Raises: as `target`, and InputError for cross sections given twice or an aim at the station
    itself.
    """
    where = named(sample)
    if isinstance(motion, Target):
        if rcs_m2 is not None:
            raise InputError(
                f"{where}rcs_m2 is {rcs_m2!r:.80}, expected None: a Target holds its cross sections"
            )
        seen = motion
    else:
        seen = target(motion, rcs_m2, sample)
    aim = _float("aim_m", aim_m, (3,), where)
    if aim.tolist() == list(station.position_m):
        raise InputError(
            f"{where}aim_m is {aim_m}, the place of station {station.name}: no direction to aim at"
        )
    check_station(network, station)
    return EchoInput(*seen, aim)


def check_station(network: Network, station: Station) -> None:
    """Raise InputError where a number of the station is not finite or its frequency <= 0."""
    if not (np.isfinite(station.frequency_hz) and station.frequency_hz > 0):
        raise InputError(
            f"station {station.name}: frequency_hz is {station.frequency_hz}, expected a positive "
            "number"
        )
    numbers = (*station.position_m, station.normal_rad)
    if np.shape(station.position_m) != (3,) or not all(map(math.isfinite, numbers)):
        raise InputError(
            f"station {station.name}: position_m {station.position_m} or normal_rad "
            f"{station.normal_rad} is not finite"
        )


def _no_rotation() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return empty rotations, points and parts, for points given by positions alone."""
    return np.zeros((0, 0, 3, 3)), np.zeros((0, 3)), np.zeros(0, np.int64)
