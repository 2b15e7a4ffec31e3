"""The compiled loops from a target's points to moments of their ranges."""

import numpy as np

from lowalt.common.jit import INNER_VECTOR, ORDERED, VECTOR

BLOCK = 4
"""Orders that share a pass over the points."""
LANES = 16
"""Points whose loops the compiler joins; those left over would pass one by one, so rows are filled up."""
DENSE = 0.6
"""Least share of points with strength at which all points are taken as they stand, those without any as zeros."""
SUM_ROWS = 5
"""Rows of work space of `moments` at one frequency."""


def padded(count: int) -> int:
    """Return the length of rows that hold `count` points in whole vectors."""
    return -(-count // LANES) * LANES


@INNER_VECTOR
def filled(values, size, out):
    """Fill out (size,) with values (L,) and the first of them again and again."""
    for i in range(np.uint64(len(values))):
        out[i] = values[i]
    for i in range(len(values), size):
        out[i] = values[0]


@ORDERED
def extremes(values, low, high):
    """Fill low and high (N,) with the least and the largest of values (N, L)."""
    for n in range(len(values)):
        row = values[n]
        least, most = row[0], row[0]
        for i in range(np.uint64(len(row))):
            least, most = min(least, row[i]), max(most, row[i])
        low[n], high[n] = least, most


@INNER_VECTOR
def lit_points(strength, lit):
    """Fill lit with the numbers of the points that have any strength (L,); return how many they are."""
    count = 0
    for i in range(len(strength)):
        lit[count] = i
        count += strength[i] != 0.0
    return count


@INNER_VECTOR
def products(out_re, out_im, back_re, back_im, strength, times, lit, count, real, imag):
    """Fill real, imag with times strength out back, each (L,), of the `count` points `lit`."""
    if count == len(out_re):
        for i in range(np.uint64(count)):
            own = times * strength[i]
            real[i] = own * (out_re[i] * back_re[i] - out_im[i] * back_im[i])
            imag[i] = own * (out_re[i] * back_im[i] + out_im[i] * back_re[i])
        return
    for i in range(np.uint64(count)):
        # Without a sign, no number can count from the end.
        at = np.uint64(lit[i])
        own = times * strength[at]
        real[i] = own * (out_re[at] * back_re[at] - out_im[at] * back_im[at])
        imag[i] = own * (out_re[at] * back_im[at] + out_im[at] * back_re[at])


@INNER_VECTOR
def places(there, home, middle, half_cells, reach, lit, count, u):
    """Fill u with the two-way ranges of the `count` points `lit`, -1 to 1 over `reach` about `middle` (cells)."""
    scale = 1.0 / reach
    if count == len(there):
        for i in range(np.uint64(count)):
            u[i] = (half_cells * (there[i] + home[i]) - middle) * scale
        return
    for i in range(np.uint64(count)):
        at = np.uint64(lit[i])
        u[i] = (half_cells * (there[at] + home[at]) - middle) * scale


@INNER_VECTOR
def sums(u, real, imag, before, last, count, orders, result):
    """Fill result (2, P) with (-j)^p times the sum over points of real + j imag, (L,) each, times T_p(u).

    before, last: (L,) work space for the polynomials of the two orders before a pass over the points, which takes four.
    """
    for p in range(0, orders, BLOCK):
        a, b, c, d, e, f, g, h = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for i in range(np.uint64(count)):
            x = u[i]
            # T_-2 = T_2 and T_-1 = T_1 start the recurrence.
            older, old = (before[i], last[i]) if p > 0 else (2.0 * x * x - 1.0, x)
            x += x
            one = x * old - older
            two = x * one - old
            three = x * two - one
            four = x * three - two
            before[i], last[i] = three, four
            y, z = real[i], imag[i]
            a += one * y
            b += one * z
            c += two * y
            d += two * z
            e += three * y
            f += three * z
            g += four * y
            h += four * z
        result[0, p], result[1, p] = a, b
        result[0, p + 1], result[1, p + 1] = d, -c
        result[0, p + 2], result[1, p + 2] = -e, -f
        result[0, p + 3], result[1, p + 3] = -h, g


@INNER_VECTOR
def polynomials(u, table):
    """Fill table (P, L) with the Chebyshev polynomials of u (L,), orders 0 to P - 1, P two at least."""
    zero, one = table[0], table[1]
    for i in range(np.uint64(len(u))):
        zero[i], one[i] = 1.0, u[i]
    for p in range(2, len(table)):
        older, old, own = table[p - 2], table[p - 1], table[p]
        for i in range(np.uint64(len(u))):
            own[i] = 2.0 * u[i] * old[i] - older[i]


@INNER_VECTOR
def sums_of(table, real, imag, count, result):
    """Fill result (2, P) as `sums` does, from polynomials table (P, L) that several sums share."""
    for p in range(0, len(table), BLOCK):
        a, b, c, d, e, f, g, h = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        one, two, three, four = table[p], table[p + 1], table[p + 2], table[p + 3]
        for i in range(np.uint64(count)):
            y, z = real[i], imag[i]
            a += one[i] * y
            b += one[i] * z
            c += two[i] * y
            d += two[i] * z
            e += three[i] * y
            f += three[i] * z
            g += four[i] * y
            h += four[i] * z
        result[0, p], result[1, p] = a, b
        result[0, p + 1], result[1, p + 1] = d, -c
        result[0, p + 2], result[1, p + 2] = -e, -f
        result[0, p + 3], result[1, p + 3] = -h, g


@VECTOR
def moments(strength, out, back, times, excess_a, excess_b, middle, half_cells, reach, work, lit, result):
    """Fill result (N, 2, Q, P) with real and imaginary parts of (-j)^p times the sum over points of z T_p(u).

    z = times strength out back, u the two-way range. out, back: (2, Q, N, L) at Q frequencies; strength: (N or 1, L);
    u counts from `middle` (N,), in cells as `reach`, and runs from -1 to 1 over `reach`. P is a multiple of BLOCK.
    Symbols without any strength are zero. work (SUM_ROWS, `padded` L), with P more rows for several frequencies, and
    lit (L,) int64: work space.
    """
    nodes, symbols = out.shape[1:3]
    u, real, imag, before, last, table = work[0], work[1], work[2], work[3], work[4], work[SUM_ROWS:]
    for n in range(symbols):
        own = strength[n % strength.shape[0]]
        # Points without strength are left out: of a group of points, all others. Gathering a point takes longer than
        # its sums.
        count = lit_points(own, lit)
        count = len(own) if count > DENSE * len(own) else count
        size = min(-(-count // LANES) * LANES, work.shape[1])
        for q in range(nodes):
            for p in range(result.shape[3]):
                result[n, 0, q, p], result[n, 1, q, p] = 0.0, 0.0
        if count == 0:
            continue
        for i in range(max(size - LANES, 0), size):
            u[i], real[i], imag[i] = 0.0, 0.0, 0.0
        places(excess_a[n], excess_b[n], middle[n], half_cells, reach, lit, count, u)
        if nodes > 1:
            polynomials(u[:size], table)
        for q in range(nodes):
            products(out[0, q, n], out[1, q, n], back[0, q, n], back[1, q, n], own, times, lit, count, real, imag)
            if nodes > 1:
                sums_of(table, real, imag, size, result[n, :, q])
            else:
                sums(u, real, imag, before, last, size, result.shape[3], result[n, :, q])
