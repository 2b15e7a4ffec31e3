"""Compiled kernels of the three spectra for windows that slide by one symbol.

Overlapping windows share sub-transforms. For a window of L = 2^a symbols, every level of the
decimation in time needs only one new sub-transform per start,
    A_0[q, t] = y[t]
    A_{s+1}[q, t] = A_s[q, t] + exp(-j 2 pi q d / P) A_s[q, t + d],   d = L / 2^(s+1)
so a window costs about 2 P butterflies, not P log2 L, and every loop runs over contiguous start
times. Only additions, products and square roots are used, in a fixed order and never fused: results
have the same bits on every machine with IEEE 754. The kernels work in the precision of their
arguments.
"""

import numpy as np

from lowalt.machine.jit import PLAIN
from lowalt.numerics.portable import sine_cosine_turns


def turns(points: int, dtype: type) -> tuple[np.ndarray, np.ndarray]:
    """Return cos and sin of -2 pi q / points, shape (points,) each, rounded once to `dtype`."""
    sine, cosine = sine_cosine_turns(-np.arange(points) / points)
    return cosine.astype(dtype), sine.astype(dtype)


@PLAIN
def _level(re, im, stride, cosine, sine, out_re, out_im):
    """One level of decimation in time.

    out_re and out_im get twice as many sub-spectra, by start time.
    """
    single = re.shape[0] == 1
    points = cosine.size
    rows = out_re.shape[0] // 2
    count = out_re.shape[1]
    for q in range(rows):
        c = cosine[(q * stride) % points]
        s = sine[(q * stride) % points]
        row = 0 if single else q
        a_re = re[row]
        a_im = im[row]
        for t in range(count):
            b_re = a_re[t + stride] * c - a_im[t + stride] * s
            b_im = a_re[t + stride] * s + a_im[t + stride] * c
            out_re[q, t] = a_re[t] + b_re
            out_im[q, t] = a_im[t] + b_im
            out_re[q + rows, t] = a_re[t] - b_re
            out_im[q + rows, t] = a_im[t] - b_im


@PLAIN
def _last(re, im, cosine, sine, out):
    """The last level (stride 1) straight to magnitudes."""
    single = re.shape[0] == 1
    rows = out.shape[0] // 2
    count = out.shape[1]
    for q in range(rows):
        c = cosine[q]
        s = sine[q]
        row = 0 if single else q
        a_re = re[row]
        a_im = im[row]
        plus = out[q]
        minus = out[q + rows]
        for t in range(count):
            b_re = a_re[t + 1] * c - a_im[t + 1] * s
            b_im = a_re[t + 1] * s + a_im[t + 1] * c
            x = a_re[t] + b_re
            y = a_im[t] + b_im
            plus[t] = np.sqrt(x * x + y * y)
            x = a_re[t] - b_re
            y = a_im[t] - b_im
            minus[t] = np.sqrt(x * x + y * y)


@PLAIN
def fourier_magnitudes(re, im, window, points, cosine, sine, out):
    """Fill out (points, count) with |FFT| of the windows that start at symbols 0 .. count - 1.

    re, im: (symbols,) parts of the signal, symbols >= count + window - 1; cosine, sine:
    `turns(points)`. Rows are in FFT order (zero frequency first). Source: paper, Eq. 26; spec of
    the windows in the module.
    """
    count = out.shape[1]
    stride = window // 2
    rows = points // window
    a_re = re.reshape((1, re.size))
    a_im = im.reshape((1, im.size))
    while stride > 1:
        starts = count + stride - 1
        b_re = np.empty((2 * rows, starts), re.dtype)
        b_im = np.empty((2 * rows, starts), re.dtype)
        _level(a_re, a_im, stride, cosine, sine, b_re, b_im)
        a_re = b_re
        a_im = b_im
        rows *= 2
        stride //= 2
    _last(a_re, a_im, cosine, sine, out)


@PLAIN
def transfer(re, im, window, cosine, sine, share, out):
    """Fill out (speeds, count) with the velocity-transfer spectrum of windows.

    They start at symbols 0 .. count - 1. re, im: (symbols,), symbols >= count + window; cosine,
    sine: (speeds, window + 1) of the conjugate dictionary; share: (1,), (L / (L + 1))^2 in the
    working precision. Source: paper, Eq. 30 to 35.
    """
    speeds, count = out.shape
    x = np.empty(count, re.dtype)
    y = np.empty(count, re.dtype)
    factor = share[0]
    for v in range(speeds):
        row = out[v]
        for t in range(count):
            x[t] = re[t]
            y[t] = im[t]
        for step in range(1, window):
            c = cosine[v, step]
            s = sine[v, step]
            for t in range(count):
                x[t] += re[t + step] * c - im[t + step] * s
                y[t] += re[t + step] * s + im[t + step] * c
        c = cosine[v, window]
        s = sine[v, window]
        for t in range(count):
            far_x = x[t] + (re[t + window] * c - im[t + window] * s)
            far_y = y[t] + (re[t + window] * s + im[t + window] * c)
            row[t] = (far_x * far_x + far_y * far_y) * factor - (x[t] * x[t] + y[t] * y[t])
