"""Sines, cosines and matrix products of the poses, with the same bits on every processor.

numpy's sine depends on the processor's vector instructions, and a BLAS adds in an order of its own
with fused operations. Here every operation is one that IEEE 754 fixes, in the order written.
"""

import numpy as np

from lowalt.machine.jit import LEAN
from lowalt.numerics.exact.arithmetic import multiply
from lowalt.numerics.exact.constants import PI, pair
from lowalt.numerics.exact.sines import sine_cosine

TURNS = pair(1 / (2 * PI))
"""Turns of a radian."""


@LEAN
def _sines(angles, sines, cosines):
    """Fill `sines` and `cosines` (K,) for angles (K,) rad."""
    for i in range(np.uint64(len(angles))):
        s, c = sine_cosine(multiply(TURNS, (angles[i], 0.0)))
        sines[i] = s[0]
        cosines[i] = c[0]


def sines_cosines(angles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return sine and cosine of angles (N,) rad, each rounded from about 24 digits."""
    sines = np.empty(len(angles))
    cosines = np.empty(len(angles))
    _sines(angles, sines, cosines)
    return sines, cosines


@LEAN
def _product(a, b, out):
    """Fill `out` (N, C) with the product of a (N, K) and b (K, C), summed in the order of K."""
    for n in range(np.uint64(a.shape[0])):
        for c in range(np.uint64(b.shape[1])):
            out[n, c] = a[n, 0] * b[0, c]
        for k in range(np.uint64(1), np.uint64(a.shape[1])):
            for c in range(np.uint64(b.shape[1])):
                out[n, c] += a[n, k] * b[k, c]


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the matrix product of (N, K) and (K, C): (N, C), added from the first k on."""
    out = np.empty((a.shape[0], b.shape[1]))
    _product(np.ascontiguousarray(a), np.ascontiguousarray(b), out)
    return out
