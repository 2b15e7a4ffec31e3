"""Time samples turned by phases that change from sample to sample, also from their tones to their tones.

Functions that return tones take tones (N, M), which are overwritten, or with `data` (N, M) the responses (N, M) that
carry them, which are not.
"""

import numpy as np

from lowalt.common.jit import INLINED, LEAN
from lowalt.common.memory import aligned
from lowalt.effects import transforms, waveform
from lowalt.effects.phasors import SMALL, phasor, small_phasor
from lowalt.effects.receiver import _toeplitz
from lowalt.effects.tone_loops import apart
from lowalt.effects.transform_loops import transformed

NONE = np.empty((0, transforms.LENGTH))
"""No angles."""


def samples(given: np.ndarray, between: np.ndarray, within: np.ndarray) -> np.ndarray:
    """Return samples (N, M) times between (N,) and within, (N, M) or (1, M) complex128."""
    result = np.empty(given.shape, np.complex128)
    _turned(np.ascontiguousarray(given, np.complex128), between, within, result)
    return result


def tones(
    given: np.ndarray, between: np.ndarray, within: np.ndarray, data: np.ndarray | None = None
) -> np.ndarray:  # fmt: skip
    """Return the transform of `samples` from that of its samples, or from the responses that carried data."""
    if given.shape[1] != transforms.LENGTH:
        before = transforms.inverse(given) if data is None else waveform.transmit(given, data)
        return transforms.forward(samples(before, between, within))
    return _retoned(given, data, between, within, NONE, NONE)


def phased_tones(
    given: np.ndarray, even: np.ndarray, odd: np.ndarray, data: np.ndarray | None = None
) -> np.ndarray:  # fmt: skip
    """Return `tones` of the turns exp(j angle), which are never held together.

    even (N, ceil(M / 2)), odd (N, M // 2): the `_toeplitz.parts` of angle (N, M) in rad.
    """
    if given.shape[1] != transforms.LENGTH:
        return tones(given, np.ones(len(given), np.complex128), waveform.turned(_toeplitz.joined(even, odd)), data)
    return _retoned(given, data, NONE[:, 0].astype(np.complex128), NONE.astype(np.complex128), even, odd)


def _retoned(
    given: np.ndarray, data: np.ndarray | None, between: np.ndarray, within: np.ndarray, even: np.ndarray,
    odd: np.ndarray,
) -> np.ndarray:  # fmt: skip
    """The result of `_turned_tones`, in `given` where there are no data."""
    out = given if data is None else np.empty(given.shape, np.complex128)
    carried = NONE.astype(np.complex128) if data is None else data
    work = aligned(6, transforms.LENGTH)
    _turned_tones(given, carried, (between, within), (even, odd), transforms.table(), work, out)
    return out


@LEAN
def _turned(given, between, within, out):
    """Fill out (N, M) with given (N, M) times between (N,) and within, (N, M) or (1, M)."""
    for n in range(len(given)):
        turn, factor, row, new = between[n], within[n % len(within)], given[n], out[n]
        for i in range(np.uint64(len(row))):
            a, b, x, y = factor[i].real, factor[i].imag, row[i].real, row[i].imag
            c, s = turn.real * a - turn.imag * b, turn.real * b + turn.imag * a
            new[i] = complex(x * c - y * s, x * s + y * c)


@INLINED
def _joined(even, odd, out):
    """Fill out (256,) with the angles (rad) of even and odd part (128,) and return whether all are small."""
    large = np.int64(0)
    for i in range(128):
        later, earlier = even[i] + odd[i], even[i] - odd[i]
        out[128 + i], out[127 - i] = later, earlier
        large += np.int64(max(abs(later), abs(earlier)) > SMALL)
    return large == 0


@LEAN
def _turned_tones(given, data, turns, angles, table, work, out):
    """Turn the samples of given (N, 256) as `_turned` does, or by angles (rad) where these have rows.

    turns: between and within as in `samples`; angles: even and odd (N, 128) as in `phased_tones`; given, data: as in
    `tone_loops.apart`; table: `transform_loops.turns`; work: (6, 256); out (N, 256), the tones, may
    be given itself. A symbol stays in the nearest cache with both transforms.
    """
    re, im, new_re, new_im, c, s = work[0], work[1], work[2], work[3], work[4], work[5]
    (between, within), (even, odd), count, scale = turns, angles, np.uint64(256), 1.0 / 256
    for n in range(len(given)):
        row = out[n]
        apart(given, data, n, re, im)
        if len(even) > 0:
            if _joined(even[n], odd[n], c):
                for i in range(count):
                    x, y = small_phasor(c[i])
                    c[i], s[i] = x * scale, y * scale
            else:
                for i in range(count):
                    x, y = phasor(c[i])
                    c[i], s[i] = x * scale, y * scale
        else:
            turn, factor = between[n] * scale, within[n % len(within)]
            for i in range(count):
                c[i] = turn.real * factor[i].real - turn.imag * factor[i].imag
                s[i] = turn.real * factor[i].imag + turn.imag * factor[i].real
        # Real and imaginary parts change places: the inverse transform.
        transformed(im, re, new_im, new_re, table)
        for i in range(count):
            re[i], im[i] = new_re[i] * c[i] - new_im[i] * s[i], new_re[i] * s[i] + new_im[i] * c[i]
        transformed(re, im, new_re, new_im, table)
        for m in range(count):
            row[m] = complex(new_re[m], new_im[m])
