"""Which layout fits a file's bytes: the one under which the samples take the fewest bits.

A receiver's samples follow from the ones before them, and the noise of a complex channel is
circular: in-phase and quadrature are equally strong and uncorrelated. Each reading of the same
bytes is therefore coded by a linear predictor (real, or complex with circular innovations), and its
code length is compared: a wrong width or byte order turns the samples into noise over their whole
range, a wrong order breaks the prediction and the symmetry of I and Q.
Source: minimum description length, Rissanen 1978, Automatica 14(5); circularity, Schreier and
Scharf 2010, chapter 2.
"""

import numpy as np
from scipy.signal import lfilter

BLOCK = 512
BLOCKS = 16
"""Samples that one predictor is fitted to, and the largest number of such blocks, spread over the
recording.
"""
ORDER = 32
"""Number of earlier numbers that a prediction uses, the same under every reading."""
REPEATS = 0.3
"""Least correlation of the innovations' power with which a stream counts as chirps."""
AROUND = 4
ANEW = 4.0
"""Samples of a row from which the next one is predicted, and how many times the squared error must
grow at a place where the samples begin anew."""
SHORTEST_CHIRP = 16
STRETCHES = 16
"""Stretches over which the phase of a line and of its image is compared."""
APART_CELLS = 4
"""Least Doppler of a line, in cells of a stretch, at which a Hann window separates it from its
image.
"""

SKEW = 0.9
"""Largest ratio of the median of powers to their mean."""
FAR = 1e3
"""Largest ratio of the 90th percentile of powers to the median, and of it to the 10th: misread
numbers span more.
"""


