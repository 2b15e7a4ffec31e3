"""The kernel's three answers for a whole sample: the strongest cell's signal, all cells, the subcarriers.

The strongest cell is the arg max over all M cells: cells that are not computed are excluded by a bound.
"""

import math

import numpy as np

from lowalt.common.jit import PLAIN
from lowalt.echo.pointwise.terms import cell_phase, cell_sum, terms

NEAR_TIE = 1e-12
"""Relative gap below which the two strongest cells count as a near-tie."""


@PLAIN
def far_bound(z, u, low, high, count):
    """Upper bound of |sum| over all cells outside low..high (relative to ref's cell), without computing any.

    With c = z sin(pi u) a far cell is sum c g(j - u), g(x) = 1 / (M sin(pi x / M)): expanded to second order about
    the middle of the points, the remainder bounded by the largest |g''|, which falls with distance.
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
def strongest(z, u, base, count):
    """Arg max over all cells of one symbol: (value, cell, near-tie, lead over every other cell but for rounding)."""
    low, high = math.floor(u.min()), math.ceil(u.max())
    far = 0.0
    for grow in range(3):
        if grow == 1:
            low, high = low - 8, high + 8
        if grow == 2 or high - low + 1 >= count:
            low, high = -base % count, -base % count + count - 1
        best, second, value, cell = -1.0, -1.0, 0.0j, 0
        for j in range(low, high + 1):
            there = cell_sum(z, u, j, count)
            size = abs(there)
            index = (base + j) % count
            if size > best or (size == best and index < cell):
                second, best, value, cell = best, size, there * cell_phase(base + j, count), index
            elif size > second:
                second = size
        far = 0.0 if high - low + 1 >= count else far_bound(z, u, low, high, count)
        if far < best * (1.0 - NEAR_TIE):
            break
    tie = best - second <= NEAR_TIE * best and count > 1
    return value, cell, tie, best - max(second, far)


@PLAIN
def shift(z, u, l, radar, delay, gain):  # noqa: E741
    """Amplitude and range in cells of one point by a path `delay` (s) longer and `gain` times as strong."""
    turn = radar.centre_hz * delay
    turn -= np.rint(turn)
    later = complex(math.cos(2.0 * math.pi * turn), -math.sin(2.0 * math.pi * turn))
    return z[l] * gain * later, u[l] + radar.bandwidth_hz * delay


@PLAIN
def symbol(scene, radar, ref, n, aims, delays, gains, e, z, u, risk):
    """Fill z, u, risk (L or L * paths) of symbol n with all paths; returns 1 + l for a point in the station, else 0."""
    count = len(e)
    fault = terms(scene, radar, ref, n, aims[0], aims[1], e, z[:count], u[:count], risk[:count])
    paths = delays.shape[0]
    if fault or paths == 0:
        return fault
    # Backwards, since the first L entries hold the direct path that the others are made from.
    for k in range(paths - 1, -1, -1):
        for l in range(count):  # noqa: E741
            delay = delays[k, n % delays.shape[1], l % delays.shape[2]]
            gain = gains[k, n % gains.shape[1], l % gains.shape[2]]
            z[k * count + l], u[k * count + l] = shift(z, u, l, radar, delay, gain)
            risk[k * count + l] = risk[l] * abs(gain)
    return 0


@PLAIN
def signal(scene, radar, refs, symbols, aims, delays, gains, values, cells, ties, totals, gaps, risks):
    """Fill values, cells, ties, leads, sums of |amplitude| and risk at `symbols`; returns 0, or n L + l + 1, r = 0."""
    count = scene.translation.shape[1] if scene.rotation.shape[0] == 0 else len(scene.points)
    size = count * max(1, delays.shape[0])
    e, z, u, risk = np.empty((count, 3)), np.empty(size, np.complex128), np.empty(size), np.empty(size)
    for n in symbols:
        fault = symbol(scene, radar, refs[n], n, aims, delays, gains, e, z, u, risk)
        if fault:
            return n * count + fault
        values[n], cells[n], ties[n], gaps[n] = strongest(z, u, int(refs[n, 5]), radar.subcarriers)
        totals[n], risks[n] = np.abs(z).sum(), risk.sum()
    return 0


@PLAIN
def matrix(scene, radar, refs, aims, delays, gains, cells, out):
    """Fill out (N, M) with all range cells, or with subcarriers where `cells` is false; result as `signal`."""
    count = scene.translation.shape[1] if scene.rotation.shape[0] == 0 else len(scene.points)
    size = count * max(1, delays.shape[0])
    total = radar.subcarriers
    e, z, u, risk = np.empty((count, 3)), np.empty(size, np.complex128), np.empty(size), np.empty(size)
    for n in range(len(refs)):
        fault = symbol(scene, radar, refs[n], n, aims, delays, gains, e, z, u, risk)
        if fault:
            return n * count + fault
        base = int(refs[n, 5])
        if cells:
            for j in range(total):
                out[n, (base + j) % total] = cell_sum(z, u, j, total) * cell_phase(base + j, total)
            continue
        for m in range(total):
            # Phase of subcarrier m against the effective carrier; the whole cells' share reduced in integers.
            whole = (((2 * m - (total - 1)) * (base % (2 * total))) % (2 * total)) / (2.0 * total)
            value = 0.0j
            for l in range(size):  # noqa: E741
                turn = (m - 0.5 * (total - 1)) / total * u[l] + whole
                turn -= np.rint(turn)
                value += z[l] * complex(math.cos(2.0 * math.pi * turn), -math.sin(2.0 * math.pi * turn))
            out[n, m] = value
    return 0
