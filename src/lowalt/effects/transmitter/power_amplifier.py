"""Power amplifier that saturates: the waveform is compressed, so subcarriers lose amplitude and disturb each other.

The amplifier has no memory and no phase distortion. It acts on the OFDM symbol's time signal, sampled four times
as often as the subcarriers need, so that distortion beyond the band leaves the band. Echoes are those of the distorted
waveform; the receiver divides by the data it knows. A Gaussian signal comes out as a smaller copy of itself plus
distortion (Bussgang): `soft_limit` states both for an ideal limiter.
"""

import math
from functools import cache

import numpy as np

from lowalt.common.memory import aligned
from lowalt.effects import transforms
from lowalt.effects.transmitter import _amplifier_loops

SOURCE = (
    "C. Rapp, Effects of HPA-nonlinearity on a 4-DPSK/OFDM-signal for a digital sound broadcasting system, ESA SP-332, "
    "1991; H. Ochiai, H. Imai, Performance analysis of deliberately clipped OFDM signals, IEEE Trans. Commun. 50(1), "
    "2002 (equivalent gain and distortion); smoothness 2 of a solid-state amplifier, and back-off: estimate"
)
DEFAULTS = {"backoff_db": 8.0, "smoothness": 2.0}

TOGETHER = 16
"""Symbols amplified together; their samples fit into a core's cache."""
OVERSAMPLING = 4


def idle(settings: dict) -> bool:
    """Return whether the amplifier never saturates."""
    return settings["backoff_db"] is None


def rapp(samples: np.ndarray, saturation: float, smoothness: float) -> np.ndarray:
    """Return amplified samples (any shape), of gain one at small amplitudes and at most `saturation`.

    Source: Rapp 1991: g(a) = a / (1 + (a / A)^(2p))^(1/(2p)).
    """
    result = np.array(samples, np.complex128, order="C")
    _compress(result.reshape(-1), saturation, smoothness)
    return result


def _compress(samples: np.ndarray, saturation: float, smoothness: float) -> None:
    """Amplify samples (K,) in place."""
    _amplifier_loops.compress(samples, 1.0 / saturation**2, float(smoothness), aligned(2, 256))


@cache
def _later() -> np.ndarray:
    """Phases (OVERSAMPLING, 2, LENGTH) of the subcarriers in the shares of a sample (`_amplifier_loops.symbols`)."""
    count = transforms.LENGTH
    turns = np.outer(np.arange(OVERSAMPLING), np.fft.fftfreq(count) / OVERSAMPLING)
    phase = np.exp(2j * np.pi * turns)
    return np.stack([phase.real, phase.imag], axis=1, out=aligned(OVERSAMPLING, 2, count))


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
    half, length = count // 2, OVERSAMPLING * count
    last = length - half
    saturation = math.sqrt(count) * 10 ** (settings["backoff_db"] / 20)
    result = np.empty(sent.shape, np.complex128)
    if count == transforms.LENGTH:
        over, smoothness, tables = 1.0 / saturation**2, float(settings["smoothness"]), (_later(), transforms.table())
        _amplifier_loops.symbols(
            np.ascontiguousarray(sent), over, smoothness, *tables, aligned(8, count), result
        )  # fmt: skip
        return result
    work = np.empty((min(TOGETHER, symbols), length), np.complex128)
    for first in range(0, symbols, TOGETHER):
        data = sent[first : first + TOGETHER]
        wide = work[: len(data)]
        # The transform's order: the oscillator's subcarrier and those above it, then those below it at the end.
        wide[:, : count - half], wide[:, last:] = data[:, half:], data[:, :half]
        wide[:, count - half : last] = 0.0
        # Without the inverse transform's 1 / length, the mean power of the samples is the number of subcarriers.
        np.fft.ifft(wide, axis=1, norm="forward", out=wide)
        _compress(wide.reshape(-1), saturation, settings["smoothness"])
        np.fft.fft(wide, axis=1, norm="forward", out=wide)
        amplified = result[first : first + TOGETHER]
        amplified[:, half:], amplified[:, :half] = wide[:, : count - half], wide[:, last:]
    return result
