"""Power amplifier that saturates: the waveform is compressed, so subcarriers lose amplitude and disturb each other.

The amplifier has no memory and no phase distortion. It acts on the OFDM symbol's time signal, sampled four times
as often as the subcarriers need, so that distortion beyond the band leaves the band. Echoes are those of the distorted
waveform; the receiver divides by the data it knows. A Gaussian signal comes out as a smaller copy of itself plus
distortion (Bussgang): `soft_limit` states both for an ideal limiter.
"""

import math

import numpy as np
from scipy import fft

SOURCE = (
    "C. Rapp, Effects of HPA-nonlinearity on a 4-DPSK/OFDM-signal for a digital sound broadcasting system, ESA SP-332, "
    "1991; H. Ochiai, H. Imai, Performance analysis of deliberately clipped OFDM signals, IEEE Trans. Commun. 50(1), "
    "2002 (equivalent gain and distortion); smoothness 2 of a solid-state amplifier, and back-off: estimate"
)
DEFAULTS = {"backoff_db": 8.0, "smoothness": 2.0}

OVERSAMPLING = 4


def idle(settings: dict) -> bool:
    """Return whether the amplifier never saturates."""
    return settings["backoff_db"] is None


def rapp(samples: np.ndarray, saturation: float, smoothness: float) -> np.ndarray:
    """Return amplified samples (any shape), of gain one at small amplitudes and at most `saturation`.

    Source: Rapp 1991: g(a) = a / (1 + (a / A)^(2p))^(1/(2p)).
    """
    power = (samples.real**2 + samples.imag**2) / saturation**2
    if smoothness == 2:
        # Roots cost a tenth of powers.
        return samples / np.sqrt(np.sqrt(1.0 + power * power))
    return samples * (1.0 + power**smoothness) ** (-0.5 / smoothness)


def soft_limit(backoff_db: float) -> tuple[float, float]:
    """Return the equivalent gain and the distortion's share of the sent power, of a limiter and a Gaussian signal.

    The limit of `rapp` for large smoothness; the distortion is that of all frequencies, inside and outside the band.
    Source: Ochiai and Imai 2002: gain 1 - exp(-g^2) + sqrt(pi) g erfc(g) / 2, power out 1 - exp(-g^2), g^2 = back-off.
    """
    g = 10 ** (backoff_db / 20)
    gain = 1.0 - math.exp(-g * g) + 0.5 * math.sqrt(math.pi) * g * math.erfc(g)
    return gain, 1.0 - math.exp(-g * g) - gain**2


def aired(settings: dict, sent: np.ndarray) -> np.ndarray:
    """Return the subcarriers (N, M) that are on the air when the data `sent` (N, M), of mean power one, are amplified.

    Saturation is at `backoff_db` over the signal's mean power. Subcarriers stand around the oscillator at M // 2.
    """
    symbols, count = sent.shape
    length = OVERSAMPLING * count
    first = length // 2 - count // 2
    wide = np.zeros((symbols, length), np.complex128)
    wide[:, first : first + count] = sent
    # Without the inverse transform's 1 / length, the mean power of the samples is the number of subcarriers.
    samples = fft.ifft(fft.ifftshift(wide, axes=1), axis=1, norm="forward", overwrite_x=True)
    amplified = rapp(samples, math.sqrt(count) * 10 ** (settings["backoff_db"] / 20), settings["smoothness"])
    spectrum = fft.fftshift(fft.fft(amplified, axis=1, norm="forward", overwrite_x=True), axes=1)
    return np.ascontiguousarray(spectrum[:, first : first + count])
