"""Rotation angles from a rate and a time, and rotation matrices.

All of them have the same bits on every processor: sines and products are those of `pose_kernels`
and `portable`.
"""

import numpy as np

from lowalt.numerics.double_double import two_product
from lowalt.numerics.portable import product


def compiled():
    """Return the module of compiled functions.

    It is imported at the first call, so that other stages start without numba.
    """
    from lowalt.motion import pose_kernels

    return pose_kernels


def turns(rate_hz: float, times_s: np.ndarray) -> np.ndarray:
    """Return rate_hz * times_s (N,) minus the nearest whole number of turns, in [-1/2, 1/2].

    The product is a double-double, so the fraction keeps full precision after 10^6 turns.
    """
    product, error = two_product(rate_hz, times_s)
    return (product - np.rint(product)) + error


def rodrigues(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    """Return the matrices (N, 3, 3) that turn by `angle` (N,) rad about the unit `axis` (3,).

    Source: Rodrigues' rotation formula, paper Eq. 17.
    """
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    sine, cosine = compiled().sines_cosines(np.ascontiguousarray(angle, float))
    sine = sine[:, None, None]
    cosine = cosine[:, None, None]
    return cosine * np.eye(3) + sine * cross + (1.0 - cosine) * np.outer(axis, axis)


def attitude(yaw_rad: float, pitch_rad: float, roll_rad: float) -> np.ndarray:
    """Return R_Y(yaw) R_P(pitch) R_R(roll) (3, 3), turns about z, x and y.

    Source: paper Eq. 18.
    """
    angles = np.array([yaw_rad, pitch_rad, roll_rad], dtype=np.float64)
    (d, e, f), (a, b, c) = compiled().sines_cosines(angles)
    yaw = np.array([[a, -d, 0.0], [d, a, 0.0], [0.0, 0.0, 1.0]])
    pitch = np.array([[1.0, 0.0, 0.0], [0.0, b, -e], [0.0, e, b]])
    roll = np.array([[c, 0.0, f], [0.0, 1.0, 0.0], [-f, 0.0, c]])
    return product(product(yaw, pitch), roll)
