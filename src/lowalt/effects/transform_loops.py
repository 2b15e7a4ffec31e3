"""The compiled Fourier transform of a row of 256 numbers, which stays in the nearest cache with all its steps.

Real and imaginary parts stand apart. The row is a table of 16 rows of 16: its columns are transformed in two steps of
four, turned and set as rows, and the columns of the new table are transformed. All lengths and distances are written
out: only then does the compiler see that the rows of a step do not overlap, and makes vector instructions. Every
operation is done as written, so the result has the same bits on every processor.
Source: Bailey, FFTs in external or hierarchical memory, J. Supercomputing 4, 1990; steps sort as Stockham's do.
"""

import numpy as np

from lowalt.common.jit import INLINED, INNER, LEAN
from lowalt.effects.tone_loops import apart

LENGTH = 256
QUARTER, HALF, REST = np.uint64(64), np.uint64(128), np.uint64(192)
WIDE, FOUR = np.uint64(16), np.uint64(4)
ONE, TWO, THREE = np.uint64(1), np.uint64(2), np.uint64(3)


def turns() -> np.ndarray:
    """Return the table (4, 256) that `transformed` takes: cosine and sine of -2 pi k / 256, for steps and between."""
    wave = np.exp(-2j * np.pi * np.arange(LENGTH) / LENGTH)
    place = np.arange(LENGTH)
    # Behind the first steps, number j of row k of 16 stands at k's lower two bits, j, and k's upper two bits.
    row, column = 4 * (place % 4) + place // 64, place // 4 % 16
    between = wave[row * column]
    return np.stack([wave.real, wave.imag, between.real, between.imag])


@INLINED
def _four(re, im, i):
    """Sums and differences of four numbers 64 apart, from the i-th on: real and imaginary parts of four."""
    ar, br, cr, dr = re[i], re[i + QUARTER], re[i + HALF], re[i + REST]
    ai, bi, ci, di = im[i], im[i + QUARTER], im[i + HALF], im[i + REST]
    er, ei, fr, fi = ar + cr, ai + ci, ar - cr, ai - ci
    gr, gi, hr, hi = br + dr, bi + di, br - dr, bi - di
    return er + gr, ei + gi, fr + hi, fi - hr, er - gr, ei - gi, fr - hi, fi + hr


@INLINED
def _first(re, im, out_re, out_im, wave_re, wave_im):
    """The first step of four of a table's columns, 16 of 16 numbers."""
    for p in range(4):
        c1, s1, c2, s2 = wave_re[16 * p], wave_im[16 * p], wave_re[32 * p], wave_im[32 * p]
        c3, s3 = wave_re[48 * p], wave_im[48 * p]
        for q in range(WIDE):
            ar, ai, br, bi, cr, ci, dr, di = _four(re, im, np.uint64(16 * p) + q)
            to = np.uint64(64 * p) + q
            out_re[to], out_im[to] = ar, ai
            out_re[to + WIDE], out_im[to + WIDE] = br * c1 - bi * s1, br * s1 + bi * c1
            to += TWO * WIDE
            out_re[to], out_im[to] = cr * c2 - ci * s2, cr * s2 + ci * c2
            out_re[to + WIDE], out_im[to + WIDE] = dr * c3 - di * s3, dr * s3 + di * c3


@INLINED
def _second(re, im, out_re, out_im):
    """The second step of the columns."""
    for q in range(QUARTER):
        ar, ai, br, bi, cr, ci, dr, di = _four(re, im, q)
        out_re[q], out_re[q + QUARTER], out_re[q + HALF], out_re[q + REST] = ar, br, cr, dr
        out_im[q], out_im[q + QUARTER], out_im[q + HALF], out_im[q + REST] = ai, bi, ci, di


