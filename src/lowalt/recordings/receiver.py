"""Errors that a cheap continuous-wave receiver adds, a setting each: wander, static leak, noise, flicker, hum.

Everything is relative to the echo's own mean power over the stretch, so that a setting means the same near and far.
Nothing else of the twin knows of it.
"""

from dataclasses import dataclass

import numpy as np

from lowalt.common.command import pick
from lowalt.common.power import rms
from lowalt.noise.awgn import add_noise


@dataclass(frozen=True)
class Receiver:
    """snr_db: echo over white noise within the receiver's band; flicker_db and flicker_hz: slow noise with a 1/f^2
    spectrum above its corner, over the white noise's density at the corner; wander_db: rms of a slow change of the
    amplitude; leak_db: what stands still, over the echo; hum_db and hum_hz: a line, over the echo."""

    snr_db: float
    flicker_db: float
    flicker_hz: float
    wander_db: float
    leak_db: float
    hum_db: float
    hum_hz: float

    @classmethod
    def from_settings(cls, block: dict) -> "Receiver":
        """Build from a block with exactly the fields' names.

        Raises: InputError naming a missing or unknown key.
        """
        return cls(*(float(value) for value in pick(block, *cls.__dataclass_fields__)))


def shaped(count: int, rate_hz: float, corner_hz: float, rng: np.random.Generator) -> np.ndarray:
    """Return complex Gaussian noise (count,) whose density falls as 1 / (1 + (f / corner)^2) from unity at f = 0.

    Unity is the density of white noise of unit power.
    """
    white = rng.standard_normal((2, count))
    frequency = np.fft.fftfreq(count, 1 / rate_hz)
    spectrum = np.fft.fft(white[0] + 1j * white[1]) * np.sqrt(0.5 / (1 + (frequency / corner_hz) ** 2))
    return np.fft.ifft(spectrum)


def received(echo: np.ndarray, rate_hz: float, settings: Receiver, real: bool, rng: np.random.Generator) -> np.ndarray:
    """Return the receiver's samples (N,) of a complex echo (N,): float64 where the channel is real, else complex128."""
    count = len(echo)
    power = rms(echo) ** 2
    slow = shaped(count, rate_hz, 0.5, rng).real
    spread = slow.std() or 1.0
    result = echo * 10 ** (settings.wander_db / 20 * slow / spread)
    level = np.sqrt(power) * 10 ** (-settings.snr_db / 20)
    flicker = 10 ** (settings.flicker_db / 20) * level * shaped(count, rate_hz, settings.flicker_hz, rng)
    angle = rng.uniform(0, 2 * np.pi, 2)
    static = np.sqrt(power) * 10 ** (settings.leak_db / 20) * np.exp(1j * angle[0])
    time = np.arange(count) / rate_hz
    hum = np.sqrt(power) * 10 ** (settings.hum_db / 20) * np.cos(2 * np.pi * settings.hum_hz * time + angle[1])
    result = add_noise(result, settings.snr_db, rng, power) + flicker + static + hum
    return result.real if real else result
