"""Complex normal numbers from raw random words, compiled: the bits of `lowalt.common.draws` in less time.

Only additions, products, divisions, square roots and comparisons of float64 in one written order, never fused. No
divisor can be zero, and without a check for it these loops become vector instructions.
"""

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.common.portable import COSINE, LN2, LOGARITHM, SINE

_L1, _L2, _L3, _L4, _L5, _L6, _L7 = LOGARITHM
_S1, _S2, _S3, _S4, _S5, _S6 = SINE
_C1, _C2, _C3, _C4, _C5, _C6 = COSINE
_LN2_HIGH, _LN2_LOW = LN2
_MANTISSA, _ONE = np.int64(0x000FFFFFFFFFFFFF), np.int64(0x3FF0000000000000)
_STEP = 2.0**-53
_TURN = 2 * np.pi


@LEAN
def _minus_log(first, out):
    """out = -ln((upper 53 bits of first + 1) 2^-53)."""
    for i in range(first.size):
        out[i] = (np.float64(np.int64(first[i] >> np.uint64(11))) + 1.0) * _STEP
    bits = out.view(np.int64)
    for i in range(first.size):
        twos = (bits[i] >> 52) - 1022
        # In [1, 2), and then f in [sqrt(1/2) - 1, sqrt(2) - 1].
        bits[i] = (bits[i] & _MANTISSA) | _ONE
        mantissa = 0.5 * out[i]
        small = mantissa < 0.70710678118654752440
        f = (out[i] if small else mantissa) - 1.0
        k = np.float64(twos - 1 if small else twos)
        s = f / (2.0 + f)
        z = s * s
        rest = z * (_L1 + z * (_L2 + z * (_L3 + z * (_L4 + z * (_L5 + z * (_L6 + z * _L7))))))
        half = 0.5 * f * f
        out[i] = -(k * _LN2_HIGH - ((half - (s * (half + rest) + k * _LN2_LOW)) - f))


@LEAN
def fill(words, scale, out):
    """Fill out (2, N) with scale times the real and imaginary parts of N complex normals from words (2 N,) uint64."""
    count = out.shape[1]
    real, imaginary = out[0], out[1]
    _minus_log(words[0::2], real)
    for i in range(count):
        turns = np.float64(np.int64(words[2 * i + 1] >> np.uint64(11))) * _STEP
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
        turned = np.int64(quarter) & 3
        x = sine if turned & 1 else cosine
        y = cosine if turned & 1 else sine
        real[i] = scale * (radius * (-x if turned == 1 or turned == 2 else x))
        imaginary[i] = scale * (radius * (-y if turned >= 2 else y))


def interleaved(words: np.ndarray) -> np.ndarray:
    """Return what `Draws.standard_normal` makes of raw words (2 N,) uint64: 2 N float64, real parts at even places."""
    # Loops over contiguous real parts become vector instructions; loops over alternating parts do not.
    out = np.empty((len(words) // 2, 2))
    out[:, 0], out[:, 1] = circular(words)
    return out.ravel()


def circular(words: np.ndarray, scale: float = 1.0) -> np.ndarray:
    """Return complex normals from raw words (2 N,) uint64 as (2, N) float64, real and imaginary parts.

    Each part has mean 0 and standard deviation `scale`; the k-th number is `scale` times draws 2 k and 2 k + 1 of
    `Draws.standard_normal` on the same words.
    """
    out = np.empty((2, len(words) // 2))
    fill(words, scale, out)
    return out
