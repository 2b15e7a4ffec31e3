"""The compiled loop from a time series' moments to a symbol's response and samples, one symbol after another.

All orders of a symbol share the phases of its delay, and what stands between moments and samples stays in the nearest
cache: only data are read, and response and samples written.
"""

import math

import numpy as np

from lowalt.common.jit import INNER_VECTOR, LEAN, VECTOR
from lowalt.effects.spread_loops import STRIDE, halves, ramp, turned
from lowalt.effects.transform_loops import LENGTH, transformed

HALF = LENGTH // 2


@LEAN
def largest(planes, result):
    """Fill result (K, P) with the largest magnitude over symbols of moments planes (K, N, 2, P)."""
    for k in range(planes.shape[0]):
        most = result[k]
        for p in range(len(most)):
            most[p] = 0.0
        for n in range(planes.shape[1]):
            for p in range(len(most)):
                real, imag = planes[k, n, 0, p], planes[k, n, 1, p]
                most[p] = max(most[p], real * real + imag * imag)
        for p in range(len(most)):
            most[p] = math.sqrt(most[p])


@INNER_VECTOR
def factors(own, turn, data, delay, tones):
    """Fill delay (4, 128) with own times the phases turn (2, 128) of a delay, and tones (4, 128) with these times data.

    Rows: real and imaginary parts of the lowest subcarriers, then of the highest ones from the last one down, where the
    phases change their signs. data: (256,).
    """
    x, y, re, im, last = own.real, own.imag, turn[0], turn[1], np.uint64(LENGTH - 1)
    one, two, three, four, a, b, e, f = delay[0], delay[1], delay[2], delay[3], tones[0], tones[1], tones[2], tones[3]
    for m in range(np.uint64(HALF)):
        c, d, v = x * re[m] - y * im[m], x * im[m] + y * re[m], data[m]
        one[m], two[m], a[m], b[m] = c, d, c * v.real - d * v.imag, c * v.imag + d * v.real
        c, d, v = x * re[m] + y * im[m], y * re[m] - x * im[m], data[last - m]
        three[m], four[m], e[m], f[m] = c, d, c * v.real - d * v.imag, c * v.imag + d * v.real


@INNER_VECTOR
def multiplied(parts, factor, low_re, low_im, high_re, high_im):
    """Fill low and high (128,), parts of subcarriers in rising order, with sums of `halves` times `factors`."""
    even_re, even_im, odd_re, odd_im, last = parts[0], parts[1], parts[2], parts[3], np.uint64(HALF - 1)
    one, two, three, four = factor[0], factor[1], factor[2], factor[3]
    for m in range(np.uint64(HALF)):
        a, b, c, d = even_re[m] + odd_re[m], even_im[m] + odd_im[m], one[m], two[m]
        low_re[m], low_im[m] = a * c - b * d, a * d + b * c
    # Above the middle the odd orders change their signs.
    for m in range(np.uint64(HALF)):
        a, b, c, d = even_re[m] - odd_re[m], even_im[m] - odd_im[m], three[m], four[m]
        high_re[last - m], high_im[last - m] = a * c - b * d, a * d + b * c


@INNER_VECTOR
def weighed(real, imag, shape, re, im):
    """Add shape times real and imag to re and im, (256,) each."""
    for i in range(np.uint64(LENGTH)):
        re[i] += shape[i] * real[i]
        im[i] += shape[i] * imag[i]


@VECTOR
def arrived(planes, sizes, table, own, whole, cells, data, shapes, waves, halved, rows, still, samples):
    """Fill still (N, 256) with the response of order zero in time, and samples (N, 256) with those of all others.

    planes: moments (K, N, 2, P), of which the first sizes[k] of each order count; table, own, whole, cells: as in
    `spread_loops.spread`; data: (N, 256); shapes: (K, 256), each order's Chebyshev polynomial at the samples over 256;
    waves: `transform_loops.turns`. halved (14, 128), rows (8, 256): work space.
    """
    parts, turn, delay, tones = halved[0:4], halved[4:6], halved[6:10], halved[10:14]
    re, im, one, two, three, four = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    real, imag = rows[6], rows[7]
    for n in range(len(still)):
        step = turned(whole[n], cells[n], 2, LENGTH), turned(whole[n], cells[n], 2 * STRIDE, LENGTH)
        ramp(turned(whole[n], cells[n], 1 - LENGTH, LENGTH), step, turn[0], turn[1])
        factors(own[n], turn, data[n], delay, tones)
        for i in range(np.uint64(LENGTH)):
            re[i], im[i] = 0.0, 0.0
        for k in range(len(planes) - 1, 0, -1):
            halves(planes[k, n], table[: sizes[k]], parts)
            # In the order of `tone_loops`. Real and imaginary parts change places: the transform is the inverse one.
            multiplied(parts, tones, two[HALF:], one[HALF:], two[:HALF], one[:HALF])
            transformed(one, two, three, four, waves)
            weighed(four, three, shapes[k], re, im)
        halves(planes[0, n], table[: sizes[0]], parts)
        multiplied(parts, delay, real[:HALF], imag[:HALF], real[HALF:], imag[HALF:])
        response, out = still[n], samples[n]
        for m in range(np.uint64(LENGTH)):
            response[m], out[m] = complex(real[m], imag[m]), complex(re[m], im[m])
