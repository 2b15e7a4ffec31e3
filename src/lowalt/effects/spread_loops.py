"""The compiled loops from moments of a target's ranges to all subcarriers."""

import math

import numpy as np

from lowalt.common.jit import INNER_VECTOR, VECTOR

STRIDE = 16
"""Subcarriers that share one short phase ramp."""


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
        p = parity
        # Four orders a pass over the subcarriers, then two; the number of orders may be odd.
        while p + 6 < table.shape[0]:
            one, two, three, four = table[p], table[p + 2], table[p + 4], table[p + 6]
            a, b, c, d = planes[0, p], planes[0, p + 2], planes[0, p + 4], planes[0, p + 6]
            e, f, g, h = planes[1, p], planes[1, p + 2], planes[1, p + 4], planes[1, p + 6]
            for m in range(np.uint64(len(real))):
                real[m] += (a * one[m] + b * two[m]) + (c * three[m] + d * four[m])
                imag[m] += (e * one[m] + f * two[m]) + (g * three[m] + h * four[m])
            p += 8
        while p < table.shape[0]:
            q, more = (p + 2, 1.0) if p + 2 < table.shape[0] else (p, 0.0)
            one, two = table[p], table[q]
            a, b, c, d = planes[0, p], planes[1, p], more * planes[0, q], more * planes[1, q]
            for m in range(np.uint64(len(real))):
                real[m] += a * one[m] + c * two[m]
                imag[m] += b * one[m] + d * two[m]
            p += 4


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
def largest(planes, peaks):
    """Return the largest sum over orders of the magnitudes of planes (N, 2, P), real and imaginary, times peaks (P,).

    Without symbols that is zero.
    """
    most = 0.0
    for n in range(len(planes)):
        real, imag, total = planes[n, 0], planes[n, 1], 0.0
        for p in range(np.uint64(len(peaks))):
            total += math.sqrt(real[p] * real[p] + imag[p] * imag[p]) * peaks[p]
        most = max(most, total)
    return most


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
        low_re, low_im, last = sums[0], sums[1], np.uint64(total - 1)
        for m in range(np.uint64(half)):
            a, b, c, d = even_re[m] + odd_re[m], even_im[m] + odd_im[m], x * re[m] - y * im[m], x * im[m] + y * re[m]
            low_re[m], low_im[m] = a * c - b * d, a * d + b * c
        # Above the middle the odd orders and the delay's phase change their signs.
        for m in range(np.uint64(total - half)):
            a, b, c, d = even_re[m] - odd_re[m], even_im[m] - odd_im[m], x * re[m] + y * im[m], y * re[m] - x * im[m]
            low_re[last - m], low_im[last - m] = a * c - b * d, a * d + b * c
        if fresh and len(data) > 0:
            carried(sums, data[n], row)
        elif fresh:
            for m in range(np.uint64(total)):
                row[m] = complex(low_re[m], low_im[m])
        else:
            for m in range(np.uint64(total)):
                row[m] += complex(low_re[m], low_im[m])
