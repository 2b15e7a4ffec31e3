"""Circular white Gaussian noise, drawn and added in one go."""

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.common.normals import circular


@LEAN
def _added(samples, real, imaginary, out):
    """Fill out (K,) with samples (K,) plus real and imaginary (K,); without samples (0,) with these alone."""
    if len(samples) == 0:
        for k in range(np.uint64(len(out))):
            out[k] = complex(real[k], imaginary[k])
        return
    for k in range(np.uint64(len(out))):
        out[k] = complex(samples[k].real + real[k], samples[k].imag + imaginary[k])


def with_noise(samples: np.ndarray, scale: float, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) plus noise with the standard deviation `scale` in each part.

    Source: `lowalt.common.normals.circular`, whose k-th number is for the k-th sample, symbol by symbol.
    """
    return _plus(np.ascontiguousarray(samples, np.complex128), samples.shape, scale, rng)


def tones_with_noise(tones: np.ndarray, scale: float, rng: np.random.Generator) -> np.ndarray:
    """Return tones (N, M), which are overwritten, plus those of the noise that `with_noise` adds to their samples."""
    noise = _plus(np.empty(0, np.complex128), tones.shape, scale, rng)
    tones += np.fft.fft(noise, axis=1, out=noise)
    return tones


def _plus(samples: np.ndarray, shape: tuple[int, int], scale: float, rng: np.random.Generator) -> np.ndarray:
    """Noise of this shape, plus samples where there are any."""
    out = np.empty(shape, np.complex128)
    real, imaginary = circular(rng.bit_generator.random_raw(2 * out.size), scale)
    _added(samples.reshape(-1), real, imaginary, out.reshape(-1))
    return out
