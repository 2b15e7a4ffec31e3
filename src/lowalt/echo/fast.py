"""The fast kernel's driver: segments of symbols, tiles of points, certified strongest cells.

All smooth factors are the plan's polynomials; `lanes` holds the loops. Everything here is compiled without counted
references (`_nrt=False`): they took a quarter of the time. So nothing here may allocate; rooms come in as arguments.
"""

import math

import numpy as np

from lowalt.echo import lanes
from lowalt.echo.answers import NEAR_TIE
from lowalt.echo.compile import LEAN
from lowalt.echo.fits import TOP, degree_for, economised, tail
from lowalt.echo.spans import CELL, SIZE, SPREAD
from lowalt.echo.terms import cell_phase

WIDEST = 6
"""Most cells a segment's window may have."""
RING = 8
"""Cells added on either side where the bound cannot yet decide."""
FAR = 1e-4
"""Accuracy of sin(pi u), which only the bound on far cells uses; its error is part of that bound."""
H, V, SINE, FIRST = 0, 1, 2, 3
"""Rows of a segment's coefficients: horizontal and vertical gain, sin(pi u), then the window's cells."""
FINE, AGAIN = 0, 1
"""State of a symbol: done, or to be computed again with the finest plan or the general kernel."""


@LEAN
def fit_segment(segment, aims, rules, error, base, fold, room, coefficients, degrees):
    """Fit a segment's polynomials to `error`; returns (cells, first cell, bounds of gains, of cells, of sine).

    rules: weights and rates of the horizontal and vertical gain and the cell kernel. The number of cells is 0 where
    a polynomial would be too long or the window too wide.
    """
    wh, rh, wv, rv, wk, rk = rules
    half, middle = segment[7], segment[6] - base
    low, high = math.floor(middle - half), math.ceil(middle + half)
    cells = high - low + 1
    bands = (rh[0] * segment[3], rv[0] * segment[5], math.pi * half)
    if cells > WIDEST or half > 1.25:
        return 0, 0, 0.0, 0.0, 0.0
    for row in range(3):
        degrees[row] = degree_for(bands[row], error)
        if degrees[row] > TOP:
            return 0, 0, 0.0, 0.0, 0.0
    degree = degrees[SINE]
    for cell in range(cells):
        degrees[FIRST + cell] = degree
        economised(wk, rk, 0.0, middle - low - cell, half, degree, fold, room, coefficients[FIRST + cell])
    # sin(pi u) serves the bound on far cells alone.
    degrees[SINE] = degree_for(bands[2], max(error, FAR))
    economised(wh, rh, 0.0, segment[2] - aims[0], segment[3], degrees[H], fold, room, coefficients[H])
    economised(wv, rv, 0.0, segment[4] - aims[1], segment[5], degrees[V], fold, room, coefficients[V])
    economised((1.0,), (math.pi,), -0.5 * math.pi, middle, half, degrees[SINE], fold, room, coefficients[SINE])
    gains = tail(bands[0], degrees[H]) + tail(bands[1], degrees[V])
    return cells, low, gains, tail(bands[2], degree), tail(bands[2], degrees[SINE])


@LEAN
def far_limit(c0, c1, a2, distance, reach, count):
    """Bound of |sum| in every cell at least `distance` from the expansion's centre; see `answers.far_bound`."""
    if distance - reach <= 0.0:
        return np.inf
    step = math.pi / count
    s, k = math.sin(step * distance), math.cos(step * distance)
    near = math.sin(step * (distance - reach))
    return (c0 / s + c1 * step * abs(k) / (s * s) + a2 * step * step / near**3) / count


