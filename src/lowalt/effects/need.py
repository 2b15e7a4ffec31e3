"""Physics by need: which of the effects beyond Eq. 7 can be left out of a sample, decided by bounds.

A bound is relative to the sum of amplitudes, which is known beforehand; a tolerance is relative to the sample's largest
value. So the chain first computes without the effects, then compares the bounds, and computes those that do not fit.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.echo.radar import radar
from lowalt.effects.view import View


class Decision(NamedTuple):
    """A decision on one effect; `bound` is relative to the sample's largest value, inf where it is unknown."""

    name: str
    bound: float
    computed: bool
    reason: str


def part_amplitudes(view: View) -> np.ndarray:
    """Return a bound (N, P) of the sum of each part's amplitudes with all elements in phase, from its nearest range."""
    radio = radar(view.network, view.station)
    peak = float(np.prod(view.network.transmit) * np.prod(view.network.receive))
    roots = np.bincount(view.cloud.part, np.sqrt(view.cloud.rcs_m2), len(view.cloud.kinds))
    with np.errstate(divide="ignore"):
        return radio.scale * peak * roots / view.nearest_m() ** 2


def leave_out(bounds: dict[str, float], tolerance: float | None, largest: float) -> tuple[list[str], float]:
    """Return the effects that can be left out together, and the sum of their bounds.

    bounds: largest change of any range cell by each effect (same units as `largest`, the sample's largest value
    computed without any of them); tolerance: relative to the true largest value, which is at least `largest` minus the
    sum of all bounds. The smallest bounds are left out first.
    """
    if tolerance is None:
        return [], 0.0
    room = tolerance * (largest - sum(bounds.values()))
    left, spent = [], 0.0
    for name in sorted(bounds, key=bounds.__getitem__):
        if spent + bounds[name] <= room:
            left.append(name)
            spent += bounds[name]
    return left, spent


def decisions(
    asked: list[str], bounds: dict[str, float], left: list[str], tolerance: float | None, largest: float
) -> list[Decision]:
    """Return the decisions in words and numbers; arguments as in `leave_out`."""
    result = []
    for name in asked:
        share = bounds.get(name, math.inf) / largest if largest > 0 else math.inf
        if tolerance is None:
            why = "no tolerance: always computed"
        elif name in left:
            why = f"its bound fits the tolerance {tolerance:g}"
        elif math.isinf(share):
            why = "nothing bounds its change in this scene"
        else:
            why = f"its bound exceeds what the tolerance {tolerance:g} leaves"
        result.append(Decision(name, share, name not in left, why))
    return result


def gap(size: np.ndarray) -> np.ndarray:
    """Return how much the largest magnitude of each symbol (N, M) exceeds the second, (N,); inf for a single cell."""
    if size.shape[1] < 2:
        return np.full(len(size), np.inf)
    top = np.partition(size, -2, axis=1)[:, -2:]
    return top[:, 1] - top[:, 0]
