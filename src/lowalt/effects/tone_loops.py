"""Compiled loops between responses, sent symbols and tones.

Tones stand in the transform's order: the oscillator's subcarrier and those above it first, then those below it.
"""

import math

import numpy as np

from lowalt.common.jit import INNER, LEAN

HALF = math.sqrt(0.5)
"""Size of both parts of a QPSK symbol of unit modulus."""


_EACH = np.uint64(0x0101010101010101)
"""One in each byte."""
_SEVEN, _ONE, _FULL = np.uint64(7), np.uint64(1), np.uint64(255)


@LEAN
def signs_of(words, re, im):
    """Fill re and im (K,), words of eight bytes, with 1 or -1 in each byte, as the upper two bits of words (K,) say.

    The highest bit of a byte is set in the lower half plane; where it differs from the next one, the symbol is on the
    left.
    """
    for k in range(len(words)):
        word = words[k]
        re[k] = (((word ^ (word << _ONE)) >> _SEVEN) & _EACH) * _FULL | _EACH
        im[k] = ((word >> _SEVEN) & _EACH) * _FULL | _EACH


@LEAN
def from_signs(signs, out):
    """Fill out (N, M) with the QPSK symbols whose real and imaginary parts have these signs, (2, N, M) int8."""
    for n in range(len(out)):
        row, re, im = out[n], signs[0, n], signs[1, n]
        for m in range(np.uint64(len(row))):
            row[m] = complex(HALF * re[m], HALF * im[m])


@LEAN
def carried(response, data, tones):
    """Fill tones (N, M) with response (N, M) times data (N, M), in the transform's order."""
    half = response.shape[1] // 2
    rest = response.shape[1] - half
    for n in range(len(response)):
        above, below, high, low = response[n, half:], response[n, :half], data[n, half:], data[n, :half]
        first, last = tones[n, :rest], tones[n, rest:]
        for m in range(np.uint64(rest)):
            first[m] = above[m] * high[m]
        for m in range(np.uint64(half)):
            last[m] = below[m] * low[m]


@INNER
def apart(given, data, n, re, im):
    """Fill re and im (256,) with the parts of symbol n's tones, in the transform's order.

    given: the tones (N, 256), or where data has rows, the responses that carry data (N, 256).
    """
    own = given[n]
    if len(data) == 0:
        for m in range(np.uint64(256)):
            re[m], im[m] = own[m].real, own[m].imag
        return
    sent, half = data[n], np.uint64(128)
    above, high, last_re, last_im = own[half:], sent[half:], re[half:], im[half:]
    for m in range(half):
        a, b, c, d = above[m].real, above[m].imag, high[m].real, high[m].imag
        re[m], im[m] = a * c - b * d, a * d + b * c
    for m in range(half):
        a, b, c, d = own[m].real, own[m].imag, sent[m].real, sent[m].imag
        last_re[m], last_im[m] = a * c - b * d, a * d + b * c


@LEAN
def divided(tones, data, fresh, response):
    """Add tones (N, M) in the transform's order, times the conjugate of data (N, M), to response (N, M).

    Where `fresh` is set, response holds nothing yet and is filled.
    """
    half = tones.shape[1] // 2
    rest = tones.shape[1] - half
    for n in range(len(tones)):
        first, last, high, low = tones[n, :rest], tones[n, rest:], data[n, half:], data[n, :half]
        above, below = response[n, half:], response[n, :half]
        if fresh:
            for m in range(np.uint64(rest)):
                above[m] = first[m] * complex(high[m].real, -high[m].imag)
            for m in range(np.uint64(half)):
                below[m] = last[m] * complex(low[m].real, -low[m].imag)
            continue
        for m in range(np.uint64(rest)):
            above[m] += first[m] * complex(high[m].real, -high[m].imag)
        for m in range(np.uint64(half)):
            below[m] += last[m] * complex(low[m].real, -low[m].imag)


@INNER
def _replaced(own, turns, old, new, out):
    """Fill out (K,) with own times (turns old - new), all (K,)."""
    for m in range(np.uint64(len(out))):
        a, b, c, d = turns[m].real, turns[m].imag, old[m].real, old[m].imag
        x, y = (a * c - b * d) - new[m].real, (a * d + b * c) - new[m].imag
        out[m] = complex(own[m].real * x - own[m].imag * y, own[m].real * y + own[m].imag * x)


@LEAN
def carried_before(response, turns, before, now, rows, tones):
    """Fill tones (K, M), in the transform's order, with the rows (K,) of response, (N, M), times (turns before - now).

    turns: (M,); before, now: (N, M), the data of the previous symbol and the symbol's own.
    """
    half = response.shape[1] // 2
    rest = response.shape[1] - half
    for k in range(len(rows)):
        own, old, new, out = response[rows[k]], before[rows[k]], now[rows[k]], tones[k]
        _replaced(own[half:], turns[half:], old[half:], new[half:], out[:rest])
        _replaced(own[:half], turns[:half], old[:half], new[:half], out[rest:])


@LEAN
def weighed(samples, shape, fresh, rows, total):
    """Add samples (K, M) times shape (I,), at the first I of each, to the rows (K,) of total (N, I or more).

    Where `fresh` is set, total holds nothing yet and is filled.
    """
    for n in range(len(samples)):
        row, out = samples[n], total[rows[n]]
        for i in range(np.uint64(len(shape) if fresh else 0)):
            out[i] = complex(row[i].real * shape[i], row[i].imag * shape[i])
        for i in range(np.uint64(0 if fresh else len(shape))):
            out[i] += complex(row[i].real * shape[i], row[i].imag * shape[i])
