"""A limb of two bones from a fixed joint to a moving point, as in walkers on four legs and in cyclists.

Axes: x right, y front, z up, metres; positions, not angles, since the paths of the feet are known.
"""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable


def both_sides(start: str, *limb: str) -> list[tuple[str, ...]]:
    """Return the names of the nodes of a right and a left limb that both begin at the node `start`."""
    return [(start, *(f"{side} {name}" for name in limb)) for side in ("right", "left")]


def joint(start: np.ndarray, end: np.ndarray, upper_m: float, lower_m: float, bend: float) -> np.ndarray:
    """Return where two bones meet (F, 3) that reach from `start` (F, 3) to `end` (F, 3), in a plane along y and z.

    upper_m, lower_m: lengths of the bones; bend: 1 where the joint points to the front, -1 to the back.
    Raises: InputError where the end is farther away than both bones reach, or too near.
    Source: law of cosines.
    """
    way = end - start
    flat = np.sqrt(way[:, 1] ** 2 + way[:, 2] ** 2)
    if not ((flat < upper_m + lower_m).all() and (flat > abs(upper_m - lower_m)).all()):
        raise InputError(
            f"limb: ends are {flat.min():.3g} to {flat.max():.3g} m apart, expected what bones of {upper_m:.3g} and "
            f"{lower_m:.3g} m reach"
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
    """Return points (F, 3) of a circle about x that turns as a wheel does which rolls to the front: up, front, down.

    turns (F,): angle in turns, 0 at the top.
    """
    sine, cosine = portable.sine_cosine_turns(turns)
    return radius_m * np.stack([np.zeros(len(turns)), sine, cosine], 1)
