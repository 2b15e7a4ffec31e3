"""The fast kernel's driver: segments of symbols, tiles of points, certified strongest cells.

All smooth factors are the plan's polynomials; `lanes` holds the loops.
"""

import math

import numpy as np
from numba import njit

from lowalt.echo import lanes
from lowalt.echo.answers import NEAR_TIE
from lowalt.echo.fits import TOP, degree_for, economised, tail
from lowalt.echo.spans import CELL, SIZE, SPREAD
from lowalt.echo.terms import cell_phase

WIDEST = 6
"""Most cells a segment's window may have."""
RING = 8
"""Cells added on either side where the bound cannot yet decide."""
H, V, SINE, FIRST = 0, 1, 2, 3
"""Rows of a segment's coefficients: horizontal and vertical gain, sin(pi u), then the window's cells."""
FINE, AGAIN = 0, 1
"""State of a symbol: done, or to be computed again with the finest plan or the general kernel."""


@njit(cache=True)
def fit_segment(segment, aims, rules, error, base, fold, coefficients, degrees):
    """Fit a segment's polynomials to `error`; returns (number of cells, first cell, bound of gains, of cells).

    rules: weights and rates of the horizontal and vertical gain and the cell kernel. The number of cells is 0 where
    a polynomial would be too long or the window too wide.
    """
    wh, rh, wv, rv, wk, rk = rules
    half = segment[7]
    low, high = math.floor(segment[6] - base - half), math.ceil(segment[6] - base + half)
    cells = high - low + 1
    bands = (rh[0] * segment[3], rv[0] * segment[5], math.pi * half)
    if cells > WIDEST or half > 1.25:
        return 0, 0, 0.0, 0.0
    for row in range(3):
        degrees[row] = degree_for(bands[row], error)
        if degrees[row] > TOP:
            return 0, 0, 0.0, 0.0
    economised(wh, rh, 0.0, segment[2] - aims[0], segment[3], degrees[H], fold, coefficients[H])
    economised(wv, rv, 0.0, segment[4] - aims[1], segment[5], degrees[V], fold, coefficients[V])
    one = np.ones(1)
    middle = segment[6] - base
    economised(one, math.pi * one, -0.5 * math.pi, middle, half, degrees[SINE], fold, coefficients[SINE])
    for cell in range(cells):
        degrees[FIRST + cell] = degrees[SINE]
        economised(wk, rk, 0.0, middle - low - cell, half, degrees[SINE], fold, coefficients[FIRST + cell])
    return cells, low, tail(bands[0], degrees[H]) + tail(bands[1], degrees[V]), tail(bands[2], degrees[SINE])


@njit(cache=True)
def far_limit(c0, c1, a2, distance, reach, count):
    """Bound of |sum| in every cell at least `distance` from the expansion's centre; see `answers.far_bound`."""
    if distance - reach <= 0.0:
        return np.inf
    step = math.pi / count
    s, k = math.sin(step * distance), math.cos(step * distance)
    near = math.sin(step * (distance - reach))
    return (c0 / s + c1 * step * abs(k) / (s * s) + a2 * step * step / near**3) / count


@njit(cache=True)
def fill_tile(scene, lay, radar, r, n, first, size, at, m, work):
    """Put points first..first + size of symbol n into the tile from `at`: offsets from the reference, per r_ref."""
    ex, ey, ez = work[0], work[1], work[2]
    scale = 1.0 / r
    sine, cosine = radar.sine, radar.cosine
    count = len(lay.x) if scene.rotation.shape[0] else scene.translation.shape[1]
    end = min(first + size, count)
    if scene.rotation.shape[0] == 0:
        p0 = scene.translation[n, 0]
        for l in range(first, end):  # noqa: E741
            x, y = scene.translation[n, l, 0] - p0[0], scene.translation[n, l, 1] - p0[1]
            i = at + l - first
            ex[i] = (cosine * x + sine * y) * scale
            ey[i] = (cosine * y - sine * x) * scale
            ez[i] = (scene.translation[n, l, 2] - p0[2]) * scale
    else:
        origin = scene.translation[n, scene.part[0]]
        for run in range(len(lay.parts)):
            low, high = lay.starts[run], lay.starts[run + 1]
            if low < first or low >= end:
                continue
            p = lay.parts[run]
            for j in range(3):
                x, y = scene.rotation[n, p, 0, j], scene.rotation[n, p, 1, j]
                m[j] = (cosine * x + sine * y) * scale
                m[3 + j] = (cosine * y - sine * x) * scale
                m[6 + j] = scene.rotation[n, p, 2, j] * scale
            x, y = scene.translation[n, p, 0] - origin[0], scene.translation[n, p, 1] - origin[1]
            m[9] = (cosine * x + sine * y) * scale
            m[10] = (cosine * y - sine * x) * scale
            m[11] = (scene.translation[n, p, 2] - origin[2]) * scale
            lanes.place_part(lay.x, lay.y, lay.z, low, high, m, at + low - first, ex, ey, ez)
    for i in range(at + end - first, at + size):
        ex[i], ey[i], ez[i] = 0.0, 0.0, 0.0


