"""The resampling kernel of the project: a triangle.

One formula serves shrinking and enlarging.

Sample i of n is at i + 1/2, output j of m at (j + 1/2) n / m. The weight of sample i in output j is
    max(0, 1 - |i + 1/2 - (j + 1/2) n / m| / max(1, n / m)),
divided by the sum over the samples there are. It interpolates linearly where it enlarges, averages
over the whole output pixel where it shrinks, and is the identity for n = m; constants stay
constants. It is what Pillow calls BILINEAR and what PyTorch computes with `antialias=True`.
"""

from functools import lru_cache

import numpy as np

from lowalt.files.errors import InputError
from lowalt.machine.jit import PLAIN
from lowalt.numerics import portable


@lru_cache(maxsize=64)
def triangle(size: int, out: int) -> np.ndarray:
    """Return the matrix of weights, shape (out, size), float64; every row sums to one.

    Raises: InputError where a size is not positive.
    Source: the formula of the module's docstring.
    """
    if size < 1 or out < 1:
        raise InputError(f"resampling {size} -> {out}: expected positive sizes")
    ratio = size / out
    distance = np.arange(size) + 0.5 - (np.arange(out)[:, None] + 0.5) * ratio
    weights = np.maximum(0.0, 1 - np.abs(distance) / max(1.0, ratio))
    weights /= portable.total(weights, 1)[:, None]
    weights.setflags(write=False)
    return weights


@lru_cache(maxsize=64)
def taps(size: int, out: int) -> tuple[np.ndarray, np.ndarray]:
    """Return `triangle` as a band: first samples (out,) int64 and weights (out, taps) float64.

    Bands are moved inwards at the edges, so first + taps never exceeds the size.
    """
    full = triangle(size, out)
    first = (full > 0).argmax(axis=1)
    last = size - (full[:, ::-1] > 0).argmax(axis=1)
    width = int((last - first).max())
    first = np.minimum(first, size - width)
    weights = np.take_along_axis(full, first[:, None] + np.arange(width), axis=1)
    first.setflags(write=False)
    weights.setflags(write=False)
    return first, weights


@lru_cache(maxsize=64)
def row_taps(size: int, out: int) -> tuple[np.ndarray, np.ndarray]:
    """Return `taps` as `across_rows` wants them: sources (out, taps) and their weights.

    Sources are int64, weights (out, taps) float32.

    All callers share the arrays, which must not be changed.
    """
    first, weights = taps(size, out)
    sources = first[:, None] + np.arange(weights.shape[1])
    return np.ascontiguousarray(sources), weights.astype(np.float32)


@lru_cache(maxsize=64)
def column_taps(size: int, out: int, hop: int = 1) -> tuple[np.ndarray, np.ndarray]:
    """Return `taps` as `along_rows` wants them: columns (taps, out), every hop-th, and shares.

    Columns are uintp, shares float32.

    All callers share the arrays, which must not be changed.
    """
    first, weights = taps(size, out)
    weights = np.pad(weights, ((0, 0), (0, weights.shape[1] % 2)))
    columns = np.minimum(first[:, None] + np.arange(weights.shape[1]), size - 1) * hop
    # Unsigned indices, so that the compiled loop does not test for negative ones.
    columns = np.ascontiguousarray(columns.T.astype(np.uintp))
    return columns, np.ascontiguousarray(weights.T.astype(np.float32))


@PLAIN
def along_rows(values, columns, shares, out):
    """The last axis: values (rows, n) -> out (rows, S).

    columns, shares: (taps, S), an even number of taps, which are summed two by two, in order.
    """
    for j in range(out.shape[0]):
        row = values[j]
        line = out[j]
        for c in range(line.size):
            line[c] = shares[0, c] * row[columns[0, c]] + shares[1, c] * row[columns[1, c]]
        for k in range(2, shares.shape[0], 2):
            for c in range(line.size):
                line[c] += (
                    shares[k, c] * row[columns[k, c]] + shares[k + 1, c] * row[columns[k + 1, c]]
                )


@PLAIN
def across_rows(values, source, weights, out):
    """The first axis: values (points, n) -> out (S, n).

    source, weights: (S, taps), summed in order.
    """
    for j in range(out.shape[0]):
        line = out[j]
        first = values[source[j, 0]]
        for t in range(line.size):
            line[t] = weights[j, 0] * first[t]
        for k in range(1, weights.shape[1]):
            w = weights[j, k]
            row = values[source[j, k]]
            for t in range(line.size):
                line[t] += w * row[t]


@PLAIN
def _resize(images, source, weights, columns, shares, out):
    """(n, S, S) uint8 -> out (n, size, size) uint8, rows first, rounded half up at the end."""
    between = np.empty((out.shape[1], images.shape[2]), np.float32)
    values = np.empty(out.shape[1:], np.float32)
    plain = np.empty(images.shape[1:], np.float32)
    for n in range(len(images)):
        # Loops, because an array assignment would take as long to compile as the rest of the stage.
        for j in range(plain.shape[0]):
            for c in range(plain.shape[1]):
                plain[j, c] = images[n, j, c]
        across_rows(plain, source, weights, between)
        along_rows(between, columns, shares, values)
        for j in range(values.shape[0]):
            for c in range(values.shape[1]):
                out[n, j, c] = np.int32(values[j, c] + np.float32(0.5))


def resize(images: np.ndarray, size: int) -> np.ndarray:
    """Return index images at another size: (..., S, S) uint8 -> (..., size, size) uint8.

    Values are index values, before the colour map: both axes by `triangle`, in float32 and one
    fixed order, rounded once at the end (half up). Raises: InputError where the images are not
    square uint8.
    """
    images = np.asarray(images)
    if images.dtype != np.uint8 or images.ndim < 2 or images.shape[-1] != images.shape[-2]:
        raise InputError(
            f"resize: images {images.dtype} {images.shape}, expected uint8 (..., S, S)"
        )
    if images.shape[-1] == size:
        return images.copy()
    stack = np.ascontiguousarray(images).reshape(-1, *images.shape[-2:])
    out = np.empty((len(stack), size, size), np.uint8)
    before = images.shape[-1]
    _resize(stack, *row_taps(before, size), *column_taps(before, size), out)
    return out.reshape(*images.shape[:-2], size, size)
