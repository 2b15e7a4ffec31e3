"""Noise of a range profile: white noise of one power in every range cell, next to the noise that a signal has."""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.noise.awgn import add_noise
from lowalt.numerics.power import rms


def noisy_profile(
    profile: np.ndarray, signal: np.ndarray, snr_db: float, rng: np.random.Generator | None
) -> np.ndarray:
    """Return a clean profile (N, cells) with noise in every cell, complex128; the middle cell is `signal` (N,).

    signal: the noisy signal of the strongest cell, which is the middle one, so that all images of a sample share its
    noise. The inverse DFT turns white noise over subcarriers into white noise over cells, of the power that the SNR
    gives the strongest cell. At an SNR of +inf nothing is drawn.
    Raises: InputError for shapes that do not fit, and as `add_noise`.
    Source: paper, section V-A; the other cells are this project's reading of it.
    """
    profile = np.asarray(profile, np.complex128)
    if profile.ndim != 2 or profile.shape[1] % 2 == 0 or np.shape(signal) != profile.shape[:1]:
        raise InputError(f"noise: profile {profile.shape} of a signal {np.shape(signal)}, expected (N, odd) and (N,)")
    middle = profile.shape[1] // 2
    result = add_noise(profile, snr_db, rng, rms(np.ascontiguousarray(profile[:, middle])) ** 2)
    result[:, middle] = signal
    return result
