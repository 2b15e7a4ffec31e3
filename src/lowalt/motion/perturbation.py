"""What disturbs a target's own motion: extra turns of its parts, an offset of its path, a tilt of its body."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np


class Perturbation(NamedTuple):
    """What is added to a target's own motion at N symbols; every field may be None.

    angle_rad: part -> (N,) rad, added to that part's turn; offset_m: (N, 3) m, added to the whole target's place,
    global frame; tilt_rad: (N, 3) rad, added to the row's yaw, pitch and roll.
    """

    angle_rad: dict[int, np.ndarray] | None = None
    offset_m: np.ndarray | None = None
    tilt_rad: np.ndarray | None = None


def combined(perturbations: Iterable[Perturbation]) -> Perturbation:
    """Return the sum of several perturbations of the same N symbols; of none, one that changes nothing."""
    angles: dict[int, np.ndarray] = {}
    offset = tilt = None
    for one in perturbations:
        for part, angle in (one.angle_rad or {}).items():
            angles[part] = angles[part] + angle if part in angles else angle
        if one.offset_m is not None:
            offset = one.offset_m if offset is None else offset + one.offset_m
        if one.tilt_rad is not None:
            tilt = one.tilt_rad if tilt is None else tilt + one.tilt_rad
    return Perturbation(angles or None, offset, tilt)
