"""The compiled loops between a target's points and all subcarriers: moments of the ranges, and their spectra."""

import math

import numpy as np

from lowalt.common.jit import kernel

LOOPS = kernel(error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
STRIDE = 16
"""Subcarriers that share one short phase ramp."""
BLOCK = 4
"""Orders that share a pass over the points."""


@LOOPS
def moments(strength, out, back, times, excess_a, excess_b, middle, half_cells, reach, result):
    """Fill result (N, 2, Q, P) with real and imaginary parts of (-j)^p times the sum over points of z T_p(u).

    z = times strength out back, u the two-way range. out, back: (Q, N, L) at Q frequencies; strength: (N or 1, L);
    u counts from `middle` (N,), in cells as `reach`, and runs from -1 to 1 over `reach`. P is a multiple of BLOCK.
    Symbols without any strength are zero.
    """
    nodes, symbols, count = out.shape
    orders = result.shape[3]
    powers, real, imag = np.empty((orders, count)), np.empty(count), np.empty(count)
    for n in range(symbols):
        row = n % strength.shape[0]
        result[n] = 0.0
        if not strength[row].any():
            continue
        for i in range(count):
            powers[0, i] = 1.0
            powers[1, i] = (half_cells * (excess_a[n, i] + excess_b[n, i]) - middle[n]) / reach
        for p in range(2, orders):
            for i in range(count):
                powers[p, i] = 2.0 * powers[1, i] * powers[p - 1, i] - powers[p - 2, i]
        for q in range(nodes):
            for i in range(count):
                z = times * strength[row, i] * (out[q, n, i] * back[q, n, i])
                real[i], imag[i] = z.real, z.imag
            # Four orders a pass over the points.
            for p in range(0, orders, BLOCK):
                a, b, c, d, e, f, g, h = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
                for i in range(count):
                    a += powers[p, i] * real[i]
                    b += powers[p, i] * imag[i]
                    c += powers[p + 1, i] * real[i]
                    d += powers[p + 1, i] * imag[i]
                    e += powers[p + 2, i] * real[i]
                    f += powers[p + 2, i] * imag[i]
                    g += powers[p + 3, i] * real[i]
                    h += powers[p + 3, i] * imag[i]
                result[n, 0, q, p], result[n, 1, q, p] = a, b
                result[n, 0, q, p + 1], result[n, 1, q, p + 1] = d, -c
                result[n, 0, q, p + 2], result[n, 1, q, p + 2] = -e, -f
                result[n, 0, q, p + 3], result[n, 1, q, p + 3] = -h, g


@LOOPS
def turned(whole, cells, half_steps, total):
    """Phase factor of a delay by `whole` + `cells` range cells, `half_steps` halves of a subcarrier off the middle.

    Whole cells turn by multiples of pi / M, which are reduced in whole numbers.
    """
    index = whole % (2 * total) * half_steps % (2 * total)
    angle = math.pi * (cells * half_steps + index) / total
    return complex(math.cos(angle), -math.sin(angle))


@LOOPS
def delayed(planes, own, whole, cells, result):
    """Add own[n] (planes[n, 0] + j planes[n, 1]), delayed, to result (N, M).

    planes: (N, 2, M); the delay about the middle subcarrier is `whole` (N,) int64 plus `cells` (N,) range cells.
    """
    symbols, total = result.shape
    ramp_re, ramp_im = np.empty(STRIDE), np.empty(STRIDE)
    for n in range(symbols):
        step, wide = turned(whole[n], cells[n], 2, total), turned(whole[n], cells[n], 2 * STRIDE, total)
        phase = 1.0 + 0.0j
        for k in range(STRIDE):
            ramp_re[k], ramp_im[k] = phase.real, phase.imag
            phase *= step
        phase = own[n] * turned(whole[n], cells[n], 1 - total, total)
        for first in range(0, total, STRIDE):
            a, b = phase.real, phase.imag
            for k in range(min(STRIDE, total - first)):
                x, y = planes[n, 0, first + k], planes[n, 1, first + k]
                c, d = a * x - b * y, a * y + b * x
                result[n, first + k] += complex(c * ramp_re[k] - d * ramp_im[k], c * ramp_im[k] + d * ramp_re[k])
            phase *= wide
