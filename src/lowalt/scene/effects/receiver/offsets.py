"""Offsets of a station's clocks, and what they do to time samples.

An offset has a fixed part, for all stations or each by its name, and a drawn part. That is normal, cut at three
standard deviations, so that a scene's largest offset is known beforehand.
"""

from statistics import NormalDist

import numpy as np
from scipy import fft

from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.machine.jit import VECTOR
from lowalt.scene.checks import CheckedScene
from lowalt.scene.phasor import phasor
from lowalt.scene.waveform import Look

CUT = 3.0
"""Standard deviations at which draws are cut."""


def fixed(value: float | dict[str, float], station: str) -> float:
    """Return the fixed part of a station's offset: a number for all, or the mapping's entry (0 where it has none)."""
    return float(value.get(station, 0.0)) if isinstance(value, dict) else float(value)


def drawn(rng: np.random.Generator) -> float:
    """Return a standard normal number cut at +-3, by one uniform draw through the inverse distribution."""
    tail = NormalDist().cdf(-CUT)
    return NormalDist().inv_cdf(tail + (1 - 2 * tail) * rng.random())


def largest(value: float | dict[str, float], sigma: float) -> float:
    """Return the largest magnitude that fixed part and drawn part can reach together."""
    parts = value.values() if isinstance(value, dict) else [value]
    return max((abs(part) for part in parts), default=0.0) + CUT * sigma


def idle(value: float | dict[str, float], sigma: float) -> bool:
    """Return True where no station has an offset."""
    return largest(value, sigma) == 0


def check_stations(key: str, value: float | dict[str, float], network: Network) -> None:
    """Raise InputError naming `key` where a mapping names a station that the network does not have."""
    names = [station.name for station in network.stations]
    unknown = sorted(set(value) - set(names)) if isinstance(value, dict) else []
    if unknown:
        raise InputError(f"{key}: station(s) {unknown} are not in the network, expected some of {names}")


def check_oscillator(effect: str, scene: CheckedScene) -> None:
    """Raise InputError naming `effect` where transmitter and receiver share one oscillator, and so have no offset."""
    noise = scene.effects.get("phase_noise")
    if noise and noise["shared"]:
        raise InputError(
            f"effects.{effect}: effects.phase_noise has shared: true, one oscillator for sending and receiving, which "
            "has no offset against itself; expected shared: false (a receiver of its own) or no offset"
        )


def turned(samples: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return samples (N, M) times exp(j 2 pi turns), turns (N, M)."""
    result = np.empty(samples.shape, np.complex128)
    _turned(np.ascontiguousarray(samples), turns, result)
    return result


@VECTOR
def _turned(samples, turns, out):
    """Fill out (N, M) as `turned` returns it; NumPy takes five times as long for cosines and sines."""
    for n in range(len(samples)):
        row, angle, new = samples[n], turns[n], out[n]
        for i in range(np.uint64(len(row))):
            c, s = phasor(angle[i])
            x, y = row[i].real, row[i].imag
            new[i] = complex(x * c - y * s, x * s + y * c)


def risen(samples: np.ndarray, rise_hz: float, look: Look) -> np.ndarray:
    """Return samples (N, M) all of whose frequencies are higher by `rise_hz`: turned at their absolute times."""
    between = np.exp(2j * np.pi * np.mod(rise_hz * look.times_s, 1.0))
    return samples * between[:, None] * np.exp(2j * np.pi * rise_hz * look.within_s)


def delayed(samples: np.ndarray, delay_s: float, look: Look) -> np.ndarray:
    """Return samples (N, M) later by `delay_s` in the symbols' cyclic extension: a phase linear over subcarriers."""
    turn = np.exp(-2j * np.pi * delay_s * fft.ifftshift(look.baseband_hz))
    return fft.ifft(fft.fft(samples, axis=-1) * turn, axis=-1, overwrite_x=True)
