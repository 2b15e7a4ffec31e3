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
def lit_points(strength, lit):
    """Fill lit with the numbers of the points that have any strength (L,); return how many they are."""
    count = 0
    for i in range(len(strength)):
        lit[count] = i
        count += strength[i] != 0.0
    return count


@LOOPS
def products(out, back, strength, times, lit, count, real, imag):
    """Fill real, imag with times strength out back, each (L,), of the `count` points `lit`."""
    if count == len(out):
        for i in range(count):
            z = times * strength[i] * (out[i] * back[i])
            real[i], imag[i] = z.real, z.imag
        return
    for i in range(count):
        at = lit[i]
        z = times * strength[at] * (out[at] * back[at])
        real[i], imag[i] = z.real, z.imag


@LOOPS
def moments(strength, out, back, times, excess_a, excess_b, middle, half_cells, reach, result):
    """Fill result (N, 2, Q, P) with real and imaginary parts of (-j)^p times the sum over points of z T_p(u).

    z = times strength out back, u the two-way range. out, back: (Q, N, L) at Q frequencies; strength: (N or 1, L);
    u counts from `middle` (N,), in cells as `reach`, and runs from -1 to 1 over `reach`. P is a multiple of BLOCK.
    Symbols without any strength are zero.
    """
    nodes, symbols, whole = out.shape
    orders = result.shape[3]
    powers, real, imag = np.empty((orders, whole)), np.empty(whole), np.empty(whole)
    lit = np.empty(whole, np.int64)
    for n in range(symbols):
        own = strength[n % strength.shape[0]]
        result[n] = 0.0
        # Points without strength are left out: of a group of points, all others.
        count = lit_points(own, lit)
        there, home = excess_a[n], excess_b[n]
        for i in range(count):
            powers[0, i] = 1.0
            at = i if count == whole else lit[i]
            powers[1, i] = (half_cells * (there[at] + home[at]) - middle[n]) / reach
        for p in range(2, orders):
            for i in range(count):
                powers[p, i] = 2.0 * powers[1, i] * powers[p - 1, i] - powers[p - 2, i]
        for q in range(nodes if count else 0):
            products(out[q, n], back[q, n], own, times, lit, count, real, imag)
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
def halves(planes, table, work):
    """Fill work (4, H) with the sums over orders of planes (2, P) times table (P, M): even orders', then odd orders'.

    Rows: real and imaginary part. H = (M + 1) // 2 subcarriers from the lowest one; about the middle of the band the
    functions of even orders are even and those of odd orders are odd.
    """
    for parity in range(2):
        real, imag = work[2 * parity], work[2 * parity + 1]
        real[:] = 0.0
        imag[:] = 0.0
        for p in range(parity, table.shape[0], 4):
            # Two orders a pass over the subcarriers; the number of orders may be odd.
            q, more = (p + 2, 1.0) if p + 2 < table.shape[0] else (p, 0.0)
            one, two = table[p], table[q]
            a, b, c, d = planes[0, p], planes[1, p], more * planes[0, q], more * planes[1, q]
            for m in range(np.uint64(len(real))):
                real[m] += a * one[m] + c * two[m]
                imag[m] += b * one[m] + d * two[m]


@LOOPS
def ramp(start, step, total, real, imag):
    """Fill real, imag (H,) with the phase factors start, start step, start step^2, ... in strides, to rounding."""
    wide = step[1]
    real[0], imag[0] = start.real, start.imag
    for k in range(1, min(STRIDE, len(real))):
        phase = complex(real[k - 1], imag[k - 1]) * step[0]
        real[k], imag[k] = phase.real, phase.imag
    for k in range(STRIDE, len(real)):
        real[k] = real[k - STRIDE] * wide.real - imag[k - STRIDE] * wide.imag
        imag[k] = real[k - STRIDE] * wide.imag + imag[k - STRIDE] * wide.real


@LOOPS
def spread(planes, table, own, whole, cells, result):
    """Add own[n] times the response of moments (N, 2, P), real and imaginary, delayed, to result (N, M).

    table: (P, M) real, each order's values at the subcarriers, even or odd about the band's middle as the order is; the
    delay about the middle subcarrier is `whole` (N,) int64 plus `cells` (N,) range cells.
    """
    symbols, total = result.shape
    half = (total + 1) // 2
    work, turn, sums = np.empty((4, half)), np.empty((2, half)), np.empty((2, total))
    for n in range(symbols):
        if not planes[n].any():
            continue
        halves(planes[n], table, work)
        even_re, even_im, odd_re, odd_im = work[0], work[1], work[2], work[3]
        step = turned(whole[n], cells[n], 2, total), turned(whole[n], cells[n], 2 * STRIDE, total)
        ramp(turned(whole[n], cells[n], 1 - total, total), step, total, turn[0], turn[1])
        re, im, x, y = turn[0], turn[1], own[n].real, own[n].imag
        low_re, low_im, high_re, high_im = sums[0], sums[1], sums[0, ::-1], sums[1, ::-1]
        for m in range(np.uint64(half)):
            a, b, c, d = even_re[m] + odd_re[m], even_im[m] + odd_im[m], x * re[m] - y * im[m], x * im[m] + y * re[m]
            low_re[m], low_im[m] = a * c - b * d, a * d + b * c
        # Above the middle the odd orders and the delay's phase change their signs.
        for m in range(np.uint64(total - half)):
            a, b, c, d = even_re[m] - odd_re[m], even_im[m] - odd_im[m], x * re[m] + y * im[m], y * re[m] - x * im[m]
            high_re[m], high_im[m] = a * c - b * d, a * d + b * c
        row = result[n]
        for m in range(np.uint64(total)):
            row[m] += complex(low_re[m], low_im[m])