@LEAN
def fill_tile(rotation, translation, lx, ly, lz, parts, starts, q, sine, cosine, r, n, first, size, at, m, ex, ey, ez):
    """Put points first..first + size of symbol n into the tile from `at`: offsets from the reference, per r_ref.

    The reference is the translation of part q (of point 0 where there are no rotations). Axes: the array's normal,
    its horizontal axis, up. Plain arrays as arguments: taking one out of a tuple costs a counted reference.
    """
    scale = 1.0 / r
    x0, y0, z0 = translation[n, q, 0], translation[n, q, 1], translation[n, q, 2]
    if rotation.shape[0] == 0:
        end = min(first + size, translation.shape[1])
        for l in range(first, end):  # noqa: E741
            x, y = translation[n, l, 0] - x0, translation[n, l, 1] - y0
            i = at + l - first
            ex[i] = (cosine * x + sine * y) * scale
            ey[i] = (cosine * y - sine * x) * scale
            ez[i] = (translation[n, l, 2] - z0) * scale
    else:
        end = min(first + size, len(lx))
        for run in range(len(parts)):
            low, high = starts[run], starts[run + 1]
            if low < first or low >= end:
                continue
            p = parts[run]
            for j in range(3):
                x, y = rotation[n, p, 0, j], rotation[n, p, 1, j]
                m[j] = (cosine * x + sine * y) * scale
                m[3 + j] = (cosine * y - sine * x) * scale
                m[6 + j] = rotation[n, p, 2, j] * scale
            x, y = translation[n, p, 0] - x0, translation[n, p, 1] - y0
            m[9] = (cosine * x + sine * y) * scale
            m[10] = (cosine * y - sine * x) * scale
            m[11] = (translation[n, p, 2] - z0) * scale
            lanes.place_part(lx, ly, lz, low, high - low, m, ex, ey, ez, at + low - first)
    for i in range(at + end - first, at + size):
        ex[i], ey[i], ez[i] = 0.0, 0.0, 0.0


@LEAN
def constants(radar, refs, i, segs, index, psi0, omega0, base, k, s):
    """Fill row s of k with the constants of symbol i, in segment `index`, for `lanes.arguments`."""
    r = refs[i, 3]
    hx = (radar.cosine * refs[i, 0] + radar.sine * refs[i, 1]) / r
    hy = (radar.cosine * refs[i, 1] - radar.sine * refs[i, 0]) / r
    hz = refs[i, 2] / r
    phase_h = radar.kappa / 4.0 * (radar.transmit_h + radar.receive_h - 2)
    phase_v = radar.kappa / 4.0 * (radar.transmit_v + radar.receive_v - 2)
    k[s, 0], k[s, 1] = hy, hz
    k[s, 2], k[s, 3] = 1.0 / segs[index, 3], segs[index, 2] / segs[index, 3]
    k[s, 4], k[s, 5] = 1.0 / segs[index, 5], segs[index, 4] / segs[index, 5]
    k[s, 6] = r * radar.cells / segs[index, 7]
    k[s, 7] = ((refs[i, 5] - base) + refs[i, 6] - (segs[index, 6] - base)) / segs[index, 7]
    k[s, 8] = -r * radar.turns
    k[s, 9], k[s, 10] = phase_h * segs[index, 3], phase_v * segs[index, 5]
    fixed = phase_h * (segs[index, 2] - psi0) + phase_v * (segs[index, 4] - omega0) - refs[i, 4]
    k[s, 11] = fixed - np.rint(fixed)
    k[s, 12] = 1.0 / (r * r)
    k[s, 13], k[s, 14], k[s, 15] = 2.0 * hx, 2.0 * hy, 2.0 * hz


@LEAN
def near_cells(place, deep, window):
    """Cells first..last of the window that can well be a symbol's strongest; the bound looks after the others."""
    margin = 0.6 + 1.5 * deep
    first, last = math.ceil(place - margin), math.floor(place + margin)
    return max(0, min(first, window - 1)), max(0, min(last, window - 1))


@LEAN
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


@LEAN
def one_cell(row, degree, at, size, u, weight, real, imag):
    """Sum of one symbol's points in one cell of the window."""
    lanes.horner(u[at : at + size], row, degree, weight[at : at + size], size)
    re, im = lanes.weigh(weight, real, imag, at, size)
    return complex(re, im)


