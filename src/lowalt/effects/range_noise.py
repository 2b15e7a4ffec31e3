"""White noise in all range cells of a look, and the strongest cells in it, for which few of its numbers are made.

Where data have unit modulus, white noise of the samples is white noise of the range cells, so it is drawn there. How
large a number is follows from one random word alone, and no number is larger than LARGEST. What a cell holds besides
noise is bounded by the power that the cells worked out leave. So most cells are settled by comparing a word to a limit.
"""

import math
from functools import cached_property

import numpy as np

from lowalt.common.jit import INNER, INNER_ORDERED, VECTOR
from lowalt.common.normals import circular, fill
from lowalt.effects import strongest_cell, transforms
from lowalt.effects.strongest_cell import SLOTS, _cell, taken, walked
from lowalt.effects.transform_loops import transformed

ASIDE = 1
"""Range cells on each side of the target's that hold much of its echo."""
FEW = 2
"""Range cells beyond the target's that are worked out one by one; a transform takes the time of about as many."""
LARGEST = math.sqrt(2.0 * 53.0 * math.log(2.0))
"""Largest size of a complex normal number whose parts have standard deviation one: its word has 53 bits."""
ROOM = 1e-9
"""Share by which limits are wider than need be, for the rounding of roots, logarithms and exponentials."""
NOTHING = (-1.0, 0j, -1)
"""Power, value and number of no cell."""


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
            spaces = strongest_cell.space(count), _space(count, self.scale)
            _found(np.ascontiguousarray(responses), self.words, start, *spaces, value, cell)
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

    values: what the chosen cells hold besides noise; numbers: words (2 SLOTS,) and twice (2, SLOTS), work space.
    """
    (taken, made, work), (top, value, cell) = numbers, best
    for begin in range(0, several, SLOTS):
        some = min(SLOTS, several - begin)
        for k in range(some):
            q = chosen[begin + k]
            taken[2 * k], taken[2 * k + 1] = words[2 * q], words[2 * q + 1]
        fill(taken, scale, work, made)
        for k in range(some):
            q, z = chosen[begin + k], values[begin + k]
            z = complex(z.real + made[0, k], z.imag + made[1, k])
            size = z.real * z.real + z.imag * z.imag
            if size > top or (size == top and q < cell):
                top, value, cell = size, z, q
    return top, value, cell


@INNER
def _largest(words):
    """The cell with the largest number: that with the smallest first word."""
    place, least = 0, words[0] >> np.uint64(11)
    for q in range(np.uint64(len(words) // 2)):
        word = words[2 * q] >> np.uint64(11)
        if word < least:
            place, least = np.int64(q), word
    return place


@INNER_ORDERED
def _transformed(parts, work, table, first, last):
    """Fill work (2, M) with the range cells of a response in parts (2, M), which is overwritten by their powers.

    Powers of cells from `first` to `last` are left out: they are -1. Returns the largest one of the others.
    """
    count, most = parts.shape[1], -1.0
    transformed(parts[1], parts[0], work[1], work[0], table)
    x, y, power, scale = work[0], work[1], parts[0], 1.0 / count
    for q in range(np.uint64(count)):
        x[q], y[q] = scale * x[q], scale * y[q]
        power[q] = x[q] * x[q] + y[q] * y[q]
    for q in range(first, last + 1):
        power[q % count] = -1.0
    for q in range(np.uint64(count)):
        most = max(most, power[q])
    return most


@INNER
def _by_neighbours(parts, words, near, n, total, reach, space, noisy_space):
    """The strongest cell in noise of a symbol whose other cells settle themselves: `_strongest`, of number -1 if not.

    near: a cell near the strongest one without noise; n: the symbol's number; total: power of all cells; reach: the
    largest noise; spaces: as in `_found`. Returns the strongest cell without noise, too.
    """
    wave, _, held, rows, seen = space
    numbers, chosen, values, _, _, scale = noisy_space
    count = parts.shape[1]
    first, last, best, _, rest = walked(parts, near, n, total, 2.0 * reach, wave, held, rows, seen)
    for q in range(first, last + 1):
        chosen[q - first], values[q - first] = q % count, seen[q % SLOTS]
    found = _strongest(values, chosen, last + 1 - first, words, scale, numbers, NOTHING)
    # What the cells worked out leave bounds every other cell without its noise, and so what noise it lacks.
    limit = _limit(np.sqrt(found[0]) - np.sqrt(max(rest, 0.0)) * (1.0 + ROOM), scale, reach)
    several = _large(words, limit, first, last, chosen) if limit >= 0 else 0
    if several > FEW:
        return NOTHING, best % count
    for k in range(several):
        values[k] = _cell(parts, chosen[k], wave, held, rows)
    return _strongest(values, chosen, several, words, scale, numbers, found), best % count


@INNER
def _by_all(parts, words, near, reach, noisy_space):
    """The strongest cell in noise (`_strongest`), all cells worked out, and the one without; see `_by_neighbours`."""
    numbers, chosen, values, work, table, scale = noisy_space
    first, last, count, power = near - ASIDE, near + ASIDE, parts.shape[1], 0.0
    most = _transformed(parts, work, table, first, last)
    for q in range(first, last + 1):
        place = q % count
        chosen[q - first], values[q - first] = place, complex(work[0, place], work[1, place])
        size = work[0, place] * work[0, place] + work[1, place] * work[1, place]
        if size > power:
            power, near = size, place
    if most > power:
        near = np.argmax(parts[0])
    # A cell of much noise early leaves few that can be stronger.
    several = last + 1 - first
    chosen[several] = _largest(words)
    values[several] = complex(work[0, chosen[several]], work[1, chosen[several]])
    found = _strongest(values, chosen, several + 1, words, scale, numbers, NOTHING)
    limit = _limit(np.sqrt(found[0]) - np.sqrt(max(most, 0.0)) * (1.0 + ROOM), scale, reach)
    several = _large(words, limit, first, last, chosen)
    for k in range(several):
        values[k] = complex(work[0, chosen[k]], work[1, chosen[k]])
    return _strongest(values, chosen, several, words, scale, numbers, found), near


@VECTOR
def _found(responses, words, start, space, noisy_space, value, cell):
    """Fill value and cell (N,) with the strongest range cells of responses (N, M) in noise of words (N, 2 M).

    start: a cell near the first symbol's; space: of `strongest_cell.space`; noisy_space: of `_space`. Symbols with more
    than a few cells to be worked out are left with cell -1 where M has no compiled transform; once more than a quarter
    of the look and 16 are left, the loop gives up.
    """
    symbols, count = responses.shape
    parts, table, scale = space[1], noisy_space[4], noisy_space[5]
    left, near, reach = 0, start, scale * LARGEST * (1.0 + ROOM)
    for n in range(symbols):
        total = taken(responses[n], parts) / count
        found = NOTHING
        # Behind strong noise neighbours settle nothing.
        if len(table) == 0 or 2.0 * reach < np.sqrt(total):
            found, near = _by_neighbours(parts, words[n], near, n, total, reach, space, noisy_space)
        if found[2] < 0 and len(table) > 0:
            found, near = _by_all(parts, words[n], near, reach, noisy_space)
        _, value[n], cell[n] = found
        left += cell[n] < 0
        if 4 * left > symbols + 64:
            return


def _space(count: int, scale: float) -> tuple:
    """Work space of a search in noise among `count` range cells, and a transform's table, empty where there is none."""
    table = transforms.table() if count == transforms.LENGTH else np.empty((0, count))
    chosen, values = np.empty(count, np.int64), np.empty(count, np.complex128)
    numbers = np.zeros(2 * SLOTS, np.uint64), np.empty((2, SLOTS)), np.empty((2, SLOTS))
    return numbers, chosen, values, np.empty((2, count)), table, scale