def _blocks(values: np.ndarray) -> np.ndarray:
    """Stretches (blocks, samples) of a channel, evenly spread, each without its mean."""
    length = min(BLOCK, len(values))
    starts = np.linspace(
        0, len(values) - length, min(BLOCKS, max(1, len(values) // length))
    ).astype(int)
    kind = np.complex128 if np.iscomplexobj(values) else np.float64
    stretches = np.stack([np.asarray(values[start : start + length], kind) for start in starts])
    return stretches - stretches.mean(axis=1, keepdims=True)


def _fitted(stretches: np.ndarray, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Predictor (blocks, order) of each stretch by least squares, and its innovations (blocks,
    samples - order).
    """
    views = np.lib.stride_tricks.sliding_window_view(stretches, order + 1, axis=1)
    # A constant part needs no tap: everything is centred, as in a regression with an intercept.
    views = views - views.mean(axis=1, keepdims=True)
    past = views[..., :order]
    present = views[..., order]
    adjoint = past.conj().swapaxes(1, 2)
    gram = adjoint @ past
    gram += 1e-12 * np.trace(gram, axis1=1, axis2=2).real[:, None, None] * np.eye(
        order
    ) + 1e-300 * np.eye(order)
    taps = np.linalg.solve(gram, adjoint @ present[..., None])
    return taps[..., 0], present - (past @ taps)[..., 0]


def step_bits(numbers: np.ndarray) -> float:
    """Return the binary logarithm of the step between neighbouring numbers of the array's type, its
    mean over them.
    """
    if numbers.dtype.kind in "iu":
        return 0.0
    parts = numbers.view(numbers.real.dtype)[:: max(1, len(numbers) // 65536)]
    with np.errstate(all="ignore"):
        steps = np.log2(np.spacing(np.abs(parts[parts != 0])).astype(np.float64))
    return float(np.mean(steps)) if len(steps) else 0.0


def code_bits(channels: list[np.ndarray], step_log2: float) -> float:
    """Return the bits per real number that channels (samples,), real or complex, take in steps of
    2^step_log2.

    A complex channel is two real numbers with one variance and no correlation, or, where it is the
    only one, two real channels, whichever takes fewer bits. Infinite where a value is not finite or
    spans 1e100 steps.
    """
    bits = 0.0
    count = 0
    for values in channels:
        parts = 2 if np.iscomplexobj(values) else 1
        with np.errstate(all="ignore"):
            stretches = _blocks(values) * np.exp2(-step_log2)
            largest = np.abs(stretches).max()
        if not largest < 1e100:
            return np.inf
        order = min(ORDER // parts, stretches.shape[1] // 4)
        ways = [_coded(stretches, order)]
        if parts == 2 and len(channels) == 1:
            order = min(ORDER, stretches.shape[1] // 4)
            ways.append(0.5 * (_coded(stretches.real, order) + _coded(stretches.imag, order)))
        bits += parts * len(values) * min(ways)
        count += parts * len(values)
    return bits / count


def _coded(stretches: np.ndarray, order: int) -> float:
    """Bits per real number that stretches (blocks, samples) take in steps of one."""
    parts = 2 if np.iscomplexobj(stretches) else 1
    innovations = _fitted(stretches, order)[1]
    freedom = max(parts * (innovations.shape[1] - order - 1), 1)
    variance = (np.abs(innovations) ** 2).sum(axis=1) / freedom + 1 / 12
    return float(np.mean(0.5 * np.log2(2 * np.pi * np.e * variance)))


def begins_anew(rows: np.ndarray, place: int) -> bool:
    """Whether the samples of rows (n, samples) begin anew at a column: where it is crossed, they
    follow far worse from the samples before them than elsewhere in the row."""
    rows = rows - rows.mean(axis=1, keepdims=True)
    views = np.lib.stride_tricks.sliding_window_view(rows, AROUND + 1, axis=1)
    columns = np.arange(AROUND, rows.shape[1])
    crossing = (columns >= place) & (columns < place + AROUND)
    if crossing.all():
        return False
    known = views[:, ~crossing].reshape(-1, AROUND + 1)
    taps = np.linalg.lstsq(known[:, :-1], known[:, -1], rcond=None)[0]
    missed = ((views[..., -1] - views[..., :-1] @ taps) ** 2).mean(axis=0)
    return bool(missed[crossing].mean() > ANEW * missed[~crossing].mean())


def chirp_length(values: np.ndarray) -> tuple[int, float]:
    """Return the samples from chirp to chirp of a stream (samples,) real or complex, and how well
    it repeats, 0 to 1.

    Where a chirp begins, the samples do not follow from the ones before. The innovations' power
    therefore has the chirps' period, whatever the ranges of the targets; a continuous wave's has
    none. (0, 0.0) where none is found.
    """
    values = np.asarray(values[: 1 << 17])
    if len(values) < 16 * SHORTEST_CHIRP:
        return 0, 0.0
    centred = values - values.mean()
    taps = _fitted(centred[None], ORDER // 2)[0][0]
    innovations = lfilter(np.concatenate([[1.0], -taps[::-1]]), [1.0], centred)[ORDER // 2 :]
    level = np.log(np.abs(innovations) ** 2 + 1e-30)
    level = np.maximum(level, np.median(level))
    level -= level.mean()
    size = 2 << (len(level) - 1).bit_length()
    power = np.fft.irfft(np.abs(np.fft.rfft(level, size)) ** 2)[: len(level) // 8]
    power /= max(power[0], 1e-300)
    power[:SHORTEST_CHIRP] = 0
    best = float(power.max(initial=0.0))
    if best < REPEATS:
        return 0, 0.0
    # The shortest lag that repeats nearly as well as the best one: all its multiples do too.
    peaks = np.flatnonzero(power > 0.85 * best)
    return int(peaks[0]), best


def receivers_of(values: np.ndarray, samples: int) -> int:
    """Return after how many chirps of `samples` a stream (samples,) repeats: receivers whose chirps
    stand in turn.
    """
    values = np.asarray(values[: len(values) // samples * samples][: 1 << 18])
    chirps = values.reshape(-1, samples)
    chirps = chirps - chirps.mean(axis=1, keepdims=True)
    alike = []
    for receivers in (1, 2, 3, 4):
        if len(chirps) <= 2 * receivers:
            break
        one = chirps[:-receivers]
        other = chirps[receivers:]
        alike.append(
            abs(np.vdot(one, other)) / max(np.linalg.norm(one) * np.linalg.norm(other), 1e-300)
        )
    return 1 + int(np.flatnonzero(np.array(alike) > 0.95 * max(alike))[0]) if alike else 1


def image_of(values: np.ndarray, cycles: float) -> tuple[float, float]:
    """Return how strong the image of a line of a complex signal (samples,) is at the opposite
    Doppler.

    cycles: the line's Doppler in cycles per sample. Returned are the image's power over the line's,
    and their squared coherence over `STRETCHES` stretches: near 1 for an image, the line's
    conjugate, and on average 1 / `STRETCHES` for noise of any spectrum; (0.0, 0.0) where the line
    is too slow to separate both.
    Source: spectral circularity coefficient, Schreier and Scharf 2010, chapter 9.
    """
    length = len(values) // STRETCHES
    place = round(cycles * length)
    if abs(place) < APART_CELLS or length // 2 - abs(place) < APART_CELLS:
        return 0.0, 0.0
    stretches = (values[: length * STRETCHES] - values.mean()).reshape(STRETCHES, length)
    spectra = np.fft.fft(stretches * np.hanning(length), axis=1)
    line = spectra[:, place]
    image = spectra[:, -place]
    powers = [float(np.vdot(side, side).real) for side in (line, image)]
    together = abs(np.sum(line * image)) ** 2
    return powers[1] / max(powers[0], 1e-300), float(together / max(powers[0] * powers[1], 1e-300))


def are_powers(values: np.ndarray) -> bool:
    """Return whether real numbers (n,) are powers or magnitudes: none is negative, and few large
    ones outweigh many small ones. Samples of a receiver lie to both sides of their mean, also where
    they are unsigned."""
    if np.iscomplexobj(values) or values.min() < 0:
        return False
    low, middle, high = np.quantile(values, [0.1, 0.5, 0.9])
    return bool(
        middle < SKEW * values.mean() and low > 0 and high < FAR * middle and middle < FAR * low
    )