@njit(cache=True)
def constants(radar, ref, segment, aims, base, k):
    """Fill k with the symbol's constants for `lanes.arguments`."""
    r = ref[3]
    hx = (radar.cosine * ref[0] + radar.sine * ref[1]) / r
    hy = (radar.cosine * ref[1] - radar.sine * ref[0]) / r
    hz = ref[2] / r
    phase_h = radar.kappa / 4.0 * (radar.transmit_h + radar.receive_h - 2)
    phase_v = radar.kappa / 4.0 * (radar.transmit_v + radar.receive_v - 2)
    k[0], k[1] = hy, hz
    k[2], k[3] = 1.0 / segment[3], segment[2] / segment[3]
    k[4], k[5] = 1.0 / segment[5], segment[4] / segment[5]
    k[6] = r * radar.cells / segment[7]
    k[7] = ((ref[5] - base) + ref[6] - (segment[6] - base)) / segment[7]
    k[8] = -r * radar.turns
    k[9], k[10] = phase_h * segment[3], phase_v * segment[5]
    fixed = phase_h * (segment[2] - aims[0]) + phase_v * (segment[4] - aims[1]) - ref[4]
    k[11] = fixed - np.rint(fixed)
    k[12] = 1.0 / (r * r)
    k[13], k[14], k[15] = 2.0 * hx, 2.0 * hy, 2.0 * hz


@njit(cache=True)
def waves_of_tile(size, cosine, sine, coefficients, degrees, small):
    """Turn arguments into waves: gains, sine and cosine of the phase, their product with the amplitudes."""
    psi, omega, u, turn, amp = small[0], small[1], small[2], small[3], small[4]
    lanes.horner(psi, coefficients[H], degrees[H], small[5], size)
    lanes.horner(omega, coefficients[V], degrees[V], small[6], size)
    lanes.squares(size, turn, small[7])
    lanes.horner(small[7], cosine, len(cosine) - 1, small[8], size)
    lanes.horner(small[7], sine, len(sine) - 1, small[9], size)
    lanes.waves(size, amp, small[5], small[6], small[8], small[9], turn, small[0], small[1])
    lanes.horner(u, coefficients[SINE], degrees[SINE], small[5], size)


@njit(cache=True)
def near_cells(place, deep, window):
    """Cells first..last of the window that can well be a symbol's strongest; the bound looks after the others."""
    margin = 0.6 + min(0.6, deep)
    first, last = math.ceil(place - margin), math.floor(place + margin)
    return max(0, min(first, window - 1)), max(0, min(last, window - 1))


@njit(cache=True)
def rank(sums, lowest, highest):
    """Largest and second largest |sum| of the cells lowest..highest, and the place of the largest."""
    best, second, which = -1.0, -1.0, lowest
    for cell in range(lowest, highest + 1):
        strength = abs(sums[cell])
        if strength > best:
            best, second, which = strength, best, cell
        elif strength > second:
            second = strength
    return best, second, which


@njit(cache=True)
def one_cell(cell, at, size, typed, degrees, small):
    """Sum of one symbol's points in one cell of the window."""
    weight = small[6][at : at + size]
    lanes.horner(small[2][at : at + size], typed[FIRST + cell], degrees[FIRST + cell], weight, size)
    re, im = lanes.weigh(0, size, weight, small[0][at : at + size], small[1][at : at + size])
    return complex(re, im)


@njit(cache=True)
def certify(place, deep, c0, c1, total, bound, sums, first, last, window, at, size, typed, degrees, small, shape):
    """Strongest cell of one symbol: (state, place in `sums`, near-tie, close call), more cells as the bound asks.

    sums: (RING + WIDEST + RING,), the window's cells from RING on. shape: (count, half-width, centre) of the cells.
    """
    count, half, centre = int(shape[0]), shape[1], shape[2]
    lowest, highest = first + RING, last + RING
    for grow in range(3):
        if grow == 1:
            for cell in range(window):
                if cell < first or cell > last:
                    sums[RING + cell] = one_cell(cell, at, size, typed, degrees, small)
            lowest, highest = RING, RING + window - 1
        if grow == 2:
            if count < 3 * RING + WIDEST:
                break
            for j in range(1, RING + 1):
                for cell in (-j, window - 1 + j):
                    re, im = lanes.distant_cell(at, size, cell, half, centre, count, small[5], small[2], small[0], small[1])
                    # sin(pi (cell - u)) against sin(pi u).
                    sums[RING + cell] = complex(re, im) * (1.0 if cell & 1 else -1.0)
            lowest, highest = 0, 2 * RING + window - 1
        best, second, which = rank(sums, lowest, highest)
        gap = min(place - (lowest - 1 - RING), highest + 1 - RING - place, 0.5 * count)
        far = far_limit(c0, c1, total * deep * deep, gap, deep, count)
        if far + bound < best * (1.0 - NEAR_TIE) - bound:
            return FINE, which, best - second <= NEAR_TIE * best, second >= best - 2.0 * bound
        if size == 0:
            break
    return AGAIN, 0, False, True


