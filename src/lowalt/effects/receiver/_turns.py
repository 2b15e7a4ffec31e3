"""Time samples turned by phases that change from sample to sample, also from their tones to their tones."""

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.common.memory import aligned
from lowalt.effects import transforms
from lowalt.effects.transform_loops import transformed


def samples(given: np.ndarray, between: np.ndarray, within: np.ndarray) -> np.ndarray:
    """Return samples (N, M) times between (N,) and within, (N, M) or (1, M) complex128."""
    result = np.empty(given.shape, np.complex128)
    _turned(np.ascontiguousarray(given, np.complex128), between, within, result)
    return result


def tones(given: np.ndarray, between: np.ndarray, within: np.ndarray) -> np.ndarray:
    """Return the transform of `samples` from that of its samples, (N, M), which is overwritten."""
    if given.shape[1] != transforms.LENGTH:
        return transforms.forward(samples(transforms.inverse(given), between, within))
    _turned_tones(given, between, within, transforms.table(), aligned(6, transforms.LENGTH))
    return given


@LEAN
def _turned(given, between, within, out):
    """Fill out (N, M) with given (N, M) times between (N,) and within, (N, M) or (1, M)."""
    for n in range(len(given)):
        turn, factor, row, new = between[n], within[n % len(within)], given[n], out[n]
        for i in range(np.uint64(len(row))):
            a, b, x, y = factor[i].real, factor[i].imag, row[i].real, row[i].imag
            c, s = turn.real * a - turn.imag * b, turn.real * b + turn.imag * a
            new[i] = complex(x * c - y * s, x * s + y * c)


@LEAN
def _turned_tones(given, between, within, table, work):
    """Turn the samples of given (N, 256) as `_turned` does; table: `transform_loops.turns`; work: (6, 256).

    A symbol stays in the nearest cache with both transforms.
    """
    re, im, new_re, new_im, c, s = work[0], work[1], work[2], work[3], work[4], work[5]
    count, scale = np.uint64(256), 1.0 / 256
    for n in range(len(given)):
        turn, factor, row = between[n] * scale, within[n % len(within)], given[n]
        for i in range(count):
            re[i], im[i] = row[i].real, row[i].imag
            c[i] = turn.real * factor[i].real - turn.imag * factor[i].imag
            s[i] = turn.real * factor[i].imag + turn.imag * factor[i].real
        # Real and imaginary parts change places: the inverse transform.
        transformed(im, re, new_im, new_re, table)
        for i in range(count):
            re[i], im[i] = new_re[i] * c[i] - new_im[i] * s[i], new_re[i] * s[i] + new_im[i] * c[i]
        transformed(re, im, new_re, new_im, table)
        for m in range(count):
            row[m] = complex(new_re[m], new_im[m])
