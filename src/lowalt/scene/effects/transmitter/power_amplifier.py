"""Power amplifier that saturates: the waveform is compressed.

Subcarriers lose amplitude and disturb each other.

The amplifier has no memory and no phase distortion: an amplitude a, relative to saturation, becomes
a / (1 + a^4)^(1/4). It acts on the OFDM symbol's time signal, sampled four times as often as the
subcarriers need, so that distortion beyond the band leaves the band. Echoes are those of the
distorted waveform; the receiver divides by the data it knows. A Gaussian signal comes out as a
smaller copy of itself plus distortion (Bussgang).
"""

import math

import numpy as np
from scipy import fft

SOURCE = (
    "C. Rapp, Effects of HPA-nonlinearity on a 4-DPSK/OFDM-signal for a digital sound broadcasting "
    "system, ESA SP-332, 1991; smoothness 2 of a solid-state amplifier, and back-off: estimate"
)
DEFAULTS = {"backoff_db": 8.0}
IDLE = [{"backoff_db": None}]
UNMODELLED = ("fmcw", "cw")

OVERSAMPLING = 4


def rapp(samples: np.ndarray, saturation: float) -> np.ndarray:
    """Return amplified samples (any shape).

    The gain is one at small amplitudes, and samples reach at most `saturation` A.

    Source: Rapp 1991: g(a) = a / (1 + (a / A)^(2p))^(1/(2p)) with p = 2.
    """
    power = (samples.real**2 + samples.imag**2) / saturation**2
    return samples / np.sqrt(np.sqrt(1.0 + power * power))


def aired(settings: dict, sent: np.ndarray) -> np.ndarray:
    """Return the subcarriers (N, M) that are on the air when the data `sent` are amplified.

    sent: (N, M), of mean power one.

    Saturation is at `backoff_db` over the signal's mean power. Subcarriers stand around the
    oscillator at M // 2.
    """
    symbols, count = sent.shape
    length = OVERSAMPLING * count
    first = length // 2 - count // 2
    wide = np.zeros((symbols, length), np.complex128)
    wide[:, first : first + count] = sent
    # Without the inverse transform's 1 / length, the mean power of the samples is the number of
    # subcarriers.
    samples = fft.ifft(fft.ifftshift(wide, axes=1), axis=1, norm="forward", overwrite_x=True)
    amplified = rapp(samples, math.sqrt(count) * 10 ** (settings["backoff_db"] / 20))
    spectrum = fft.fftshift(fft.fft(amplified, axis=1, norm="forward", overwrite_x=True), axes=1)
    return np.ascontiguousarray(spectrum[:, first : first + count])
