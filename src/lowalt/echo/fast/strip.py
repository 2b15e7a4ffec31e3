"""A strip: the points of one symbol that the fast kernel processes together.

Here are its arrays, constants and length.

The arrays of a strip fit into the first-level cache.
"""

from typing import NamedTuple

import numpy as np

from lowalt.machine.jit import LEAN

STRIP = 256
"""Largest number of points in a strip: a dozen arrays of 2 kB fit into the first-level cache."""
MULTIPLE = 16
"""Strips hold whole multiples of this many points; the padding has no amplitude."""
STRIP_ROOM = STRIP + MULTIPLE + 8
"""Length of a work array.

It is a strip plus room for a part's last group, which may write beyond it. It is not a power of
two, because with arrays a multiple of 4096 bytes apart loads wait for unrelated stores (4K
aliasing).
"""


class Placing(NamedTuple):
    """Constants that give a point's offset from the reference in the array's axes.

    twice_x, twice_y, twice_z: twice the unit vector to the reference; the others: how horizontal
    and vertical coordinates become direction cosines on [-1, 1] before the division by r.
    """

    twice_x: float
    twice_y: float
    twice_z: float
    y_scale: float
    y_shift: float
    z_scale: float
    z_shift: float


class Geometry(NamedTuple):
    """One symbol's constants.

    psi_shift, omega_shift: of the scaled direction cosines; cell_scale, cell_shift: take the
    relative range difference to [-1, 1]; turn_range, turn_psi, turn_omega: turns of phase per
    relative range difference, per psi and per omega; turn_start: the reference's turn.
    """

    psi_shift: float
    omega_shift: float
    cell_scale: float
    cell_shift: float
    turn_range: float
    turn_psi: float
    turn_omega: float
    turn_start: float


class Offsets(NamedTuple):
    """A strip's points in float64, (STRIP_ROOM,) each.

    eps: r^2 / r_ref^2 - 1; y, z: scaled horizontal and vertical coordinate.
    """

    eps: np.ndarray
    y: np.ndarray
    z: np.ndarray


class Strip(NamedTuple):
    """A strip's points in the type of the sums, (STRIP_ROOM,) each.

    psi, omega, cells: direction cosines and ranges on [-1, 1]; turn: on [-1/2, 1/2]; square: (r_ref
    / r)^2; gain_h, gain_v: array gains; real, imag: of the amplitudes.
    """

    psi: np.ndarray
    omega: np.ndarray
    cells: np.ndarray
    turn: np.ndarray
    square: np.ndarray
    gain_h: np.ndarray
    gain_v: np.ndarray
    real: np.ndarray
    imag: np.ndarray


@LEAN
def strip_size(points: int) -> int:
    """Return the number of points of a strip when a target has `points` (padded).

    Strips are equal shares of at most STRIP points and whole multiples of MULTIPLE.
    """
    shares = -(-points // STRIP)
    return -(-points // (shares * MULTIPLE)) * MULTIPLE
