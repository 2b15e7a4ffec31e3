"""The strongest range cell of every symbol, worked out from few cells where no other one can be stronger.

A target fills few range cells, and moves by much less than one from symbol to symbol. So the search starts at the cell
before, and walks to the largest one. By Parseval's theorem the power of all M cells together is known from the response
alone. What the cells worked out leave of it bounds every other cell; where it is less than the strongest one's power,
that cell is the strongest of all.
"""

from functools import lru_cache

import numpy as np

from lowalt.common.jit import INNER_VECTOR, VECTOR
from lowalt.common.memory import aligned
from lowalt.effects import transforms, waveform
from lowalt.effects.tone_loops import HALF

MOST = 8
"""Range cells of a symbol that are worked out one by one; a transform gives all cells in the time of about as many."""
FEWEST = 16
"""Least number of range cells for a search; a transform of so few takes no longer."""
SLOTS = 16
"""Range cells whose phase factors are held, a power of two of at least MOST."""
ROOM = 1e-12
"""Share of a symbol's power added to what its cells leave: a difference keeps the rounding of its parts."""


@lru_cache(maxsize=16)
def _wave(count: int) -> np.ndarray:
    """Cosine and sine (2, M) of 2 pi k / M for k < M."""
    turned = np.exp(2j * np.pi * np.arange(count) / count)
    return np.stack([turned.real, turned.imag])


@INNER_VECTOR
def _without(tones, x, y, re, im):
    """Fill re and im (K,) with tones (K,) times the conjugate of QPSK symbols of signs x and y (K,)."""
    for m in range(np.uint64(len(re))):
        a, b, c, d = tones[m].real, tones[m].imag, HALF * x[m], HALF * y[m]
        re[m], im[m] = a * c + b * d, b * c - a * d


@INNER_VECTOR
def power(parts):
    """Sum of the squares of parts (2, M)."""
    re, im, total = parts[0], parts[1], 0.0
    for m in range(np.uint64(len(re))):
        total += re[m] * re[m] + im[m] * im[m]
    return total


@INNER_VECTOR
def taken(row, parts):
    """Fill parts (2, M) with real and imaginary parts of a response (M,), and return the sum of its squares."""
    re, im = parts[0], parts[1]
    for m in range(np.uint64(len(row))):
        re[m], im[m] = row[m].real, row[m].imag
    return power(parts)


@INNER_VECTOR
def taken_without(tones, x, y, parts):
    """Fill parts as `taken` does with the response of tones (M,), in the transform's order, of symbols of signs x, y.

    x, y: (M,) int8, of the real and imaginary parts of the QPSK symbols that the tones carried.
    """
    count, re, im = len(tones), parts[0], parts[1]
    half = count // 2
    _without(tones, x[half:], y[half:], re[half:], im[half:])
    _without(tones[count - half :], x, y, re[:half], im[:half])
    return power(parts)


@INNER_VECTOR
def _cell(parts, q, wave, held, rows):
    """Range cell q of a response in parts (2, M); rows (SLOTS, 2, M): phase factors of the cells in held (SLOTS,)."""
    count = parts.shape[1]
    slot = q % SLOTS
    own = rows[slot]
    if held[slot] != q:
        held[slot], place = q, 0
        for m in range(count):
            own[0, m], own[1, m] = wave[0, place], wave[1, place]
            place += q
            place -= count if place >= count else 0
    re, im, c, s = parts[0], parts[1], own[0], own[1]
    x, y = 0.0, 0.0
    for m in range(np.uint64(count)):
        x += re[m] * c[m] - im[m] * s[m]
        y += re[m] * s[m] + im[m] * c[m]
    return complex(x / count, y / count)


@INNER_VECTOR
def walked(parts, near, n, total, clear, wave, held, rows, seen):
    """Work out range cells round `near` until all others are smaller by `clear`, or MOST of them.

    total: power of all cells together; n: the symbol's number. seen (SLOTS,) gets the value of cell q at q % SLOTS, for
    q from the first to the last one returned, modulo M. Returns these two, the largest one, and the power left.
    """
    count = parts.shape[1]
    first, last, best, top, rest = near, near - 1, near, -1.0, (1.0 + ROOM) * total
    # Where no cells as large as the strongest could make it certain, no more are worked out.
    while last < first or (
        not (top > rest and (clear == 0.0 or np.sqrt(top) - np.sqrt(max(rest, 0.0)) > clear))
        and last - first + 1 < MOST
        and rest < MOST * top
    ):
        q = last + 1
        if last - best > best - first or (last - best == best - first and last > first and n % 2):
            q = first - 1
        first, last = min(first, q), max(last, q)
        z = _cell(parts, q % count, wave, held, rows)
        seen[q % SLOTS] = z
        size = z.real * z.real + z.imag * z.imag
        rest -= size
        # Of equal cells the lowest counts, as in a transform's maximum.
        if size > top or (size == top and q % count < best % count):
            top, best = size, q
    return first, last, best, top, rest


