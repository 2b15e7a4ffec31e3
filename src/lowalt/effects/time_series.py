"""A target's response within its symbols as a series of Chebyshev polynomials in time, of the orders that matter.

Points move by a fraction of a wavelength while a symbol lasts. So the moments of their ranges at a few instants give
moments for each order in time, and only these few become subcarriers: one transform an order, not one an instant.
"""

from collections.abc import Sequence

import numpy as np

from lowalt.echo import Rigid
from lowalt.effects import interpolation, response_tables, time_series_loops, transforms
from lowalt.effects.response import OneWayFactors
from lowalt.effects.steering import SameSymbols, Steered
from lowalt.effects.view import View

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


def alone(view: View, lit: np.ndarray | None, on: frozenset[str]) -> bool:
    """Return whether `arrived` gives an echo on the direct path: steady beams, equal arrays, all points, no prefix."""
    network, fixed = view.network, lit is None and not view.turning and view.station.transmitter is None
    symmetric = network.transmit == network.receive and network.subcarriers == transforms.LENGTH
    return fixed and symmetric and not on & {"wavefront", "cyclic_prefix"}


def arrived(
    view: View, delays_s: np.ndarray, data: np.ndarray, factor: np.ndarray | float, allowed: float, farther_m: float,
    **asked,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return response (N, M) and samples (N, M) as `arrivals.arriving` does, for an echo that is `alone`.

    delays_s: (Q,) s after a symbol's beginning, its Chebyshev points; data: (N, M) on the air; factor: (N or 1, L) on
    the points' amplitudes; allowed: largest error of orders left out (units of amplitudes); farther_m: as in
    `steering.SameSymbols`; asked: `squint` and `error` of `steering.Steered`.
    """
    count, symbols = len(delays_s), len(view.times_s)
    every = view.at((view.times_s + delays_s[:, None]).ravel())
    motion = every.motion
    first = Steered(every.at_symbols(slice(0, symbols)), span=SameSymbols([], farther_m), **asked)
    rays, paired = first.beams[0][2], first.paired(factor)[0]
    planes, functions = moments(rays, motion, count, paired[0]), rays.functions(rays.frames[0][1])
    sizes = np.empty((count, len(functions)))
    time_series_loops.largest(planes, sizes)
    used = numbers(sizes * abs(functions).max(axis=1), allowed)
    shapes = interpolation.polynomials(len(used), interpolation.samples(data.shape[1])) / data.shape[1]
    still, samples = np.empty((2, *data.shape), np.complex128)
    time_series_loops.arrived(
        planes[: len(used)], used, functions, *rays.delays(0), data, shapes, transforms.table(),
        np.empty((14, data.shape[1] // 2)), np.empty((8, data.shape[1])), still, samples,
    )  # fmt: skip
    return still, samples


def moments(rays: OneWayFactors, motion: Rigid, count: int, strength: np.ndarray) -> np.ndarray:
    """Return the moments (K, N, 2, P) of each order in time of an echo on the direct path alone.

    rays: at the first of the symbols' K = `count` Chebyshev points; motion: poses (K N, ...) at all of them, the first
    of all symbols first; strength: (N or 1, L), as `paired` gives it.
    """
    _, reach = frame = rays.frames[0]
    matrix, symbols, nodes = interpolation.coefficients(count), len(rays.refs), len(rays.nodes)
    orders = len(response_tables.table(reach, rays.radio.subcarriers, rays.rest))
    found = np.empty((count, symbols, 2, nodes, orders))
    rays.direct.moments_in_time(motion, matrix, rays.asked, strength, frame, 0.5 * rays.radio.cells, found)
    planes = found.reshape(2 * symbols * count, -1)
    if nodes > 1:
        planes = planes @ rays.joined(reach)[0]
    return planes.reshape(count, symbols, 2, -1)


def numbers(sizes: np.ndarray, allowed: float) -> np.ndarray:
    """Return how many moments of each order in time matter, one order at least: those left out sum to <= `allowed`.

    sizes: (K, P), bounds of what any subcarrier owes to each moment. Whole orders are left out as in `kept`; the others
    share what is left, all but order zero, which is the largest.
    """
    # What the moments of each order from the p-th on sum to, and all orders from the k-th on.
    tails = sizes[:, ::-1].cumsum(axis=1)[:, ::-1]
    behind = np.append(tails[::-1, 0].cumsum()[::-1], 0.0)
    orders = max(int((behind > allowed).sum()), 1)
    share = (allowed - behind[orders]) / max(orders - 1, 1)
    return np.append(sizes.shape[1], (tails[1:orders] > share).sum(axis=1))
