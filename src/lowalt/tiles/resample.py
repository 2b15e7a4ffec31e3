"""The one resampling kernel of the project: a triangle, defined by a formula for shrinking and for enlarging.

A sample i of n stands at i + 1/2, an output j of m at (j + 1/2) n / m; its weight on sample i is
    max(0, 1 - |i + 1/2 - (j + 1/2) n / m| / max(1, n / m)),
divided by the sum over the samples there are. It interpolates linearly where it enlarges, averages over the
whole output pixel where it shrinks, and is the identity for n = m; constants stay constants. It is what Pillow
calls BILINEAR and what PyTorch computes with `antialias=True`.
"""

from functools import lru_cache

import numpy as np

from lowalt.errors import InputError


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
    weights /= weights.sum(axis=1, keepdims=True)
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


def resize(images: np.ndarray, size: int) -> np.ndarray:
    """Return index images at another size: (..., S, S) uint8 -> (..., size, size) uint8.

    Values are index values, before the colour map: both axes by `triangle`, float32, one rounding at the end
    (half up). Raises: InputError where the images are not square uint8.
    """
    images = np.asarray(images)
    if images.dtype != np.uint8 or images.ndim < 2 or images.shape[-1] != images.shape[-2]:
        raise InputError(f"resize: images {images.dtype} {images.shape}, expected uint8 (..., S, S)")
    if images.shape[-1] == size:
        return images.copy()
    weights = triangle(images.shape[-1], size).astype(np.float32)
    values = weights @ images.astype(np.float32) @ weights.T
    return (values + np.float32(0.5)).astype(np.uint8)
