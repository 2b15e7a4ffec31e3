"""White noise in all range cells of a look, and the strongest cells in it, for which few of its numbers are made.

Where data have unit modulus, white noise of the samples is white noise of the range cells, so it is drawn there. How
large a number is follows from one random word alone, and no number is larger than LARGEST. What a cell holds besides
noise is bounded by the power that the cells worked out leave. So most cells are settled by comparing a word to a limit.
"""

import math
from functools import cached_property

import numpy as np

from lowalt.common.jit import INNER, INNER_VECTOR, VECTOR
from lowalt.common.normals import circular, fill
from lowalt.effects import strongest_cell, transforms
from lowalt.effects.strongest_cell import NONE, SLOTS, _cell, _power, walked
from lowalt.effects.transform_loops import transformed

FEW = 2
"""Range cells beyond the target's that are worked out one by one; a transform takes the time of about as many."""
LARGEST = math.sqrt(2.0 * 53.0 * math.log(2.0))
"""Largest size of a complex normal number whose parts have standard deviation one: its word has 53 bits."""
ROOM = 1e-9
"""Share by which limits are wider than need be, for the rounding of roots, logarithms and exponentials."""


class RangeNoise:
    """Circular white Gaussian noise in the M range cells of N symbols.

    words: (2 N M,) uint64, two for each cell, symbol by symbol; shape: (N, M); scale: standard deviation of each part
    in a range cell, sqrt(W). Source of the numbers: `lowalt.common.normals.circular`.
    """

    def __init__(self, words: np.ndarray, shape: tuple[int, int], scale: float):
        """Keep the words; no number is made before it is asked for."""
        self.words, self.scale = words.reshape(shape[0], 2 * shape[1]), scale

    def cells(self, rows: slice | np.ndarray = slice(None)) -> np.ndarray:
        """Return the noise (K, M) of the symbols `rows`, all unless named."""
        words = self.words[rows]
        real, imaginary = circular(words.reshape(-1), self.scale)
        out = np.empty((len(words), words.shape[1] // 2), np.complex128)
        out.real, out.imag = real.reshape(out.shape), imaginary.reshape(out.shape)
        return out

    @cached_property
    def response(self) -> np.ndarray:
        """The frequency responses (N, M) whose range cells are the noise; they must not be changed."""
        cells = self.cells()
        return transforms.forward(cells, out=cells)

    def strongest(self, responses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the strongest range cells of responses (N, M) in this noise: values (N,) and numbers (N,)."""
        symbols, count = responses.shape
        value, cell = np.empty(symbols, np.complex128), np.full(symbols, -1)
        if count >= strongest_cell.FEWEST and symbols > 0:
            start = int(abs(transforms.inverse(responses[:1])).argmax())
            given = np.ascontiguousarray(responses), self.words, self.scale, start
            _found(*given, strongest_cell.space(count), _space(count), value, cell)
        rest = np.flatnonzero(cell < 0)
        if len(rest):
            rows = slice(None) if len(rest) == symbols else rest
            cells = transforms.inverse(responses[rows])
            cells += self.cells(rows)
            cell[rest] = abs(cells).argmax(axis=1)
            value[rest] = cells[np.arange(len(rest)), cell[rest]]
        return value, cell


@INNER
def _limit(lack, scale, reach):
    """Upper 53 bits of a number's first word, at most, where the number is as large as `lack`; -1 for none so large."""
    if lack > reach:
        return np.int64(-1)
    share = max(lack, 0.0) / scale
    return np.int64(np.exp(-0.5 * share * share) * (1.0 + ROOM) * 2.0**53)


@INNER
def _large(words, limit, first, last, chosen):
    """Choose the cells beyond those from `first` to `last` whose number may be large enough; return how many."""
    count, several = len(words) // 2, 0
    for q in range(np.uint64(count)):
        if np.int64(words[2 * q] >> np.uint64(11)) <= limit and (np.int64(q) - first) % count > last - first:
            chosen[several] = q
            several += 1
    return several


@INNER
def _strongest(values, chosen, several, words, scale, numbers, best):
    """The strongest of `several` cells that are chosen, in noise, and of the one given: its power, value and number.

    values: what the chosen cells hold besides noise; numbers: words (2 SLOTS,) and numbers (2, SLOTS), work space.
    """
    (taken, made), (top, value, cell) = numbers, best
    for begin in range(0, several, SLOTS):
        some = min(SLOTS, several - begin)
        for k in range(some):
            q = chosen[begin + k]
            taken[2 * k], taken[2 * k + 1] = words[2 * q], words[2 * q + 1]
        fill(taken, scale, made)
        for k in range(some):
            q, z = chosen[begin + k], values[begin + k]
            z = complex(z.real + made[0, k], z.imag + made[1, k])
            size = z.real * z.real + z.imag * z.imag
            if size > top or (size == top and q < cell):
                top, value, cell = size, z, q
    return top, value, cell


@INNER_VECTOR
def _transformed(parts, work, table, first, last):
    """Fill work (2, M) with the range cells of a response in parts (2, M), which is overwritten.

    Returns the largest power of a cell that is not from `first` to `last`.
    """
    count, most = parts.shape[1], 0.0
    transformed(parts[1], parts[0], work[1], work[0], table)
    for q in range(np.uint64(count)):
        work[0, q] /= count
        work[1, q] /= count
    for q in range(last + 1, first + count):
        place = q % count
        most = max(most, work[0, place] * work[0, place] + work[1, place] * work[1, place])
    return most


@VECTOR
def _found(responses, words, scale, start, space, noisy_space, value, cell):
    """Fill value and cell (N,) with the strongest range cells of responses (N, M) in noise of words (N, 2 M).

    start: a cell near the first symbol's; space: of `strongest_cell.space`; noisy_space: of `_space`. Symbols with more
    than a few cells to be worked out are left with cell -1 where M has no compiled transform; once more than a quarter
    of the look and 16 are left, the loop gives up.
    """
    symbols, count = responses.shape
    wave, parts, held, rows, seen = space
    none, numbers, chosen, values, work, table = noisy_space
    left, near, reach = 0, start, scale * LARGEST * (1.0 + ROOM)
    for n in range(symbols):
        own = words[n]
        total = _power(responses[n], none, parts) / count
        first, last, best, _, rest = walked(parts, near, n, total, 2.0 * reach, wave, held, rows, seen)
        near = best % count
        for q in range(first, last + 1):
            chosen[q - first], values[q - first] = q % count, seen[q % SLOTS]
        found = _strongest(values, chosen, last + 1 - first, own, scale, numbers, (-1.0, 0j, -1))
        # What the cells worked out leave bounds every other cell without its noise, and so what noise it lacks.
        beyond = np.sqrt(max(rest, 0.0)) * (1.0 + ROOM)
        limit = _limit(np.sqrt(found[0]) - beyond, scale, reach)
        several = _large(own, limit, first, last, chosen) if limit >= 0 else 0
        if several > FEW and len(table) > 0:
            # All cells bound each other better.
            beyond = np.sqrt(_transformed(parts, work, table, first, last)) * (1.0 + ROOM)
            several = _large(own, _limit(np.sqrt(found[0]) - beyond, scale, reach), first, last, chosen)
            for k in range(several):
                values[k] = complex(work[0, chosen[k]], work[1, chosen[k]])
        elif several > FEW:
            cell[n] = -1
            left += 1
            if 4 * left > symbols + 64:
                return
            continue
        else:
            for k in range(several):
                values[k] = _cell(parts, chosen[k], wave, held, rows)
        _, value[n], cell[n] = _strongest(values, chosen, several, own, scale, numbers, found)


def _space(count: int) -> tuple:
    """Work space of a search in noise among `count` range cells, and a transform's table, empty where there is none."""
    table = transforms.table() if count == transforms.LENGTH else np.empty((0, count))
    chosen, values = np.empty(count, np.int64), np.empty(count, np.complex128)
    numbers = np.zeros(2 * SLOTS, np.uint64), np.empty((2, SLOTS))
    return NONE, numbers, chosen, values, np.empty((2, count)), table
