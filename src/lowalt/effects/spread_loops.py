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
def six(plane, table, p, out):
    """Fill out (H,) with the sum of the orders p, p + 2, ... p + 10 of plane (P,) times table (P, M)."""
    one, two, three, four, five, last = table[p], table[p + 2], table[p + 4], table[p + 6], table[p + 8], table[p + 10]
    a, b, c, d, e, f = plane[p], plane[p + 2], plane[p + 4], plane[p + 6], plane[p + 8], plane[p + 10]
    for m in range(np.uint64(len(out))):
        out[m] = a * one[m] + b * two[m] + c * three[m] + d * four[m] + e * five[m] + f * last[m]


@INNER_VECTOR
def halves(planes, table, work):
    """Fill work (4, H) with the sums over orders of planes (2, P) times table (P, M): even orders', then odd orders'.

    Rows: real and imaginary part. H = (M + 1) // 2 subcarriers from the lowest one; about the middle of the band the
    functions of even orders are even and those of odd orders are odd.
    """
    count = table.shape[0]
    for parity in range(2):
        real, imag, p = work[2 * parity], work[2 * parity + 1], parity
        # Six orders in the first pass over the subcarriers, then four, then two; the number of orders may be odd.
        if p + 10 < count:
            six(planes[0], table, p, real)
            six(planes[1], table, p, imag)
            p += 12
        else:
            for m in range(np.uint64(len(real))):
                real[m], imag[m] = 0.0, 0.0
        while p + 6 < count:
            one, two, three, four = table[p], table[p + 2], table[p + 4], table[p + 6]
            a, b, c, d = planes[0, p], planes[0, p + 2], planes[0, p + 4], planes[0, p + 6]
            e, f, g, h = planes[1, p], planes[1, p + 2], planes[1, p + 4], planes[1, p + 6]
            for m in range(np.uint64(len(real))):
                real[m] = real[m] + a * one[m] + b * two[m] + c * three[m] + d * four[m]
                imag[m] = imag[m] + e * one[m] + f * two[m] + g * three[m] + h * four[m]
            p += 8
        while p < count:
            q, more = (p + 2, 1.0) if p + 2 < count else (p, 0.0)
            one, two = table[p], table[q]
            a, b, c, d = planes[0, p], planes[1, p], more * planes[0, q], more * planes[1, q]
            for m in range(np.uint64(len(real))):
                real[m] += a * one[m] + c * two[m]
                imag[m] += b * one[m] + d * two[m]
            p += 4


@INNER_VECTOR
def _widened(factor, size, real, imag):
    """Fill real, imag (H,) from their first `size` phase factors, each later one being `factor` times that `size` ago.

    The filled part doubles at every step, so that few roundings add up.
    """
    while size < len(real):
        more = min(size, len(real) - size)
        given_re, given_im = real[:more], imag[:more]
        new_re, new_im = real[size : size + more], imag[size : size + more]
        x, y = factor.real, factor.imag
        for k in range(np.uint64(more)):
            new_re[k], new_im[k] = given_re[k] * x - given_im[k] * y, given_re[k] * y + given_im[k] * x
        factor *= factor
        size *= 2


@INNER_VECTOR
def ramp(start, step, real, imag):
    """Fill real, imag (H,) with the phase factors start, start step[0], start step[0]^2, ..., to rounding.

    step[1]: step[0]^STRIDE, to rounding.
    """
    real[0], imag[0] = start.real, start.imag
    few = min(STRIDE, len(real))
    _widened(step[0], 1, real[:few], imag[:few])
    _widened(step[1], STRIDE, real, imag)


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


@INNER_VECTOR
def spread_symbol(planes, table, own, whole, cells, work, turn, sums):
    """Fill sums (2, M) with one symbol's response from its moments (2, P), as in `spread`; return whether it has any.

    own, whole, cells: those of the symbol.
    """
    total, some = sums.shape[1], 0
    half = (total + 1) // 2
    for p in range(planes.shape[1]):
        some += 1 if planes[0, p] != 0.0 or planes[1, p] != 0.0 else 0
    if some == 0:
        return False
    halves(planes, table, work)
    even_re, even_im, odd_re, odd_im = work[0], work[1], work[2], work[3]
    step = turned(whole, cells, 2, total), turned(whole, cells, 2 * STRIDE, total)
    ramp(turned(whole, cells, 1 - total, total), step, turn[0], turn[1])
    re, im, x, y = turn[0], turn[1], own.real, own.imag
    low_re, low_im, last = sums[0], sums[1], np.uint64(total - 1)
    for m in range(np.uint64(half)):
        a, b, c, d = even_re[m] + odd_re[m], even_im[m] + odd_im[m], x * re[m] - y * im[m], x * im[m] + y * re[m]
        low_re[m], low_im[m] = a * c - b * d, a * d + b * c
    # Above the middle the odd orders and the delay's phase change their signs.
    for m in range(np.uint64(total - half)):
        a, b, c, d = even_re[m] - odd_re[m], even_im[m] - odd_im[m], x * re[m] + y * im[m], y * re[m] - x * im[m]
        low_re[last - m], low_im[last - m] = a * c - b * d, a * d + b * c
    return True


@VECTOR
def spread(planes, table, own, whole, cells, work, turn, sums, fresh, data, result):
    """Add own[n] times the response of moments (N, 2, P), real and imaginary, delayed, to result (N, M).

    table: (P, M) real, each order's values at the subcarriers, even or odd about the band's middle as the order is; the
    delay about the middle subcarrier is `whole` (N,) int64 plus `cells` (N,) range cells. With H = (M + 1) // 2, work
    (4, H), turn (2, H) and sums (2, M) are work space. Where `fresh` is set, result holds nothing yet and is filled,
    and with data (N, M), instead of (0, M), it is filled with the tones of symbols that carry them.
    """
    symbols, total = result.shape
    for n in range(symbols):
        row = result[n]
        if not spread_symbol(planes[n], table, own[n], whole[n], cells[n], work, turn, sums):
            for m in range(np.uint64(total if fresh else 0)):
                row[m] = 0.0
            continue
        low_re, low_im = sums[0], sums[1]
        if fresh and len(data) > 0:
            carried(sums, data[n], row)
        elif fresh:
            for m in range(np.uint64(total)):
                row[m] = complex(low_re[m], low_im[m])
        else:
            for m in range(np.uint64(total)):
                row[m] += complex(low_re[m], low_im[m])
