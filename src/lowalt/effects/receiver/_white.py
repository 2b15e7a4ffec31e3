"""Circular white Gaussian noise, drawn and added in one go."""

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.common.normals import circular
from lowalt.effects import transforms
from lowalt.effects.waveform import Frame


@LEAN
def _joined(real, imaginary, out):
    """Fill out (K,) complex128 with real and imaginary (K,)."""
    for k in range(np.uint64(len(out))):
        out[k] = complex(real[k], imaginary[k])


@LEAN
def _added(samples, real, imaginary, out):
    """Fill out (K,) with samples (K,) plus real and imaginary (K,)."""
    for k in range(np.uint64(len(out))):
        out[k] = complex(samples[k].real + real[k], samples[k].imag + imaginary[k])


def with_noise(name: str, samples: np.ndarray, scale: float, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) plus the noise of the effect `name`, of the standard deviation `scale` in each part.

    Source: `lowalt.common.normals.circular`, whose k-th number is for the k-th sample, symbol by symbol.
    """
    real, imaginary = frame.once(name, lambda: circular(rng.bit_generator.random_raw(2 * samples.size), scale))
    out = np.empty(samples.shape, np.complex128)
    _added(np.ascontiguousarray(samples, np.complex128).reshape(-1), real, imaginary, out.reshape(-1))
    return out


def tones_with_noise(name: str, tones: np.ndarray, scale: float, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return tones (N, M), which are overwritten, plus those of the noise that `with_noise` adds to their samples."""
    tones += frame.once(f"tones of {name}", lambda: _tones(tones.shape, scale, rng))
    return tones


def _tones(shape: tuple[int, ...], scale: float, rng: np.random.Generator) -> np.ndarray:
    """The transform of noise (N, M)."""
    noise = np.empty(shape, np.complex128)
    _joined(*circular(rng.bit_generator.random_raw(2 * noise.size), scale), noise.reshape(-1))
    return transforms.forward(noise, out=noise)
