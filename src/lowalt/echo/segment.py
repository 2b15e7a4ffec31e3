"""What a segment of symbols is computed with: its polynomials, each symbol's constants, and a tile's points.

A segment is a run of symbols over which the gains and the cell kernel are short polynomials (`spans.segments`).
"""

import math

import numpy as np

from lowalt.echo import lanes
from lowalt.echo.compile import LEAN
from lowalt.echo.fits import TOP, degree_for, economised, tail

WIDEST = 6
"""Most cells a segment's window may have."""
H, V, SINE, FIRST = 0, 1, 2, 3
"""Rows of a segment's coefficients: horizontal and vertical gain, sin(pi u), then the window's cells."""
FAR = 1e-4
"""Accuracy of sin(pi u), which only the bound on far cells uses; its error is part of that bound."""


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
