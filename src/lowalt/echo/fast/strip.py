"""A strip: the points of one symbol that the fast kernel processes together. Its arrays, constants
and length.

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
"""Length of a work array: a strip plus room for a part's last group, which may write beyond it. It
is not a power of two, because with arrays a multiple of 4096 bytes apart loads wait for unrelated
stores (4K aliasing)."""


class Placing(NamedTuple):
    """Constants that place the points: twice the unit vector to the reference (array's axes), and
    how horizontal and vertical coordinates become direction cosines on [-1, 1] before the division
    by r."""

    twice_x: float
    twice_y: float
    twice_z: float
    y_scale: float
    y_shift: float
    z_scale: float
    z_shift: float


class Geometry(NamedTuple):
    """One symbol's constants: shifts of the scaled direction cosines psi and omega; scale and shift
    that take the relative range difference to [-1, 1]; turns of phase per relative range
    difference, per psi and per omega; the reference's turn."""

    psi_shift: float
    omega_shift: float
    cell_scale: float
    cell_shift: float
    turn_range: float
    turn_psi: float
    turn_omega: float
    turn_start: float


class Offsets(NamedTuple):
    """A strip's points in float64 (STRIP_ROOM,): eps = r^2 / r_ref^2 - 1, scaled horizontal and
    vertical coordinate.
    """

    eps: np.ndarray
    y: np.ndarray
    z: np.ndarray


class Strip(NamedTuple):
    """A strip's points in the type of the sums (STRIP_ROOM,): direction cosines and ranges on [-1,
    1], turns on [-1/2, 1/2], (r_ref / r)^2, array gains, and real and imaginary part of the
    amplitudes."""

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
    """Return the points of a strip when a target has `points` (padded): equal shares of at most
    STRIP, whole multiples of MULTIPLE."""
    shares = -(-points // STRIP)
    return -(-points // (shares * MULTIPLE)) * MULTIPLE
