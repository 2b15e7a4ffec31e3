"""Fourier transforms of symbols, row by row: compiled ones of 256 numbers, and NumPy's of any other number."""

from functools import cache

import numpy as np

from lowalt.common.memory import aligned
from lowalt.effects import transform_loops

LENGTH = transform_loops.LENGTH
"""Numbers of a row that compiled loops transform, the default's subcarriers."""


@cache
def table() -> np.ndarray:
    """Return the table of `transform_loops.turns`, which must not be changed."""
    return transform_loops.turns()


def work() -> np.ndarray:
    """Return new work space (4, LENGTH) of a compiled transform."""
    return aligned(4, LENGTH)


def forward(given: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
    """Return np.fft.fft of each row of given (N, M) to rounding, in `out` where it is named, which may be given."""
    return _rows(given, False, 1.0, out)


def inverse(given: np.ndarray, out: np.ndarray | None = None) -> np.ndarray:
    """Return np.fft.ifft of each row of given (N, M) to rounding, in `out` where it is named, which may be given."""
    return _rows(given, True, 1.0 / given.shape[-1], out)


def samples(response: np.ndarray, data: np.ndarray) -> np.ndarray:
    """Return np.fft.ifft of each row of tones, in the transform's order, of responses times data, both (N, LENGTH)."""
    result = np.empty(response.shape, np.complex128)
    transform_loops.sampled(response, data, table(), work(), result)
    return result


def turned(given: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return the time samples (N, M) of tones given (N, M) times turns (M,), both from the lowest subcarrier on."""
    if given.shape[1] != LENGTH:
        return np.fft.ifft(np.fft.ifftshift(given * turns, axes=1), axis=1)
    result = np.empty(given.shape, np.complex128)
    given, turns = (np.ascontiguousarray(one, np.complex128) for one in (given, turns))
    transform_loops.turned(given, turns, table(), work(), result)
    return result


def _rows(given: np.ndarray, back: bool, scale: float, out: np.ndarray | None) -> np.ndarray:
    """The transforms of `forward`, or with `back` those of `inverse`; scale: of the latter's sums."""
    if given.ndim != 2 or given.shape[1] != LENGTH:
        return (np.fft.ifft if back else np.fft.fft)(given, axis=-1, out=out)
    given = np.ascontiguousarray(given, np.complex128)
    result = np.empty(given.shape, np.complex128) if out is None else out
    transform_loops.rows(given, back, scale, table(), work(), result)
    return result