@LEAN
def certify(
    place, deep, c0, c1, a2, slack, bound, sums, first, last, window, at, size, typed, degree, shape, arrays
):  # fmt: skip
    """Strongest cell of one symbol: (state, place in `sums`, near-tie, close call), more cells as the bound asks.

    sums: (RING + WIDEST + RING,), the window's cells from RING on. shape: (count, half-width, centre) of the cells.
    arrays: sin(pi u), u, real and imaginary parts and room for weights, needed only where the first bound fails.
    """
    count, half, centre = int(shape[0]), shape[1], shape[2]
    lowest, highest = first + RING, last + RING
    for grow in range(3):
        if grow == 1:
            sin_u, u, real, imag, weight = arrays
            for cell in range(window):
                if cell < first or cell > last:
                    sums[RING + cell] = one_cell(typed[FIRST + cell], degree, at, size, u, weight, real, imag)
            lowest, highest = RING, RING + window - 1
        if grow == 2:
            if count < 3 * RING + WIDEST:
                break
            for j in range(1, RING + 1):
                for cell in (-j, window - 1 + j):
                    re, im = lanes.distant_cell(cell, half, centre, count, sin_u, u, real, imag, at, size)
                    # Only an upper bound of the size, since the sine is coarse; no value is taken from here.
                    sums[RING + cell] = math.hypot(re, im) + slack
            lowest, highest = 0, 2 * RING + window - 1
        best, second, which = rank(sums, lowest, highest)
        if grow == 2 and not RING <= which < RING + window:
            break
        gap = min(place - (lowest - 1 - RING), highest + 1 - RING - place, 0.5 * count)
        far = far_limit(c0, c1, a2, gap, deep, count)
        if far + bound < best * (1.0 - NEAR_TIE) - bound:
            return FINE, which, best - second <= NEAR_TIE * best, second >= best - 2.0 * bound
        if size == 0:
            break
    return AGAIN, 0, False, True


