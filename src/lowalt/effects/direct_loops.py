"""The compiled loops of a target's echo on the direct path alone: from places to moments, one symbol after another.

Next to nothing but places is read and nothing but moments is written, so that a symbol's numbers stay in the nearest
cache: factors of all points at all symbols, as further paths need them, pass through memory twice.
"""

import math

import numpy as np

from lowalt.common.jit import INNER_VECTOR, ORDERED, VECTOR
from lowalt.echo.fast.vector_loops import horner
from lowalt.echo.pointwise.reference_range import RANGE, X, Y, Z
from lowalt.effects.moment_loops import filled, polynomials, sums, sums_of
from lowalt.effects.plane_loops import plane_sums
from lowalt.effects.response_loops import beyond_middle, geometry
from lowalt.effects.rigid_loops import placed
from lowalt.effects.waves import COSINE, DEGREE, SINE, WAVE

ROUNDED = 1e-14
"""Share of the largest range that two ways to compute an excess range may differ by."""


@ORDERED
def spans(places, refs, origin, half_m, low, high, turn):
    """Fill low and high (N,) with bounds of each symbol's least and largest excess range (m) of places (N, 3, L).

    refs, origin: as in `response_loops.one_way`; half_m: distance from the array's corner to where the range counts. A
    point at s along the line of sight from the origin, and at a distance e from it, has a range of at least r + s and
    at most r + s + e^2 / (2 (r + s)); turn (N,): its direction is at most 2 e / (2 r - e) from the origin's.
    """
    for n in range(len(places)):
        x, y, z, ref = places[n, 0], places[n, 1], places[n, 2], refs[n]
        o0, o1, o2, r = origin[n, 0], origin[n, 1], origin[n, 2], ref[RANGE]
        ux, uy, uz = ref[X] / r, ref[Y] / r, ref[Z] / r
        least, most, away = 0.0, 0.0, 0.0
        for i in range(np.uint64(places.shape[2])):
            a, b, c = x[i] - o0, y[i] - o1, z[i] - o2
            along = ux * a + uy * b + uz * c
            least, most, away = min(least, along), max(most, along), max(away, a * a + b * b + c * c)
        e = math.sqrt(away)
        # A point may be as near as the station: its range then differs by no more than it is away.
        near = 2.0 * e >= r
        turn[n] = 2.0 if near else 2.0 * e / (2.0 * r - e)
        room = ROUNDED * (r + e) + half_m * turn[n]
        low[n] = (-e if near else least) - room
        high[n] = (e if near else most + away / (2.0 * (r + least))) + room


@ORDERED
def slants(places, station, axes, wide, tall):
    """Return the largest of (wide |side| + tall |up|)^2 / r^2 over places (N, 3, L), and the least r^2 (m^2).

    axes: as in `response_loops.one_way`; side, up: a place's coordinates along the array as seen from the station, r
    its range. A place in the station counts as none.
    """
    sine, cosine = axes
    s0, s1, s2 = station[0], station[1], station[2]
    most, least = 0.0, np.inf
    for n in range(len(places)):
        x, y, z = places[n, 0], places[n, 1], places[n, 2]
        for i in range(np.uint64(places.shape[2])):
            across, along, up = x[i] - s0, y[i] - s1, z[i] - s2
            square = across * across + along * along + up * up
            slant = wide * abs(cosine * along - sine * across) + tall * abs(up)
            most, least = max(most, slant * slant / max(square, 1e-300)), min(least, square)
    return most, least


PLACES = 14
"""Row of work space of `moments` in which the points' places begin."""
ROWS = 20
"""Rows of work space of `moments` at one frequency."""


