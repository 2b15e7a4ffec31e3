"""A target's response within its symbols as a series of Chebyshev polynomials in time, of the orders that matter.

Points move by a fraction of a wavelength while a symbol lasts. So the moments of their ranges at a few instants give
moments for each order in time, and only these few become subcarriers: one transform an order, not one an instant.
"""

from collections.abc import Sequence

import numpy as np

from lowalt.effects import interpolation
from lowalt.effects.steering import Steered

Moments = list[list[np.ndarray]]
"""Moments (N, 2, P) of a response: of every beam and every pair of paths, as `steering.Steered.moments` gives them."""


def orders(found: Sequence[Moments]) -> list[Moments]:
    """Return the moments of each order 0 .. Q-1 in time from those at the Q Chebyshev points of a symbol."""
    count = len(found)
    if count == 1:
        return list(found)
    matrix = interpolation.coefficients(count)
    whole = [
        [(matrix @ np.reshape(pair, (count, -1))).reshape(count, *pair[0].shape) for pair in zip(*beam, strict=True)]
        for beam in zip(*found, strict=True)
    ]
    return [[[planes[order] for planes in beam] for beam in whole] for order in range(count)]


def kept(series: Sequence[list[Moments]], rays: Steered, allowed: float) -> int:
    """Return how many orders in time matter, one at least: those left out change no range cell by more than `allowed`.

    series: the orders of each group of points, whose subcarriers `rays` gives. Chebyshev polynomials are at most 1, and
    data of unit modulus and the transforms keep the 2-norm, so a range cell changes by at most the largest subcarrier
    left out, or by up to twice as much where some of the samples carry another symbol.
    """
    count, spent = len(series[0]), 0.0
    while count > 1:
        spent += sum(rays.largest(groups[count - 1]) for groups in series)
        if spent > allowed:
            break
        count -= 1
    return count