@njit(cache=True)
def run(scene, lay, radar, refs, span, segs, symbols, aims, rules, fits, fold, plan, work, small, out):
    """Compute the symbols of all segments.

    symbols: indices that refs, span and segs are cut from; fits: polynomials of inverse, excess (float64), cosine and
    sine (the tile's type); plan: error of the segments' fits, slack relative to the sum of amplitudes and to the sum
    of peak amplitudes, 1 where close calls are final; out: values, cells, state, totals, bounds, ties, each (N,).
    """
    inverse, excess, cosine, sine = fits
    values, cells, state, totals, bounds, ties = out
    padded = len(lay.amplitude)
    together = max(1, lanes.TILE // padded)
    chunk = min(padded, lanes.TILE)
    m, k = np.empty(12), np.empty((together, 16))
    sums = np.empty((together, WIDEST + 2 * RING), np.complex128)
    more = np.empty((together, 2), np.complex128)
    weights = np.empty(together)
    coefficients = np.empty((FIRST + WIDEST, TOP + 1))
    typed = np.empty((FIRST + WIDEST, TOP + 1), small.dtype)
    degrees = np.empty(FIRST + WIDEST, np.int64)
    for index in range(len(segs)):
        segment = segs[index]
        start, end = int(segment[0]), int(segment[1])
        base = np.rint(segment[6])
        fitted = fit_segment(segment, aims, rules, plan[0], base, fold, coefficients, degrees)
        window, low = fitted[0], fitted[1]
        if window == 0 or window >= radar.subcarriers:
            for i in range(start, end):
                state[symbols[i]] = AGAIN
            continue
        base += low
        for row in range(FIRST + window):
            for j in range(degrees[row] + 1):
                typed[row, j] = coefficients[row, j]
        if chunk < padded:
            first, last = 0, window - 1
        for i in range(start, end, together):
            many = min(together, end - i)
            if chunk == padded:
                first, last = window, -1
            for s in range(many):
                constants(radar, refs[i + s], segment, aims, base - low, k[s])
                a, b = near_cells(span[i + s, CELL] - base, span[i + s, SIZE] * radar.cells, window)
                first, last = min(first, a), max(last, b)
                weights[s] = 0.0
            sums[:] = 0.0
            more[:] = 0.0
            for point in range(0, padded, chunk):
                size = min(chunk, padded - point)
                tile_terms(scene, lay, radar, refs, symbols, i, many, point, size, k, m, inverse, excess, work, small)
                waves_of_tile(many * size, cosine, sine, typed, degrees, small)
                for cell in range(first, last + 1):
                    lanes.horner(small[2], typed[FIRST + cell], degrees[FIRST + cell], small[6], many * size)
                    for s in range(many):
                        re, im = lanes.weigh(s * size, size, small[6], small[0], small[1])
                        sums[s, RING + cell] += complex(re, im)
                for s in range(many):
                    a, b, c, d, e = lanes.far_sums(s * size, size, small[5], small[2], small[0], small[1], small[4])
                    more[s, 0] += complex(a, b)
                    more[s, 1] += complex(c, d)
                    weights[s] += e
            for s in range(many):
                n, total = symbols[i + s], weights[s]
                peaks = lay.total * k[s, 12] / (1.0 - span[i + s, SPREAD]) ** 2
                bound = total * (plan[1] + fitted[3]) + peaks * (plan[2] + fitted[2])
                totals[n], bounds[n] = total, bound
                place = span[i + s, CELL] - base
                c1 = abs(more[s, 1] * segment[7] + more[s, 0] * (segment[6] - base - place))
                state[n], which, ties[n], close = certify(
                    place, span[i + s, SIZE] * radar.cells, abs(more[s, 0]), c1, total, bound, sums[s], first, last,
                    window, s * size, size if chunk == padded else 0, typed, degrees, small,
                    (radar.subcarriers, segment[7], segment[6] - base),
                )  # fmt: skip
                if close and plan[3] == 0.0:
                    state[n] = AGAIN
                if state[n] == FINE:
                    cell = int(base) + which - RING
                    values[n] = sums[s, which] * cell_phase(cell, radar.subcarriers)
                    cells[n] = cell % radar.subcarriers


@njit(cache=True)
def tile_terms(scene, lay, radar, refs, symbols, i, many, first, size, k, m, inverse, excess, work, small):
    """Fill the tile's arguments for `many` symbols from list place i on."""
    for s in range(many):
        n = symbols[i + s]
        fill_tile(scene, lay, radar, refs[i + s, 3], n, first, size, s * size, m, work)
        lanes.relative_excess(work[0], work[1], work[2], s * size, size, k[s, 13], k[s, 14], k[s, 15], work[3])
    lanes.horner(work[3], inverse, len(inverse) - 1, work[4], many * size)
    lanes.horner(work[3], excess, len(excess) - 1, work[5], many * size)
    for s in range(many):
        lanes.arguments(
            s * size, size, k[s], work[3], work[4], work[5], work[1], work[2], lay.amplitude, first,
            small[0], small[1], small[2], small[3], small[4],
        )  # fmt: skip
