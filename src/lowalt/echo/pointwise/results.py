"""Results of the pointwise kernel for a whole sample: the strongest cell's signal, all cells, or the subcarriers.

The strongest cell is the arg max over all M cells; a bound excludes those that are not computed.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.echo.pointwise.arg_max import NEAR_TIE, strongest_of
from lowalt.echo.pointwise.reference_range import CELL
from lowalt.echo.pointwise.terms import PointTerms, cell_phase, cell_sum, terms
from lowalt.machine.jit import PLAIN


class Paths(NamedTuple):
    """Extra delays (s) and complex gains of all paths, each (K, N or 1, L or 1); K = 0: the direct path alone."""

    delays: np.ndarray
    gains: np.ndarray


@PLAIN
def far_bound(z, u, low, high, count):
    """Return an upper bound of |sum| in any cell outside low..high (from the reference's).

    With c = z sin(pi u) a far cell is sum c g(j - u), g(x) = 1 / (M sin(pi x / M)). It is expanded to second order
    about the middle of the points; the remainder is bounded by the largest |g''|, which falls with distance.
    """
    least, most = u.min(), u.max()
    middle, half = 0.5 * (least + most), 0.5 * (most - least)
    distance = min(high + 1 - middle, middle - (low - 1), 0.5 * count)
    if distance - half <= 0.0:
        return np.inf
    c0, c1, a2, total = 0.0j, 0.0j, 0.0, 0.0
    for l in range(len(z)):  # noqa: E741
        y = u[l] - middle
        c = z[l] * math.sin(math.pi * (u[l] - np.rint(u[l])))
        c *= -1.0 if int(np.rint(u[l])) & 1 else 1.0
        c0 += c
        c1 += c * y
        a2 += abs(c) * y * y
        total += abs(z[l])
    step = math.pi / count
    s, k = math.sin(step * distance), math.cos(step * distance)
    near = math.sin(step * (distance - half))
    bound = abs(c0) / s + abs(c1) * step * abs(k) / (s * s) + 0.5 * a2 * 2.0 * step * step / near**3
    return bound / count * (1.0 + 1e-9) + 1e-14 * total


@PLAIN
def strongest(z, u, base, count, sums):
    """Return (value, cell, near-tie, lead) of one symbol's strongest cell.

    lead: its |sum| minus any other, ignoring rounding; base: the reference's cell; sums (M, 2): work array.
    """
    low, high = math.floor(u.min()), math.ceil(u.max())
    far = 0.0
    for grow in range(3):
        if grow == 1:
            low, high = low - 8, high + 8
        if grow == 2 or high - low + 1 >= count:
            low, high = -base % count, -base % count + count - 1
        for j in range(low, high + 1):
            there = cell_sum(z, u, j, count)
            sums[j - low, 0], sums[j - low, 1] = there.real, there.imag
        best, second, which = strongest_of(sums, 0, high - low)
        far = 0.0 if high - low + 1 >= count else far_bound(z, u, low, high, count)
        if far < best * (1.0 - NEAR_TIE):
            break
    tie = best - second <= NEAR_TIE * best and count > 1
    value = complex(sums[which, 0], sums[which, 1]) * cell_phase(base + low + which, count)
    return value, (base + low + which) % count, tie, best - max(second, far)


@PLAIN
def room(scene, paths):
    """Return empty `PointTerms` for the points of a scene over all paths."""
    count = scene.translation.shape[1] if scene.rotation.shape[0] == 0 else len(scene.points)
    size = count * max(1, paths.delays.shape[0])
    return PointTerms(np.empty((count, 3)), np.empty(size, np.complex128), np.empty(size), np.empty(size))


@PLAIN
def symbol(scene, radar, ref, n, aims, paths, out):
    """Fill `out` (`PointTerms`) for symbol n with all paths; returns 1 + l for a point in the station, else 0."""
    e, z, u, risk = out
    count = len(e)
    fault = terms(scene, radar, ref, n, aims, out)
    path_count = paths.delays.shape[0]
    if fault or path_count == 0:
        return fault
    # Go through the paths in reverse: the first L entries hold the direct path, which all others need.
    for k in range(path_count - 1, -1, -1):
        for l in range(count):  # noqa: E741
            delay = paths.delays[k, n % paths.delays.shape[1], l % paths.delays.shape[2]]
            gain = paths.gains[k, n % paths.gains.shape[1], l % paths.gains.shape[2]]
            turn = radar.centre_hz * delay
            turn -= np.rint(turn)
            later = complex(math.cos(2.0 * math.pi * turn), -math.sin(2.0 * math.pi * turn))
            z[k * count + l], u[k * count + l] = z[l] * gain * later, u[l] + radar.bandwidth_hz * delay
            risk[k * count + l] = risk[l] * abs(gain)
    return 0


@PLAIN
def signal(scene, radar, refs, symbols, aims, paths, found, risks):
    """Fill `found` (`refine.Found`) and risks (N,) at `symbols`, indices of refs; gaps without roundings.

    Returns 0, or n L + l + 1 where point l stands in the station at symbol n.
    """
    points, sums = room(scene, paths), np.empty((radar.subcarriers, 2))
    for n in symbols:
        fault = symbol(scene, radar, refs[n], n, aims, paths, points)
        if fault:
            return n * len(points.e) + fault
        base = int(refs[n, CELL])
        answer = strongest(points.z, points.u, base, radar.subcarriers, sums)
        found.values[n], found.cells[n], found.ties[n], found.gaps[n] = answer
        found.totals[n], risks[n] = np.abs(points.z).sum(), points.risk.sum()
    return 0


@PLAIN
def matrix(scene, radar, refs, aims, paths, cells, out):
    """Fill out (N, M) with all range cells, or with subcarriers where `cells` is false; returns as `signal`."""
    points, total = room(scene, paths), radar.subcarriers
    z, u = points.z, points.u
    for n in range(len(refs)):
        fault = symbol(scene, radar, refs[n], n, aims, paths, points)
        if fault:
            return n * len(points.e) + fault
        base = int(refs[n, CELL])
        if cells:
            for j in range(total):
                out[n, (base + j) % total] = cell_sum(z, u, j, total) * cell_phase(base + j, total)
            continue
        for m in range(total):
            # Phase of subcarrier m relative to the effective carrier; the share of whole cells is reduced in integers.
            whole = (((2 * m - (total - 1)) * (base % (2 * total))) % (2 * total)) / (2.0 * total)
            value = 0.0j
            for l in range(len(z)):  # noqa: E741
                turn = (m - 0.5 * (total - 1)) / total * u[l] + whole
                turn -= np.rint(turn)
                value += z[l] * complex(math.cos(2.0 * math.pi * turn), -math.sin(2.0 * math.pi * turn))
            out[n, m] = value
    return 0
