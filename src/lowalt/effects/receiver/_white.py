"""Circular white Gaussian noise as a receiver effect: alike in all range cells, whatever the data of unit modulus."""

import numpy as np

from lowalt.common.raw_words import words
from lowalt.effects import transforms, waveform
from lowalt.effects.range_noise import RangeNoise
from lowalt.effects.waveform import Frame


def range_noise(name: str, scale: float, frame: Frame, rng: np.random.Generator) -> RangeNoise:
    """Return the noise of the effect `name`, of the standard deviation `scale` in each part of a range cell."""
    shape = frame.sent.shape
    return frame.once(name, lambda: RangeNoise(words(rng.bit_generator, 2 * shape[0] * shape[1]), shape, scale))


def tones_with_noise(tones: np.ndarray, noise: RangeNoise, frame: Frame) -> np.ndarray:
    """Return tones (N, M), which are overwritten, plus those of noise.

    It is carried by the data's phases alone: then it is white whatever the data, and where they have unit modulus, that
    of the range cells.
    """
    tones += waveform.tones_of(noise.response, frame.sent / abs(frame.sent))
    return tones


def with_noise(samples: np.ndarray, noise: RangeNoise, frame: Frame) -> np.ndarray:
    """Return samples (N, M) plus those of noise (`tones_with_noise`)."""
    tones = tones_with_noise(np.zeros(samples.shape, np.complex128), noise, frame)
    return samples + transforms.inverse(tones, out=tones)
