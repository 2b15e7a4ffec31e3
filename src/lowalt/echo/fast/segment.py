"""What symbols are computed with: a segment's gain polynomials, each symbol's constants, and a tile's points.

A segment is a run of symbols over which the array gains are short polynomials (`spans.segments`).
"""

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.echo.fast import vector_loops
from lowalt.echo.fast.polynomials import TOP, degree_for, economised, tail


@LEAN
def fit_gain(weights, rates, centre, half, error, unit, fold, room, coefficients, typed, row):
    """Fit a gain on centre +- half to `error` into a row; returns (degree, bound of its error with roundings).

    The degree is -1 where the polynomial would be too long. unit: the rounding of the type it is evaluated in; an
    order k rounds its argument, its coefficient, its products and sums: at most 3 k + 3 roundings of |c_k|.
    """
    band = rates[0] * half
    degree = degree_for(band, error)
    if degree > TOP:
        return -1, 0.0
    economised(weights, rates, 0.0, centre, half, degree, fold, room, coefficients[row])
    rounding = 0.0
    for k in range(degree + 1):
        typed[row, k] = coefficients[row, k]
        rounding += (3 * k + 3) * abs(coefficients[row, k])
    return degree, tail(band, degree) + rounding * unit


@LEAN
def fit_gains(segs, index, aims, rules, error, unit, fold, room, coefficients, typed):
    """Fit a segment's horizontal and vertical gain; returns (their degrees, bound of the error of their product).

    segs: of `spans.segments`; aims: the beams' direction cosines; rules: weights and rates of both; else as `fit_gain`.
    """
    weights_h, rates_h, weights_v, rates_v = rules
    centre_h, centre_v = segs[index, 2] - aims[0], segs[index, 4] - aims[1]
    degree_h, bound_h = fit_gain(
        weights_h, rates_h, centre_h, segs[index, 3], error, unit, fold, room, coefficients, typed, 0
    )
    degree_v, bound_v = fit_gain(
        weights_v, rates_v, centre_v, segs[index, 5], error, unit, fold, room, coefficients, typed, 1
    )
    return degree_h, degree_v, bound_h + bound_v + bound_h * bound_v


@LEAN
def constants(radar, refs, i, segs, index, psi0, omega0, centre, half, k, m):
    """Fill k with the constants of symbol i, in segment `index`, for `vector_loops.geometry`, and m[12:] for placing.

    centre, half: the range in cells, from the symbol's nearest whole cell, that the cell kernel is expanded about.
    """
    r = refs[i, 3]
    hx = (radar.cosine * refs[i, 0] + radar.sine * refs[i, 1]) / r
    hy = (radar.cosine * refs[i, 1] - radar.sine * refs[i, 0]) / r
    hz = refs[i, 2] / r
    phase_h = radar.kappa / 4.0 * (radar.transmit_h + radar.receive_h - 2)
    phase_v = radar.kappa / 4.0 * (radar.transmit_v + radar.receive_v - 2)
    k[0], k[1] = segs[index, 2] / segs[index, 3], segs[index, 4] / segs[index, 5]
    k[2], k[3] = r * radar.cells / half, (refs[i, 6] - centre) / half
    k[4], k[5], k[6] = -r * radar.turns, phase_h * segs[index, 3], phase_v * segs[index, 5]
    fixed = phase_h * (segs[index, 2] - psi0) + phase_v * (segs[index, 4] - omega0) - refs[i, 4]
    k[7] = fixed - np.rint(fixed)
    m[12], m[13], m[14] = 2.0 * hx, 2.0 * hy, 2.0 * hz
    m[15], m[16] = 1.0 / segs[index, 3], hy / segs[index, 3]
    m[17], m[18] = 1.0 / segs[index, 5], hz / segs[index, 5]


@LEAN
def fill_tile(rotation, translation, lx, ly, lz, parts, starts, q, sine, cosine, r, n, first, size, m, eps, ey, ez):
    """Put points first..first + size of symbol n into the tile, relative to the reference and per r_ref.

    The reference is the translation of part q (of point 0 where there are no rotations). Axes: the array's normal,
    its horizontal axis, up. Plain arrays as arguments: taking one out of a tuple costs a counted reference.
    """
    scale = 1.0 / r
    x0, y0, z0 = translation[n, q, 0], translation[n, q, 1], translation[n, q, 2]
    if rotation.shape[0] == 0:
        end = min(first + size, translation.shape[1])
        vector_loops.place_nodes(translation, n, q, first, end - first, cosine, sine, scale, m, eps, ey, ez)
    else:
        end = min(first + size, starts[len(parts)])
        # Unsigned places, as in `lanes`: a signed one costs a test for counting from the end at every access.
        at, none, one, two = np.uint64(n), np.uint64(0), np.uint64(1), np.uint64(2)
        for run in range(len(parts)):
            low, high = starts[run], starts[run + 1]
            if low < first or low >= end:
                continue
            p = np.uint64(parts[run])
            still = 0.0
            for j in range(np.uint64(3)):
                x, y, z = rotation[at, p, none, j], rotation[at, p, one, j], rotation[at, p, two, j]
                still += abs(x) + abs(y) + abs(z)
                m[j] = (cosine * x + sine * y) * scale
                m[np.uint64(3) + j] = (cosine * y - sine * x) * scale
                m[np.uint64(6) + j] = z * scale
            x, y = translation[at, p, none] - x0, translation[at, p, one] - y0
            m[9] = (cosine * x + sine * y) * scale
            m[10] = (cosine * y - sine * x) * scale
            m[11] = (translation[at, p, two] - z0) * scale
            if still == 0.0:
                vector_loops.place_still(m, high - low, eps, ey, ez, low - first)
            else:
                vector_loops.place_part(lx, ly, lz, low, high - low, m, eps, ey, ez, low - first)
    for i in range(end - first, size):
        eps[i], ey[i], ez[i] = 0.0, 0.0, 0.0