@LEAN
def run(scene, lay, radar, refs, span, segs, symbols, aims, rules, fits, fold, plan, rooms, work, small, out):
    """Compute the symbols of all segments.

    symbols: indices that refs, span and segs are cut from; fits: polynomials of inverse, excess (float64), cosine and
    sine (the tile's type); plan: error of the segments' fits, slack relative to the sum of amplitudes and to the sum
    of peak amplitudes, 1 where close calls are final; rooms, work, small: see `rooms_for`; out: values, cells, state,
    totals, bounds, ties, each (N,).
    """
    inverse, excess, cosine, sine = fits
    values, cells, state, totals, bounds, ties = out
    rotation, translation, lx, ly, lz = scene.rotation, scene.translation, lay.x, lay.y, lay.z
    parts, starts, amplitude = lay.parts, lay.starts, lay.amplitude
    ex, ey, ez, eps, inv, exc = work
    real, imag, u, sin_u, turn, amp, gain_h, gain_v, square, cos_t, sin_t = small
    q = scene.part[0] if len(scene.part) else 0
    psi0, omega0 = aims
    padded = len(amplitude)
    room, m, k, sums, more, weights, coefficients, typed, degrees = rooms
    together = len(sums)
    chunk, kept = lanes.chunk_of(padded), padded <= lanes.KEPT
    for index in range(len(segs)):
        start, end = int(segs[index, 0]), int(segs[index, 1])
        base = np.rint(segs[index, 6])
        window, low, bound_gain, bound_cell, bound_sine = fit_segment(
            segs[index], aims, rules, plan[0], base, fold, room, coefficients, degrees
        )
        if window == 0 or window >= radar.subcarriers:
            for i in range(start, end):
                state[symbols[i]] = AGAIN
            continue
        for row in range(FIRST + window):
            for j in range(degrees[row] + 1):
                typed[row, j] = coefficients[row, j]
        row_h, row_v, row_sine = typed[H], typed[V], typed[SINE]
        degree = degrees[FIRST]
        first, last = 0, window - 1
        for i in range(start, end, together):
            many = min(together, end - i)
            if kept:
                first, last = window, -1
            for s in range(many):
                constants(radar, refs, i + s, segs, index, psi0, omega0, base, k, s)
                a, b = near_cells(span[i + s, CELL] - base - low, span[i + s, SIZE] * radar.cells, window)
                first, last = min(first, a), max(last, b)
                weights[s, 0], weights[s, 1], weights[s, 2], more[s, 0], more[s, 1] = 0.0, 0.0, 0.0, 0.0, 0.0
                for cell in range(window):
                    sums[s, RING + cell] = 0.0
            for point in range(0, padded, chunk):
                size = min(chunk, padded - point)
                whole = many * size
                at = point if kept else 0
                u_c, sin_c = u[at : at + whole], sin_u[at : at + whole]
                real_c, imag_c = real[at : at + whole], imag[at : at + whole]
                for s in range(many):
                    fill_tile(
                        rotation, translation, lx, ly, lz, parts, starts, q, radar.sine, radar.cosine,
                        refs[i + s, 3], symbols[i + s], point, size, s * size, m, ex, ey, ez,
                    )  # fmt: skip
                    lanes.relative_excess(ex, ey, ez, k[s, 13], k[s, 14], k[s, 15], eps, s * size, size)
                lanes.horner(eps, inverse, len(inverse) - 1, inv, whole)
                lanes.horner(eps, excess, len(excess) - 1, exc, whole)
                for s in range(many):
                    # Until the waves are made, cos_t and sin_t hold the gains' arguments.
                    lanes.arguments(
                        k, s, ey, ez, eps, inv, exc, amplitude, point, cos_t, sin_t, u_c, turn, amp, s * size, size
                    )
                lanes.horner(cos_t, row_h, degrees[H], gain_h, whole)
                lanes.horner(sin_t, row_v, degrees[V], gain_v, whole)
                lanes.squares(whole, turn, square)
                lanes.horner(square, cosine, len(cosine) - 1, cos_t, whole)
                lanes.horner(square, sine, len(sine) - 1, sin_t, whole)
                lanes.waves(whole, amp, gain_h, gain_v, cos_t, sin_t, turn, real_c, imag_c)
                lanes.horner(u_c, row_sine, degrees[SINE], sin_c, whole)
                for cell in range(first, last + 1):
                    lanes.horner(u_c, typed[FIRST + cell], degree, gain_v, whole)
                    for s in range(many):
                        re, im = lanes.weigh(gain_v, real_c, imag_c, s * size, size)
                        sums[s, RING + cell] += complex(re, im)
                for s in range(many):
                    c0, c1, c2, c3, total, t1, t2 = lanes.far_sums(sin_c, u_c, real_c, imag_c, amp, s * size, size)
                    more[s, 0] += complex(c0, c1)
                    more[s, 1] += complex(c2, c3)
                    weights[s, 0] += total
                    weights[s, 1] += t1
                    weights[s, 2] += t2
            for s in range(many):
                n, total = symbols[i + s], weights[s, 0]
                peaks = lay.total * k[s, 12] / (1.0 - span[i + s, SPREAD]) ** 2
                bound = total * (plan[1] + bound_cell) + peaks * (plan[2] + bound_gain)
                totals[n], bounds[n] = total, bound
                place = span[i + s, CELL] - base
                c0 = abs(more[s, 0]) + total * bound_sine
                half, shift = segs[index, 7], segs[index, 6] - base - place
                c1 = abs(more[s, 1] * half + more[s, 0] * shift)
                a2 = half * half * weights[s, 2] + 2.0 * half * shift * weights[s, 1] + shift * shift * total
                a2 = abs(a2) + 1e-3 * total * min(1.0, (half + abs(shift)) ** 2)
                c1 += total * bound_sine * 2.0 * segs[index, 7]
                fate, which, tie, close = certify(
                    place - low, span[i + s, SIZE] * radar.cells, c0, c1, a2, total * bound_sine, bound, sums[s],
                    first, last, window, s * padded, padded if kept else 0, typed, degree,
                    (radar.subcarriers, segs[index, 7], segs[index, 6] - base - low),
                    (sin_u, u, real, imag, gain_v),
                )  # fmt: skip
                if close and plan[3] == 0.0:
                    fate = AGAIN
                state[n] = fate
                if fate == FINE:
                    cell = int(base) + low + which - RING
                    values[n] = sums[s, which] * cell_phase(cell, radar.subcarriers)
                    cells[n], ties[n] = cell % radar.subcarriers, tie


def rooms_for(points: int, rates: int, single: bool):
    """Work arrays of `run`: (rooms, work in float64, small in the tile's type).

    The tile's arrays are separate and of odd length: as rows of one array a whole 4096 bytes apart, loads would wait
    for unrelated stores.
    """
    kind = np.float32 if single else np.float64
    together = max(1, lanes.TILE // points)
    rooms = (
        np.empty((3, rates)), np.empty(12), np.empty((together, 16)),
        np.empty((together, WIDEST + 2 * RING), np.complex128), np.empty((together, 2), np.complex128),
        np.empty((together, 3)), np.empty((FIRST + WIDEST, TOP + 1)), np.empty((FIRST + WIDEST, TOP + 1), kind),
        np.empty(FIRST + WIDEST, np.int64),
    )  # fmt: skip
    return rooms, tuple(np.empty(lanes.ROW) for _ in range(6)), tuple(np.empty(lanes.ROW, kind) for _ in range(11))