@INLINED
def _second_together(re, im, out_re, out_im):
    """The second step of the columns; four numbers 64 apart are set side by side."""
    for q in range(QUARTER):
        ar, ai, br, bi, cr, ci, dr, di = _four(re, im, q)
        to = FOUR * q
        out_re[to], out_re[to + ONE], out_re[to + TWO], out_re[to + THREE] = ar, br, cr, dr
        out_im[to], out_im[to + ONE], out_im[to + TWO], out_im[to + THREE] = ai, bi, ci, di


@INLINED
def _between(re, im, out_re, out_im, turn_re, turn_im):
    """Turn all numbers, and set four numbers 64 apart side by side: done twice, this sets columns as rows."""
    for q in range(QUARTER):
        to = FOUR * q
        for k in range(4):
            i = q + np.uint64(64 * k)
            a, b, c, s = re[i], im[i], turn_re[i], turn_im[i]
            out_re[to + np.uint64(k)] = a * c - b * s
            out_im[to + np.uint64(k)] = a * s + b * c


@INNER
def transformed(re, im, out_re, out_im, table):
    """Fill out_re and out_im (256,) with the transform of re + j im (256,), which are overwritten; table: `turns`.

    Where real and imaginary parts change places before and after, it is the inverse transform times 256.
    """
    wave_re, wave_im = table[0], table[1]
    _first(re, im, out_re, out_im, wave_re, wave_im)
    _second_together(out_re, out_im, re, im)
    _between(re, im, out_re, out_im, table[2], table[3])
    _first(out_re, out_im, re, im, wave_re, wave_im)
    _second(re, im, out_re, out_im)


@LEAN
def rows(given, inverse, scale, table, work, result):
    """Fill result (N, 256) with scale times the transforms of given (N, 256), or times those with the other sign.

    result may be given itself; work: (4, 256).
    """
    one, other = (1, 0) if inverse else (0, 1)
    for n in range(len(given)):
        row, out, re, im = given[n], result[n], work[one], work[other]
        for m in range(np.uint64(LENGTH)):
            re[m], im[m] = row[m].real, row[m].imag
        transformed(work[0], work[1], work[2], work[3], table)
        re, im = work[2 + one], work[2 + other]
        for m in range(np.uint64(LENGTH)):
            out[m] = complex(scale * re[m], scale * im[m])


@LEAN
def sampled(response, data, table, work, out):
    """Fill out (N, 256) with the samples of responses (N, 256) that carry data (N, 256); work: (4, 256).

    Tones are never held together. table: `turns`.
    """
    scale = 1.0 / LENGTH
    re, im, new_re, new_im = work[0], work[1], work[2], work[3]
    for n in range(len(response)):
        row = out[n]
        apart(response, data, n, re, im)
        transformed(im, re, new_im, new_re, table)
        for m in range(np.uint64(LENGTH)):
            row[m] = complex(scale * new_re[m], scale * new_im[m])


@LEAN
def turned(given, turns, table, work, out):
    """Fill out (N, 256) with the samples of given (N, 256) times turns (256,) complex; work: (4, 256).

    Both begin at the lowest subcarrier; tones are never held together. table: `turns`.
    """
    half, scale = np.uint64(HALF), 1.0 / LENGTH
    re, im, new_re, new_im = work[0], work[1], work[2], work[3]
    high, low, last_re, last_im = turns[half:], turns[:half], re[half:], im[half:]
    for n in range(len(given)):
        above, below, row = given[n, half:], given[n, :half], out[n]
        for m in range(half):
            a, b, c, d = above[m].real, above[m].imag, high[m].real, high[m].imag
            re[m], im[m] = a * c - b * d, a * d + b * c
        for m in range(half):
            a, b, c, d = below[m].real, below[m].imag, low[m].real, low[m].imag
            last_re[m], last_im[m] = a * c - b * d, a * d + b * c
        transformed(im, re, new_im, new_re, table)
        for m in range(np.uint64(LENGTH)):
            row[m] = complex(scale * new_re[m], scale * new_im[m])
