"""Complex white Gaussian noise at a set SNR; the reference is the signal's own mean power."""

import math

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.numerics.normals import circular
from lowalt.numerics.power import rms


def add_noise(
    signal: np.ndarray, snr_db: float, rng: np.random.Generator | None, power: float | None = None
) -> np.ndarray:
    """Return `signal` plus circular complex Gaussian noise at `snr_db`, complex128 of the same shape (N,).

    The noise power is `power` / 10^(snr_db / 10), where `power` is mean |signal|^2 by default; give the power of
    the target's echo where the signal holds more than that. At an SNR of +inf nothing is drawn and the signal is
    returned unchanged. A signal of zeros has no power to refer to and stays zeros.
    Raises: InputError for an empty or non-finite signal, an SNR that is NaN or -inf, a negative power, or no generator
    where noise is to be drawn.
    Source: paper, section V-A; unit-power circular noise has variance 1/2 a component.

        >>> signal = np.exp(1j * np.arange(10_000))
        >>> noise = add_noise(signal, 13.0, np.random.default_rng(0)) - signal
        >>> round(float(10 * np.log10(np.mean(abs(noise) ** 2))), 1)
        -13.0
    """
    signal = np.asarray(signal, dtype=np.complex128)
    if signal.size == 0 or not np.isfinite(signal).all():
        raise InputError(f"noise: signal of shape {signal.shape} is empty or not finite")
    if math.isnan(snr_db) or snr_db == -math.inf:
        raise InputError(f"noise: SNR is {snr_db} dB, expected a number or +inf")
    if snr_db == math.inf:
        return signal.copy()
    if power is not None and not 0 <= power < math.inf:
        raise InputError(f"noise: power is {power} W, expected a finite number >= 0")
    scale = rms(signal) if power is None else math.sqrt(power)
    if scale == 0:
        return signal.copy()
    if rng is None:
        raise InputError(f"noise: no generator for an SNR of {snr_db} dB, expected one below +inf")
    # Half the noise's power is in each part: sqrt(1/2) 10^(-SNR / 20).
    share = math.sqrt(0.5) * float(portable.exp(-snr_db * (portable.LN_10 / 20)))
    real, imaginary = circular(rng.bit_generator.random_raw(2 * signal.size), scale * share)
    result = np.empty(signal.shape, np.complex128)
    result.real, result.imag = (
        part + more.reshape(signal.shape) for part, more in ((signal.real, real), (signal.imag, imaginary))
    )
    return result
