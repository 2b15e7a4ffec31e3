"""Complex normal numbers from raw random words, compiled.

The bits are those of `lowalt.numerics.draws`, in less time.

Only additions, products, divisions, square roots and comparisons of float64 are used, in a fixed
order and never fused. No divisor can be zero; without a check for zero the compiler vectorises
these loops.
"""

import numpy as np

from lowalt.machine.jit import INNER, LEAN
from lowalt.numerics.portable import COSINE, LN2, LOGARITHM, SINE

_L1, _L2, _L3, _L4, _L5, _L6, _L7 = LOGARITHM
_S1, _S2, _S3, _S4, _S5, _S6 = SINE
_C1, _C2, _C3, _C4, _C5, _C6 = COSINE
_LN2_HIGH, _LN2_LOW = LN2
_MANTISSA = np.int64(0x000FFFFFFFFFFFFF)
_ONE = np.int64(0x3FF0000000000000)
_WHOLE = np.int64(0x4330000000000000)
_EXPONENT = np.int64(52)
"""Bits of 2^52; the lowest bits of its sum with a small integer are that integer."""
_BIASED = 2.0**52 + 1022.0
_LOWER = np.uint64(11)
_UPPER = np.uint64(43)
_HALF = np.uint64(0xFFFFFFFF)
_LARGE = np.uint64(0x4530000000000000)
_SMALL = np.uint64(0x4330000000000000)
_BOTH = 2.0**84 + 2.0**52
"""Bits of 2^84 and 2^52, whose sums with 32-bit integers have these as lowest bits."""
_SQRT_HALF = 0.70710678118654752440
_STEP = 2.0**-53
_TURN = 2 * np.pi
_TWO = np.uint64(2)
_NEXT = np.uint64(1)
BLOCK = 256
"""Complex numbers per block; all intermediate arrays fit into the first-level cache."""


@INNER
def _block(words, scale, real, imaginary, twos, lower):
    """Fill real and imaginary (K,) as `fill` does; twos, lower: (K,) work space."""
    count = np.uint64(len(real))
    # Few processors have a vector instruction that converts 64-bit integers. Set bits instead, and
    # add both halves of a word's upper 53 bits as float64, without rounding.
    x = real.view(np.uint64)
    x_low = twos.view(np.uint64)
    y = imaginary.view(np.uint64)
    y_low = lower.view(np.uint64)
    for i in range(count):
        one = words[_TWO * i]
        other = words[_TWO * i + _NEXT]
        x[i] = (one >> _UPPER) | _LARGE
        x_low[i] = ((one >> _LOWER) & _HALF) | _SMALL
        y[i] = (other >> _UPPER) | _LARGE
        y_low[i] = ((other >> _LOWER) & _HALF) | _SMALL
    for i in range(count):
        real[i] = (((real[i] - _BOTH) + twos[i]) + 1.0) * _STEP
        imaginary[i] = ((imaginary[i] - _BOTH) + lower[i]) * _STEP
    bits = real.view(np.int64)
    exponents = twos.view(np.int64)
    for i in range(count):
        exponents[i] = (bits[i] >> _EXPONENT) | _WHOLE
        bits[i] = (bits[i] & _MANTISSA) | _ONE
    for i in range(count):
        # In [1, 2), and then f in [sqrt(1/2) - 1, sqrt(2) - 1].
        mantissa = 0.5 * real[i]
        k = twos[i] - _BIASED
        if mantissa < _SQRT_HALF:
            mantissa = real[i]
            k = k - 1.0
        f = mantissa - 1.0
        s = f / (2.0 + f)
        z = s * s
        rest = z * (_L1 + z * (_L2 + z * (_L3 + z * (_L4 + z * (_L5 + z * (_L6 + z * _L7))))))
        half = 0.5 * f * f
        real[i] = -(k * _LN2_HIGH - ((half - (s * (half + rest) + k * _LN2_LOW)) - f))
    for i in range(count):
        turns = imaginary[i]
        quarter = np.rint(4.0 * turns)
        angle = (turns - 0.25 * quarter) * _TURN
        z = angle * angle
        cube = z * angle
        rest = _S2 + z * (_S3 + z * (_S4 + z * (_S5 + z * _S6)))
        sine = angle - ((z * (0.0 - cube * rest) - 0.0) - cube * _S1)
        rest = z * (_C1 + z * (_C2 + z * (_C3 + z * (_C4 + z * (_C5 + z * _C6)))))
        half = 0.5 * z
        one = 1.0 - half
        cosine = one + (((1.0 - one) - half) + z * rest)
        radius = np.sqrt(2.0 * real[i])
        # Of the quarters 0 to 4, 1 and 3 swap both; 1 and 2 are left of the origin, 2 and 3 below
        # it.
        swapped = abs(quarter - 2.0) == 1.0
        left = abs(quarter - 1.5) < 1.0
        below = abs(quarter - 2.5) < 1.0
        x = sine if swapped else cosine
        y = cosine if swapped else sine
        if left:
            x = -x
        if below:
            y = -y
        real[i] = scale * (radius * x)
        imaginary[i] = scale * (radius * y)


@LEAN
def fill(words, scale, work, out):
    """Fill out (2, N) with complex normals times `scale`, real and imaginary parts.

    words: (2 N,) uint64; work: (2, BLOCK).
    """
    for first in range(0, out.shape[1], BLOCK):
        last = min(first + BLOCK, out.shape[1])
        more = work[0, : last - first]
        lower = work[1, : last - first]
        _block(words[2 * first :], scale, out[0, first:last], out[1, first:last], more, lower)


@LEAN
def _fill_pairs(words, work, out):
    """Fill out (N, 2) with the real and imaginary parts of N complex normals.

    words: (2 N,) uint64; work: (4, BLOCK).
    """
    for first in range(0, len(out), BLOCK):
        size = min(BLOCK, len(out) - first)
        real = work[0, :size]
        imaginary = work[1, :size]
        some = out[first : first + size]
        _block(words[2 * first :], 1.0, real, imaginary, work[2, :size], work[3, :size])
        for i in range(np.uint64(size)):
            some[i, 0] = real[i]
            some[i, 1] = imaginary[i]


def interleaved(words: np.ndarray) -> np.ndarray:
    """Return the 2 N float64 that `Draws.standard_normal` makes of raw words (2 N,) uint64.

    Real parts are at even positions.
    """
    out = np.empty((len(words) // 2, 2))
    # The compiler vectorises loops over contiguous real parts, but not over alternating parts.
    _fill_pairs(words, np.empty((4, BLOCK)), out)
    return out.ravel()


def circular(words: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """Return complex normals from raw words (2 N,) uint64 as (2, N) float64.

    The rows are real and imaginary parts.

    Each part has mean 0 and standard deviation `scale`; the k-th number is `scale` times draws 2 k
    and 2 k + 1 of `Draws.standard_normal` on the same words.
    """
    out = np.empty((2, len(words) // 2))
    fill(words, scale, np.empty((2, BLOCK)), out)
    return out