@INNER_VECTOR
def settled(parts, near, n, total, space, value, cell):
    """Set value and cell, (N,), of symbol n to its strongest range cell, -1 where it is not certain; see `walked`.

    parts, near, total: as in `walked`; space: of `space`. Returns a cell near the next symbol's, and 1 if not certain.
    """
    wave, _, held, rows, seen = space
    _, _, best, top, rest = walked(parts, near, n, total, 0.0, wave, held, rows, seen)
    value[n], near = seen[best % SLOTS], best % parts.shape[1]
    cell[n] = near if total > 0.0 else 0
    if total > 0.0 and not top > rest:
        cell[n] = -1
        return near, 1
    return near, 0


@VECTOR
def found(responses, signs, start, guessed, space, value, cell):
    """Fill value and cell (N,) with the strongest range cells of responses (N, M); return whether few are left.

    signs: (2, N, M) where `responses` are tones, as in `taken_without`, else (2, 0, M); start: a cell near the first
    symbol's; space: of `space`. Symbols whose strongest cell is not certain after MOST cells are left, with cell -1;
    once more than a quarter of the look and 16 are left, or the first one where its start is `guessed`, the loop gives
    up.
    """
    symbols, count = responses.shape
    parts, left, near = space[1], 0, start
    for n in range(symbols):
        row = responses[n]
        total = taken_without(row, signs[0, n], signs[1, n], parts) if signs.shape[1] > 0 else taken(row, parts)
        total /= count
        near, uncertain = settled(parts, near, n, total, space, value, cell)
        left += uncertain
        if uncertain and (4 * left > symbols + 64 or (guessed and n == 0)):
            return False
    return True


def space(count: int) -> tuple[np.ndarray, ...]:
    """Return the table and the work space of a search among `count` range cells, as `walked` takes them."""
    # No cell's phase factors are held yet.
    held, rows = np.full(SLOTS, -1), aligned(SLOTS, 2, count)
    return _wave(count), aligned(2, count), held, rows, np.empty(SLOTS, np.complex128)


def strongest(
    responses: np.ndarray, signs: np.ndarray | None = None, near: int | None = None
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return the strongest range cells of responses (N, M): their values (N,) and numbers (N,).

    signs: (2, N, M) int8, where `responses` are the tones (`waveform.tones_of`) of symbols that carried such QPSK data;
    near: a cell that is probably near the first symbol's, None where none is known. Source: Parseval's theorem.
    """
    symbols, count = responses.shape
    value, cell = np.empty(symbols, np.complex128), np.full(symbols, -1)
    given = np.empty((2, 0, count), np.int8) if signs is None else np.ascontiguousarray(signs)
    if count >= FEWEST and symbols > 0:
        whole, work = np.ascontiguousarray(responses), space(count)
        if near is not None:
            found(whole, given, near, True, work, value, cell)
        # Far from the strongest cell, a search of the first symbol settles nothing.
        if near is None or cell[0] < 0:
            start = int(abs(_cells(responses[:1], given[:, :1])).argmax())
            found(whole, given, start, False, work, value, cell)
    rest = np.flatnonzero(cell < 0)
    if len(rest):
        rows = slice(None) if len(rest) == symbols else rest
        fill(responses[rows], given[:, rows] if given.shape[1] else given, rest, value, cell)
    return value, cell


def fill(responses: np.ndarray, signs: np.ndarray, rows: np.ndarray, value: np.ndarray, cell: np.ndarray) -> None:
    """Set value and cell, (N,), at `rows` (K,), from all range cells of responses (K, M), or of tones of `signs`."""
    cells = _cells(responses, signs)
    cell[rows] = abs(cells).argmax(axis=1)
    value[rows] = cells[np.arange(len(rows)), cell[rows]]


def _cells(responses: np.ndarray, signs: np.ndarray) -> np.ndarray:
    """All range cells (N, M) of responses, or of tones that carried the data of `signs`."""
    if signs.shape[1]:
        responses = waveform.without(responses, waveform.of_signs(signs))
    return transforms.inverse(responses)
