"""The fast kernel's driver: segments of symbols, tiles of points, certified strongest cells.

All smooth factors are the plan's polynomials; `lanes` holds the loops. Everything here is compiled without counted
references (they took a quarter of the time). So nothing here may allocate; rooms come in as arguments.
"""

import numpy as np

from lowalt.echo import lanes
from lowalt.echo.certify import AGAIN, FINE, RING, certify, near_cells
from lowalt.echo.compile import LEAN
from lowalt.echo.fits import TOP
from lowalt.echo.segment import FIRST, SINE, WIDEST, H, V, constants, fill_tile, fit_segment
from lowalt.echo.spans import CELL, SIZE, SPREAD
from lowalt.echo.terms import cell_phase


@LEAN
def run(scene, lay, radar, refs, span, segs, symbols, aims, rules, fits, fold, plan, rooms, work, small, out):
    """Compute the symbols of all segments.

    symbols: indices that refs, span and segs are cut from; fits: polynomials of inverse, excess (float64), cosine and
    sine (the tile's type); plan: error of the segments' fits, slack relative to the sum of amplitudes and to the sum
    of peak amplitudes, 1 where close calls are final; rooms, work, small: see `rooms_for`; out: values, cells, state,
    totals, bounds, ties, gaps, each (N,).
    """
    inverse, excess, cosine, sine = fits
    values, cells, state, totals, bounds, ties, gaps = out
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
                fate, which, tie, lead = certify(
                    place - low, span[i + s, SIZE] * radar.cells, c0, c1, a2, total * bound_sine, bound, sums[s],
                    first, last, window, s * padded, padded if kept else 0, typed, degree,
                    (radar.subcarriers, segs[index, 7], segs[index, 6] - base - low),
                    (sin_u, u, real, imag, gain_v),
                )  # fmt: skip
                if lead <= 0.0 and plan[3] == 0.0:
                    fate = AGAIN
                state[n] = fate
                if fate == FINE:
                    cell = int(base) + low + which - RING
                    values[n] = sums[s, which] * cell_phase(cell, radar.subcarriers)
                    cells[n], ties[n], gaps[n] = cell % radar.subcarriers, tie, max(lead, 0.0)


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
