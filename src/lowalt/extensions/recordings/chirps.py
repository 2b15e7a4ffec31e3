"""Chirps of a frequency-modulated radar as one slow signal: the range transform, and the range of
the moving target.
"""

import numpy as np

from lowalt.files.errors import InputError


def in_chirps(values: np.ndarray, samples: int, where: str) -> np.ndarray:
    """Return an array of chirps as one stream (n,): its last axis, or else its first, has the
    samples of a chirp.

    values: any shape; an array of one axis is a stream already. Raises: InputError naming `where`
    for other shapes.
    """
    if values.ndim == 1 and len(values) % samples == 0:
        return values
    if values.ndim > 1 and values.shape[-1] == samples:
        return values.reshape(-1)
    if values.ndim > 1 and values.shape[0] == samples:
        return np.ascontiguousarray(values.T).reshape(-1)
    raise InputError(
        f"{where}: array {values.shape}, expected the {samples} samples of a chirp along its "
        "last or first axis"
    )


def chirp_rows(rows: np.ndarray, samples: int, where: str) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the stream (n,) of a text matrix with a chirp a row, and the times (chirps,) s of its
    last column, if any.

    rows: (chirps, columns); a row holds the samples of a chirp, or all in-phase and then all
    quadrature samples, and perhaps the chirp's time. Raises: InputError naming `where` for other
    numbers of columns.
    """
    if rows.shape[1] == 1 and len(rows) % samples == 0:
        return rows[:, 0], None
    timed = rows.shape[1] % samples == 1
    values = rows[:, :-1] if timed else rows
    times = rows[:, -1].real if timed else None
    if values.shape[1] == samples:
        return values.reshape(-1), times
    if values.shape[1] == 2 * samples:
        return (values[:, :samples] + 1j * values[:, samples:]).reshape(-1), times
    raise InputError(
        f"{where}: rows of {rows.shape[1]} columns, expected the {samples} samples of a chirp, or"
        " twice as many for in-phase and quadrature, and perhaps its time"
    )


def slow_time(
    stream: np.ndarray, samples: int, receivers: int = 1, receiver: int = 0
) -> np.ndarray:
    """Return the signal (chirps,) complex128, one value per chirp, at the range where most power
    moves.

    stream: (chirps * receivers * samples,) real or complex, one receiver's chirp after the other's.
    The range is the bin of the Hann-windowed transform over a chirp with the largest variance from
    chirp to chirp. A beat note whose frequency rises with range has a phase that rises with range
    too, so bins at positive frequency are conjugated: positive Doppler approaches, whichever way
    the mixer is wired.
    Source: Richards 2014, Fundamentals of Radar Signal Processing, section 4.6 (stretch
    processing).
    """
    chirps = stream.reshape(-1, receivers, samples)[:, receiver]
    chirps = (chirps - chirps.mean(axis=1, keepdims=True)) * np.hanning(samples)
    ranges = np.fft.fft(chirps, axis=1)
    if np.isrealobj(stream):
        ranges = ranges[:, : samples // 2]
    chosen = int(ranges.var(axis=0).argmax())
    return ranges[:, chosen].conj() if chosen < (samples + 1) // 2 else ranges[:, chosen]
