"""The strongest range cells of a look behind a receiver, worked out one by one where only few can be the strongest."""

import math

import numpy as np

from lowalt.common.jit import INNER, INNER_VECTOR, LEAN

MOST = 8
"""Range cells of a symbol that are worked out one by one; a transform gives all cells in the time of about as many."""
ROOM = 1e-7
"""Share of a symbol's magnitude added to the bound on its cells: a difference of squares loses half the digits."""


@INNER_VECTOR
def _apart(before, after):
    """The gain from a symbol before (M,) to after (M,) that fits best, and the root of the squares that remain."""
    own, new, re, im = 0.0, 0.0, 0.0, 0.0
    for m in range(np.uint64(len(before))):
        a, b, c, d = before[m].real, before[m].imag, after[m].real, after[m].imag
        own += a * a + b * b
        new += c * c + d * d
        re += a * c + b * d
        im += a * d - b * c
    cross = re * re + im * im
    if own == 0.0:
        return 0.0, math.sqrt(new)
    return math.sqrt(cross) / own, math.sqrt(max(new - cross / own, 0.0)) + ROOM * math.sqrt(new)


@INNER
def _cell(response, wave, q):
    """Range cell q of a response (M,); four sums run next to each other, each in the order of the subcarriers."""
    count = len(response)
    re0, re1, im0, im1, place = 0.0, 0.0, 0.0, 0.0, 0
    for m in range(0, count - 1, 2):
        z, w = response[m], wave[place]
        place += q
        place -= count if place >= count else 0
        re0 += z.real * w.real - z.imag * w.imag
        im0 += z.real * w.imag + z.imag * w.real
        z, w = response[m + 1], wave[place]
        place += q
        place -= count if place >= count else 0
        re1 += z.real * w.real - z.imag * w.imag
        im1 += z.real * w.imag + z.imag * w.real
    last = response[count - 1] * wave[place] if count % 2 else 0.0j
    return (complex(re0 + re1, im0 + im1) + last) / count


@LEAN
def contested(before, after, sizes, best, wave, value, cell):
    """Fill value and cell (N,) with the strongest range cell of responses after (N, M); return whether few are left.

    before: responses (N, M) whose cells have the magnitudes sizes (N, M), the largest in best (N,); wave:
    exp(j 2 pi k / M) for k < M. What of a symbol after fits no multiple of the symbol before has a known length. A cell
    is a scalar product with a vector of length M^(-1/2), so no cell's magnitude differs from the multiple's by more
    than that length over sqrt(M). Only cells that can be the strongest are worked out. Symbols with more than MOST of
    them are left, with cell -1; once more than a quarter of the look and 16 are left, the loop gives up.
    """
    symbols, count = after.shape
    left = 0
    for n in range(symbols):
        cell[n] = -1
        gain, rest = _apart(before[n], after[n])
        least = gain * sizes[n, best[n]] - 2.0 * rest / math.sqrt(count)
        many = 0
        for q in range(np.uint64(count)):
            many += 1 if gain * sizes[n, q] >= least else 0
        if many > MOST:
            left += 1
            if 4 * left > symbols + 64:
                return False
            continue
        top, q = -1.0, best[n] if many == 1 else 0
        while many > 0:
            if gain * sizes[n, q] >= least:
                many -= 1
                found = _cell(after[n], wave, q)
                size = math.sqrt(found.real * found.real + found.imag * found.imag)
                if size > top:
                    top, value[n], cell[n] = size, found, q
            q += 1
    return True


def strongest(
    before: np.ndarray, sizes: np.ndarray, best: np.ndarray, after: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Return the strongest range cells of responses `after` (N, M): their values (N,) and numbers (N,).

    before: responses (N, M) that differ little from them; sizes (N, M) and best (N,): the magnitudes of their cells and
    the numbers of the largest. None where the two differ too much for this to save time. Source: Cauchy and Schwarz's
    inequality.
    """
    symbols, count = after.shape
    wave = np.exp(2j * np.pi * np.arange(count) / count)
    value, cell = np.empty(symbols, np.complex128), np.empty(symbols, np.int64)
    if not contested(before, after, sizes, best, wave, value, cell):
        return None
    rest = np.flatnonzero(cell < 0)
    if len(rest):
        cells = np.fft.ifft(after[rest], axis=1)
        cell[rest] = abs(cells).argmax(axis=1)
        value[rest] = cells[np.arange(len(rest)), cell[rest]]
    return value, cell
