"""From moments of one pair of paths to all subcarriers and to the strongest range cells, symbol by symbol.

A symbol's response is searched, and turned into tones where it is to be sent, while it stays in the nearest cache.
"""

import numpy as np

from lowalt.common.jit import INNER_VECTOR, VECTOR
from lowalt.common.memory import aligned, aligned_complex
from lowalt.effects import strongest_cell
from lowalt.effects.spread_loops import spread_symbol
from lowalt.effects.strongest_cell import power, settled
from lowalt.effects.tone_loops import HALF


@INNER_VECTOR
def _carried(re, im, x, y, out):
    """Fill out (K,) with a response of parts re and im (K,) times QPSK symbols of signs x and y (K,)."""
    for m in range(np.uint64(len(out))):
        a, b, c, d = re[m], im[m], HALF * x[m], HALF * y[m]
        out[m] = complex(a * c - b * d, a * d + b * c)


@VECTOR
def _spread_and_found(planes, table, own, whole, cells, work, turn, signs, space, value, cell, result):
    """Fill result (N, M) with responses, or with their tones, and value and cell (N,) with their strongest range cells.

    planes to turn: as in `spread_loops.spread`; signs: (2, N, M) of the QPSK symbols that tones carry, (2, 0, M) for
    responses; space: of `strongest_cell.space`. Symbols whose strongest cell is not certain are left, with cell -1;
    once more than a quarter of the look and 16 are left, no more are searched.
    """
    symbols, count = result.shape
    parts, low, left, near = space[1], count // 2, 0, 0
    re, im = parts[0], parts[1]
    for n in range(symbols):
        row = result[n]
        if n == 0:
            near = (whole[0] + np.int64(np.rint(cells[0]))) % count
        if not spread_symbol(planes[n], table, own[n], whole[n], cells[n], work, turn, parts):
            for m in range(np.uint64(count)):
                row[m] = 0.0
            value[n], cell[n] = 0.0, 0
            continue
        if signs.shape[1] > 0:
            x, y = signs[0, n], signs[1, n]
            _carried(re[low:], im[low:], x[low:], y[low:], row[: count - low])
            _carried(re[:low], im[:low], x[:low], y[:low], row[count - low :])
        else:
            for m in range(np.uint64(count)):
                row[m] = complex(re[m], im[m])
        if 4 * left > symbols + 64:
            continue
        total = power(parts) / count
        near, uncertain = settled(parts, near, n, total, space, value, cell)
        left += uncertain


def spread_and_search(
    moments: tuple[np.ndarray, ...], count: int, signs: np.ndarray | None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:  # fmt: skip
    """Return responses (N, M), or their tones, and the strongest range cells of the responses: values and numbers (N,).

    moments: planes, table, own, whole and cells as `spread_loops.spread` takes them; count: M; signs: (2, N, M) int8 of
    the QPSK symbols that tones are to carry (`waveform.sent_signs`), None for responses.
    Source: as `strongest_cell.strongest`.
    """
    symbols, half = len(moments[0]), (count + 1) // 2
    given = np.empty((2, 0, count), np.int8) if signs is None else np.ascontiguousarray(signs)
    result = aligned_complex(symbols, count)
    value, cell = np.empty(symbols, np.complex128), np.full(symbols, -1)
    work = aligned(4, half), aligned(2, half)
    _spread_and_found(*moments, *work, given, strongest_cell.space(count), value, cell, result)
    rest = np.flatnonzero(cell < 0)
    if len(rest):
        strongest_cell.fill(result[rest], given[:, rest] if signs is not None else given, rest, value, cell)
    return result, value, cell
