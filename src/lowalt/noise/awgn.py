"""Complex white Gaussian noise at a set SNR, for one signal and for a chunk.

The mean power of a signal is the reference.
"""

import math
from collections.abc import Callable

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.numerics.normals import circular
from lowalt.numerics.portable import rms
from lowalt.numerics.streams import stream


def add_noise(
    signal: np.ndarray, snr_db: float, rng: np.random.Generator | None, power: float | None = None
) -> np.ndarray:
    """Return `signal` plus circular complex Gaussian noise at `snr_db`, complex128 (N,).

    The signal may have any shape, which the result has, too.

    The noise power is `power` / 10^(snr_db / 10), where `power` is mean |signal|^2 by default; give
    the power of the target's echo where the signal holds more than that. At an SNR of +inf nothing
    is drawn and the signal is returned unchanged. A signal of zeros has no power to refer to and
    stays zeros.
    Raises: InputError for an empty or non-finite signal, an SNR that is NaN or -inf, a negative
    power, or no generator where noise is to be drawn.
    Source: paper, section V-A; unit-power circular noise has variance 1/2 per component.

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
    words = rng.bit_generator.random_raw(2 * signal.size)
    real, imaginary = circular(words, scale * share)
    result = np.empty(signal.shape, np.complex128)
    result.real = signal.real + real.reshape(signal.shape)
    result.imag = signal.imag + imaginary.reshape(signal.shape)
    return result


def noisy_signals(
    echoes: np.ndarray,
    rows: list[dict],
    stations: list[str],
    snrs: list[float],
    seed: int,
    powers: np.ndarray | None = None,
    behind: Callable[[np.ndarray], np.ndarray] | None = None,
) -> np.ndarray:
    """Return noisy signals (models, snrs, stations, N) complex64 of clean echoes.

    echoes: (stations, models, N).

    rows: the motion table; powers: (stations, models) W that SNRs refer to, each echo's own by
    default; behind: filters noise (N,) as the scene's canceller does, if there is one. Echoes
    (stations, models, snrs, N) already contain their noise. Each (subtype, model, station, SNR) has
    its own noise stream.
    """
    if np.ndim(echoes) == 4:
        return np.ascontiguousarray(np.moveaxis(echoes, 0, 2), np.complex64)
    result = np.empty((len(rows), len(snrs), len(stations), echoes.shape[-1]), np.complex64)
    for model, row in enumerate(rows):
        for level, snr_db in enumerate(snrs):
            for station, name in enumerate(stations):
                rng = None
                if not np.isposinf(snr_db):
                    rng = stream(seed, "noise", row["subtype"], row["model"], name, snr_db)
                power = None
                if powers is not None:
                    power = float(powers[station, model])
                noisy = _noisy(echoes[station, model], snr_db, rng, power, behind)
                result[model, level, station] = noisy
    return result


def _noisy(
    echo: np.ndarray,
    snr_db: float,
    rng: np.random.Generator | None,
    power: float | None,
    behind: Callable[[np.ndarray], np.ndarray] | None,
) -> np.ndarray:
    """Return an echo (N,) with noise at one SNR."""
    if behind is None or rng is None:
        return add_noise(echo, snr_db, rng, power)
    return echo + behind(add_noise(np.zeros(len(echo)), snr_db, rng, power))
