"""Results of the pointwise kernel for a whole sample: the strongest cell's signal, or all cells.

The strongest cell is the arg max over all M cells; a bound excludes those that are not computed.
"""

import math

import numpy as np

from lowalt.echo.echo_input import EchoInput
from lowalt.echo.fast.workspace import Found
from lowalt.echo.pointwise.arg_max import NEAR_TIE, strongest_of
from lowalt.echo.pointwise.reference_range import CELL
from lowalt.echo.pointwise.terms import PointTerms, cell_phase, cell_sum, terms
from lowalt.echo.radar import Radar
from lowalt.machine.jit import PLAIN


@PLAIN
def far_bound(z, u, low, high, count):
    """Return an upper bound of |sum| in any cell outside low..high (from the reference's).

    With c = z sin(pi u) a far cell is sum c g(j - u), g(x) = 1 / (M sin(pi x / M)). It is expanded
    to second order about the middle of the points; the remainder is bounded by the largest |g''|,
    which falls with distance.
    """
    least = u.min()
    most = u.max()
    middle = 0.5 * (least + most)
    half = 0.5 * (most - least)
    distance = min(high + 1 - middle, middle - (low - 1), 0.5 * count)
    if distance - half <= 0.0:
        return np.inf
    c0 = 0.0j
    c1 = 0.0j
    a2 = 0.0
    total = 0.0
    for l in range(len(z)):  # noqa: E741
        y = u[l] - middle
        whole = np.rint(u[l])
        c = z[l] * math.sin(math.pi * (u[l] - whole))
        if int(whole) & 1:
            c = -c
        c0 += c
        c1 += c * y
        a2 += abs(c) * y * y
        total += abs(z[l])
    step = math.pi / count
    s = math.sin(step * distance)
    k = math.cos(step * distance)
    near = math.sin(step * (distance - half))
    bound = abs(c0) / s + abs(c1) * step * abs(k) / (s * s) + 0.5 * a2 * 2.0 * step * step / near**3
    return bound / count * (1.0 + 1e-9) + 1e-14 * total


@PLAIN
def strongest(z, u, base, count, sums):
    """Return (value, cell, near-tie, lead) of one symbol's strongest cell.

    lead: its |sum| minus any other, ignoring rounding; base: the reference's cell; sums (M, 2):
    work array.
    """
    low = math.floor(u.min())
    high = math.ceil(u.max())
    far = 0.0
    for grow in range(3):
        if grow == 1:
            low = low - 8
            high = high + 8
        if grow == 2 or high - low + 1 >= count:
            low = -base % count
            high = -base % count + count - 1
        for j in range(low, high + 1):
            there = cell_sum(z, u, j, count)
            sums[j - low, 0] = there.real
            sums[j - low, 1] = there.imag
        best, second, which = strongest_of(sums, 0, high - low)
        far = 0.0
        if high - low + 1 < count:
            far = far_bound(z, u, low, high, count)
        if far < best * (1.0 - NEAR_TIE):
            break
    tie = best - second <= NEAR_TIE * best and count > 1
    cell = base + low + which
    value = complex(sums[which, 0], sums[which, 1]) * cell_phase(cell, count)
    return value, cell % count, tie, best - max(second, far)


@PLAIN
def room(scene):
    """Return empty `PointTerms` for the points of a scene."""
    count = len(scene.points)
    if scene.rotation.shape[0] == 0:
        count = scene.translation.shape[1]
    return PointTerms(
        np.empty((count, 3)), np.empty(count, np.complex128), np.empty(count), np.empty(count)
    )


@PLAIN
def signal(scene, radar, refs, symbols, aims, found, risks):
    """Fill `found` and risks (N,) at `symbols`, indices of refs.

    found: `refine.Found`, whose gaps do not yet allow for roundings.

    Returns 0, or n L + l + 1 where point l stands in the station at symbol n.
    """
    points = room(scene)
    sums = np.empty((radar.subcarriers, 2))
    for n in symbols:
        fault = terms(scene, radar, refs[n], n, aims, points)
        if fault:
            return n * len(points.e) + fault
        base = int(refs[n, CELL])
        answer = strongest(points.z, points.u, base, radar.subcarriers, sums)
        found.values[n], found.cells[n], found.ties[n], found.gaps[n] = answer
        found.totals[n] = np.abs(points.z).sum()
        risks[n] = points.risk.sum()
    return 0


@PLAIN
def matrix(scene, radar, refs, aims, out):
    """Fill out (N, M) with all range cells, each by the closed form; returns as `signal`."""
    points = room(scene)
    total = radar.subcarriers
    for n in range(len(refs)):
        fault = terms(scene, radar, refs[n], n, aims, points)
        if fault:
            return n * len(points.e) + fault
        base = int(refs[n, CELL])
        for j in range(total):
            cell = base + j
            value = cell_sum(points.z, points.u, j, total)
            out[n, cell % total] = value * cell_phase(cell, total)
    return 0


def bounded(
    scene: EchoInput,
    radar: Radar,
    refs: np.ndarray,
    symbols: np.ndarray,
    aims: tuple[float, float],
    pointwise_bound: tuple[float, float],
    found: Found,
) -> int:
    """Fill `found` at `symbols` as `signal` does, with error bounds and gaps that allow for them.

    Returns as `signal`.

    pointwise_bound: `refine.Method.pointwise_bound`.
    """
    risks = np.zeros(len(refs))
    fault = signal(scene, radar, refs, symbols, aims, found, risks)
    share, direction = pointwise_bound
    found.bounds[symbols] = found.totals[symbols] * share + risks[symbols] * direction
    found.gaps[symbols] = np.maximum(found.gaps[symbols] - 2 * found.bounds[symbols], 0.0)
    return fault
