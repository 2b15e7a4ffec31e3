"""Circular white Gaussian noise, drawn and added in one go."""

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.common.normals import circular


@LEAN
def _added(samples, real, imaginary, out):
    """Fill out (K,) with samples (K,) plus real and imaginary (K,)."""
    for k in range(np.uint64(len(out))):
        out[k] = complex(samples[k].real + real[k], samples[k].imag + imaginary[k])


def with_noise(samples: np.ndarray, scale: float, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) plus noise with the standard deviation `scale` in each part.

    Source: `lowalt.common.normals.circular`, whose k-th number is for the k-th sample, symbol by symbol.
    """
    real, imaginary = circular(rng.bit_generator.random_raw(2 * samples.size), scale)
    out = np.empty(samples.shape, np.complex128)
    _added(np.ascontiguousarray(samples, np.complex128).reshape(-1), real, imaginary, out.reshape(-1))
    return out
