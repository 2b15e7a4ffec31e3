"""Where every symbol's points can lie, before any is computed: bounds from the parts' poses alone."""

import math

import numpy as np

from lowalt.common.jit import LEAN

PSI, OMEGA, CELL, SPREAD, SIZE = range(5)
"""Columns of `spans`: direction cosines and range cell of the reference, largest |offset| / range, and in metres."""
DRIFT = 1.0
"""Radians of gain phase that a segment's directions may drift beyond what the target itself spans."""


@LEAN
def spans(rotation, translation, first, parts, centres, radii, refs, sine, cosine, out):
    """Fill out (N, 5) and return the largest SPREAD.

    A run's points lie within its radius, times a bound of its matrix's norm, of where its centre is taken.
    """
    worst = 0.0
    for n in range(len(refs)):
        r = refs[n, 3]
        size = 0.0
        if rotation.shape[0] == 0:
            for p in range(translation.shape[1]):
                x = translation[n, p, 0] - translation[n, first, 0]
                y = translation[n, p, 1] - translation[n, first, 1]
                z = translation[n, p, 2] - translation[n, first, 2]
                size = max(size, x * x + y * y + z * z)
            size = math.sqrt(size)
        else:
            for run in range(len(parts)):
                p = parts[run]
                x = translation[n, p, 0] - translation[n, first, 0]
                y = translation[n, p, 1] - translation[n, first, 1]
                z = translation[n, p, 2] - translation[n, first, 2]
                a, b, c = centres[run, 0], centres[run, 1], centres[run, 2]
                x += rotation[n, p, 0, 0] * a + rotation[n, p, 0, 1] * b + rotation[n, p, 0, 2] * c
                y += rotation[n, p, 1, 0] * a + rotation[n, p, 1, 1] * b + rotation[n, p, 1, 2] * c
                z += rotation[n, p, 2, 0] * a + rotation[n, p, 2, 1] * b + rotation[n, p, 2, 2] * c
                reach = norm(rotation, n, p) * radii[run] if radii[run] > 0.0 else 0.0
                size = max(size, math.sqrt(x * x + y * y + z * z) + reach)
        size *= 1.0 + 1e-12
        out[n, PSI] = (cosine * refs[n, 1] - sine * refs[n, 0]) / r if r > 0.0 else 0.0
        out[n, OMEGA] = refs[n, 2] / r if r > 0.0 else 0.0
        out[n, CELL] = refs[n, 5] + refs[n, 6]
        out[n, SPREAD] = size / r if r > 0.0 else np.inf
        out[n, SIZE] = size
        worst = max(worst, out[n, SPREAD])
    return worst


@LEAN
def norm(rotation, n, p):
    """Bound of the norm of rotation[n, p]: sqrt of the largest row sum of |m m^T| (1 for a rotation)."""
    rows = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for j in range(3):
        x, y, z = rotation[n, p, 0, j], rotation[n, p, 1, j], rotation[n, p, 2, j]
        rows = (rows[0] + x * x, rows[1] + y * y, rows[2] + z * z, rows[3] + x * y, rows[4] + x * z, rows[5] + y * z)
    a, b, c, d, e, f = rows[0], rows[1], rows[2], abs(rows[3]), abs(rows[4]), abs(rows[5])
    return math.sqrt(max(a + d + e, b + d + f, c + e + f))


@LEAN
def segments(span, rate_h, rate_v, longest, out):
    """Cut the symbols into runs over which the array gains stay short polynomials.

    Fills out (N, 6): first symbol, end, centre and half-width of psi and of omega. Returns how many runs there are.
    A single symbol may be wider than the limits; the plan looks at that.
    """
    count = 0
    n = 0
    while n < len(span):
        low_h, high_h, low_v, high_v = np.inf, -np.inf, np.inf, -np.inf
        end = n
        room_h, room_v = 0.0, 0.0
        while end < len(span) and end - n < longest:
            d = span[end, SPREAD]
            turn = 2.0 * d / (2.0 - d) if d < 1.0 else 2.0
            a, b = span[end, PSI], span[end, OMEGA]
            l0, l1 = min(low_h, a - turn), min(low_v, b - turn)
            h0, h1 = max(high_h, a + turn), max(high_v, b + turn)
            if end == n:
                # Room for drift: long runs of common polynomials against polynomials of low degree.
                room_h = 1.2 * (h0 - l0) * rate_h + DRIFT
                room_v = 1.2 * (h1 - l1) * rate_v + DRIFT
            elif (h0 - l0) * rate_h > room_h or (h1 - l1) * rate_v > room_v:
                break
            low_h, low_v, high_h, high_v = l0, l1, h0, h1
            end += 1
        out[count, 0], out[count, 1] = n, end
        out[count, 2], out[count, 3] = 0.5 * (low_h + high_h), 0.5 * (high_h - low_h) * (1.0 + 1e-9) + 1e-9
        out[count, 4], out[count, 5] = 0.5 * (low_v + high_v), 0.5 * (high_v - low_v) * (1.0 + 1e-9) + 1e-9
        count += 1
        n = end
    return count