@INNER_VECTOR
def moments_of_symbol(
    count, station, axes, ref, origin, half_turns, spacing, aims, beam, kappas, steps, rows, squint, shape, strength,
    middle, half_cells, reach, work, wide, high, result,
):  # fmt: skip
    """Fill result (2, Q, P) with one symbol's moments, as in `moments`, from places in the rows PLACES of work.

    Places beyond the `count` points are any. ref: (7,), origin: (3,), strength: (L,), middle: those of the symbol.
    Returns 0, or l + 1 where r = 0.
    """
    orders, nodes, size = result.shape[2], len(kappas), work.shape[1]
    side, up, r, weight, ahead = work[0], work[1], work[2], work[3], work[4]
    turn, square, ct, st, more, real, imag = work[5], work[6], work[7], work[8], work[9], work[10], work[11]
    cosine, u, a, b, c, own, spare = work[12], work[13], work[14], work[15], work[16], work[17], work[4:9]
    table = work[ROWS:]
    middle_h, middle_v = 0.5 * (shape[0] - 1), 0.5 * (shape[1] - 1)
    fixed = beam * (middle_h * aims[0] + middle_v * aims[1])
    wave = 2.0 * half_turns if squint else kappas[0] / spacing
    centre, scale = 0.25 * (kappas[0] + kappas[-1]), 1.0 / reach
    if geometry(a, b, c, station, axes, ref, origin, more, side, up, r, weight):
        for i in range(count):
            if r[i] == 0.0:
                return i + 1
    filled(strength, size, own)
    for i in range(count, size):
        own[i] = 0.0
    beyond_middle(side, up, r, weight, middle_h * spacing, middle_v * spacing, False, ahead)
    for i in range(np.uint64(size)):
        t = -2.0 * half_turns * more[i] - wave * ahead[i] - fixed
        turn[i] = t - np.rint(t)
        square[i] = turn[i] * turn[i]
        u[i] = (2.0 * half_cells * (more[i] + ahead[i] if squint else more[i]) - middle) * scale
    horner(square, WAVE, COSINE, DEGREE, ct, size)
    horner(square, WAVE, SINE, DEGREE, st, size)
    for i in range(np.uint64(size)):
        whole = own[i] * weight[i] * weight[i]
        real[i], imag[i] = whole * ct[i], whole * (st[i] * turn[i])
    plane_sums(side, weight, centre, steps, 0.5 * beam * aims[0], shape[0], rows, spare, cosine, more, wide)
    plane_sums(up, weight, centre, steps, 0.5 * beam * aims[1], shape[1], rows, spare, cosine, more, high)
    if nodes > 1:
        polynomials(u, table)
    for q in range(nodes):
        one, other = wide[q], high[q]
        for i in range(np.uint64(size)):
            gain = one[i] * other[i]
            gain *= gain
            a[i], b[i] = gain * real[i], gain * imag[i]
        if nodes > 1:
            sums_of(table, a, b, size, result[:, q])
        else:
            sums(u, a, b, c, more, size, orders, result[:, q])
    return 0


@VECTOR
def moments(
    places, station, axes, refs, origin, half_turns, spacing, aims, beam, kappas, steps, rows, squint, shape, strength,
    middle, half_cells, reach, work, wide, high, result,
):  # fmt: skip
    """Fill result (N, 2, Q, P) with the moments (`moment_loops.moments`) of points on the direct path, plane waves.

    strength: (N or 1, L) two-way; middle (N,), reach: as there; work (ROWS, S), with P more rows for several
    frequencies, wide and high (Q, S): work space, S being `moment_loops.padded` of L; the others as in
    `response_loops.one_way`, whose array sends and receives. Returns 0, or n L + l + 1 where r = 0.
    """
    count, size = places.shape[2], work.shape[1]
    for n in range(len(places)):
        for k in range(3):
            filled(places[n, k], size, work[PLACES + k])
        fault = moments_of_symbol(
            count, station, axes, refs[n], origin[n], half_turns, spacing, aims, beam, kappas, steps, rows, squint,
            shape, strength[n % len(strength)], middle[n], half_cells, reach, work, wide, high, result[n],
        )  # fmt: skip
        if fault:
            return n * count + fault
    return 0


@INNER_VECTOR
def combined(matrix, found, n, result):
    """Fill result[:, n], (K, 2, Q, P), with matrix (K, T) times found (T, 2, Q, P)."""
    for k in range(len(matrix)):
        for part in range(2):
            for q in range(found.shape[2]):
                own = result[k, n, part, q]
                for p in range(len(own)):
                    own[p] = matrix[k, 0] * found[0, part, q, p]
                for t in range(1, len(found)):
                    one, share = found[t, part, q], matrix[k, t]
                    for p in range(len(own)):
                        own[p] += share * one[p]


@VECTOR
def moments_in_time(
    rotation, translation, points, part, matrix, station, axes, refs, origin, half_turns, spacing, aims, beam, kappas,
    steps, rows, squint, shape, strength, middle, half_cells, reach, work, wide, high, found, result,
):  # fmt: skip
    """Fill result (K, N, 2, Q, P) with matrix (K, T) times the moments (N, 2, Q, P) at T instants of each symbol.

    rotation (T N, G, 3, 3), translation (T N, G, 3) m: poses of G parts, the first instant of all symbols first;
    points: (3, L) m in their part's frame; part: (L,). Without rotation, (0, G, 3, 3), the points are the parts
    themselves. found: (T, 2, Q, P) work space; the others as in `moments`.
    """
    count, size = len(part), work.shape[1]
    for n in range(len(refs)):
        for t in range(len(found)):
            at, places = t * len(refs) + n, work[PLACES : PLACES + 3]
            if len(rotation) > 0:
                placed(rotation[at], translation[at], points, part, places)
            for k in range(3):
                own = places[k]
                for i in range(0 if len(rotation) > 0 else count):
                    own[i] = translation[at, i, k]
                for i in range(count, size):
                    own[i] = own[0]
            fault = moments_of_symbol(
                count, station, axes, refs[n], origin[n], half_turns, spacing, aims, beam, kappas, steps, rows, squint,
                shape, strength[n % len(strength)], middle[n], half_cells, reach, work, wide, high, found[t],
            )  # fmt: skip
            if fault:
                return n * count + fault
        combined(matrix, found, n, result)
    return 0
