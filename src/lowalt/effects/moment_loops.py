"""The compiled loops between a target's points and all subcarriers: moments of the ranges, and their spectra."""

import math

import numpy as np

from lowalt.common.jit import INNER_VECTOR, VECTOR, kernel

LOOPS = kernel(error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
STRIDE = 16
"""Subcarriers that share one short phase ramp."""
BLOCK = 4
"""Orders that share a pass over the points."""


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
        at = lit[i]
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
        at = lit[i]
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


@VECTOR
def moments(strength, out, back, times, excess_a, excess_b, middle, half_cells, reach, work, lit, result):
    """Fill result (N, 2, Q, P) with real and imaginary parts of (-j)^p times the sum over points of z T_p(u).

    z = times strength out back, u the two-way range. out, back: (2, Q, N, L) at Q frequencies; strength: (N or 1, L);
    u counts from `middle` (N,), in cells as `reach`, and runs from -1 to 1 over `reach`. P is a multiple of BLOCK.
    Symbols without any strength are zero. work (5, L) and lit (L,) int64: work space.
    """
    nodes, symbols = out.shape[1:3]
    u, real, imag, before, last = work[0], work[1], work[2], work[3], work[4]
    for n in range(symbols):
        own = strength[n % strength.shape[0]]
        # Points without strength are left out: of a group of points, all others.
        count = lit_points(own, lit)
        for q in range(nodes):
            for p in range(result.shape[3]):
                result[n, 0, q, p], result[n, 1, q, p] = 0.0, 0.0
        if count > 0:
            places(excess_a[n], excess_b[n], middle[n], half_cells, reach, lit, count, u)
        for q in range(nodes if count else 0):
            products(out[0, q, n], out[1, q, n], back[0, q, n], back[1, q, n], own, times, lit, count, real, imag)
            sums(u, real, imag, before, last, count, result.shape[3], result[n, :, q])


@INNER_VECTOR
def turned(whole, cells, half_steps, total):
    """Phase factor of a delay by `whole` + `cells` range cells, `half_steps` halves of a subcarrier off the middle.

    Whole cells turn by multiples of pi / M, which are reduced in whole numbers.
    """
    index = whole % (2 * total) * half_steps % (2 * total)
    angle = math.pi * (cells * half_steps + index) / total
    return complex(math.cos(angle), -math.sin(angle))


@INNER_VECTOR
def halves(planes, table, work):
    """Fill work (4, H) with the sums over orders of planes (2, P) times table (P, M): even orders', then odd orders'.

    Rows: real and imaginary part. H = (M + 1) // 2 subcarriers from the lowest one; about the middle of the band the
    functions of even orders are even and those of odd orders are odd.
    """
    for parity in range(2):
        real, imag = work[2 * parity], work[2 * parity + 1]
        for m in range(np.uint64(len(real))):
            real[m], imag[m] = 0.0, 0.0
        for p in range(parity, table.shape[0], 4):
            # Two orders a pass over the subcarriers; the number of orders may be odd.
            q, more = (p + 2, 1.0) if p + 2 < table.shape[0] else (p, 0.0)
            one, two = table[p], table[q]
            a, b, c, d = planes[0, p], planes[1, p], more * planes[0, q], more * planes[1, q]
            for m in range(np.uint64(len(real))):
                real[m] += a * one[m] + c * two[m]
                imag[m] += b * one[m] + d * two[m]


@INNER_VECTOR
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


@INNER_VECTOR
def carried(response, data, tones):
    """Fill tones (M,) with a response (2, M), real and imaginary, times data (M,), in the order of `tone_loops`."""
    low = tones.size // 2
    real, imag, own, out = response[0, low:], response[1, low:], data[low:], tones[: tones.size - low]
    for m in range(np.uint64(len(out))):
        out[m] = complex(real[m], imag[m]) * own[m]
    real, imag, own, out = response[0, :low], response[1, :low], data[:low], tones[tones.size - low :]
    for m in range(np.uint64(len(out))):
        out[m] = complex(real[m], imag[m]) * own[m]


@VECTOR
def spread(planes, table, own, whole, cells, work, turn, sums, fresh, data, result):
    """Add own[n] times the response of moments (N, 2, P), real and imaginary, delayed, to result (N, M).

    table: (P, M) real, each order's values at the subcarriers, even or odd about the band's middle as the order is; the
    delay about the middle subcarrier is `whole` (N,) int64 plus `cells` (N,) range cells. With H = (M + 1) // 2, work
    (4, H), turn (2, H) and sums (2, M) are work space. Where `fresh` is set, result holds nothing yet and is filled,
    and with data (N, M), instead of (0, M), it is filled with the tones of symbols that carry them.
    """
    symbols, total = result.shape
    half = (total + 1) // 2
    for n in range(symbols):
        some = 0
        for p in range(planes.shape[2]):
            some += 1 if planes[n, 0, p] != 0.0 or planes[n, 1, p] != 0.0 else 0
        row = result[n]
        if some == 0:
            for m in range(np.uint64(total if fresh else 0)):
                row[m] = 0.0
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
        if fresh and len(data) > 0:
            carried(sums, data[n], row)
        elif fresh:
            for m in range(np.uint64(total)):
                row[m] = complex(low_re[m], low_im[m])
        else:
            for m in range(np.uint64(total)):
                row[m] += complex(low_re[m], low_im[m])
