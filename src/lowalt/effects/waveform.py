"""The OFDM waveform of a look: the data sent, the samples received, and the receiver's view of both.

Samples are the complex baseband around the station's local oscillator, which stands at subcarrier M // 2 as in NR
(3GPP TS 38.211, 5.3.1 and 5.4): subcarrier m lies at (m - M // 2) df. Only the useful part of each symbol is kept.
Eq. 7 assumes that the cyclic prefix covers every echo; the effect `cyclic_prefix` treats echoes that are later.
Impairments are in `effects.receiver`.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from lowalt.common.network import Network, Station
from lowalt.effects import transforms
from lowalt.effects.phasors import phasors
from lowalt.effects.tone_loops import HALF, carried, divided, from_signs, signs_of

QPSK = HALF * np.array([1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j])
"""The four data symbols, of unit modulus."""


def sent(rng: np.random.Generator, symbols: int, subcarriers: int) -> np.ndarray:
    """Return random QPSK data (symbols, subcarriers) complex128 of unit modulus, all four values equally likely.

    Source: paper, Eq. 5, whose data symbols have unit power; 3GPP TS 38.211, 5.1.3 (QPSK).
    """
    return of_signs(sent_signs(rng, symbols, subcarriers))


def sent_signs(rng: np.random.Generator, symbols: int, subcarriers: int) -> np.ndarray:
    """Return the data of `sent` as signs (2, symbols, subcarriers) int8, of real and imaginary parts: 1 or -1."""
    count = symbols * subcarriers
    # The upper two bits of each byte say which symbol of QPSK it is, the lowest byte of a word comes first.
    words = rng.bit_generator.random_raw(-(-count // 8)).astype("<u8", copy=False)
    signs = np.empty((2, len(words)), "<u8")
    signs_of(words, signs[0], signs[1])
    return signs.view(np.int8)[:, :count].reshape(2, symbols, subcarriers)


def of_signs(signs: np.ndarray) -> np.ndarray:
    """Return the QPSK data (N, M) complex128 of signs (2, N, M) int8."""
    result = np.empty(signs.shape[1:], np.complex128)
    from_signs(np.ascontiguousarray(signs), result)
    return result


def transmit(response: np.ndarray, data: np.ndarray) -> np.ndarray:
    """Return the received time samples (N, M) of frequency responses (N, M) that carried `data` (N, M).

    Sample i is (1/M) sum_m response[m] data[m] exp(j 2 pi (m - M // 2) i / M), so its 2-norm is 1 / sqrt(M) of the
    response's. Source: 3GPP TS 38.211, 5.3.1.
    """
    response, data = _whole(response, data)
    if response.ndim == 2 and response.shape[1] == transforms.LENGTH:
        return transforms.samples(response, data)
    tones = tones_of(response, data)
    return transforms.inverse(tones, out=tones)


def tones_of(response: np.ndarray, data: np.ndarray) -> np.ndarray:
    """Return the transform (N, M) of the samples of `transmit`."""
    response, data = _whole(response, data)
    tones = np.empty(response.shape, np.complex128)
    carried(response, data, tones)
    return tones


def _whole(response: np.ndarray, data: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Both as whole arrays (N, M): a view that repeats its rows would ask for machine code of its own."""
    shape = np.broadcast_shapes(response.shape, data.shape)
    given = (one if one.shape == shape else np.broadcast_to(one, shape) for one in (response, data))
    first, second = (np.ascontiguousarray(one, np.complex128) for one in given)
    return first, second


class Carried(NamedTuple):
    """Symbols on the air whose tones are not worked out yet: responses (N, M) and the data (N, M) that they carry."""

    response: np.ndarray
    data: np.ndarray


def carrying(response: np.ndarray, data: np.ndarray) -> Carried:
    """Return responses and data, each of which broadcasts to (N, M), as `Carried`."""
    return Carried(*_whole(response, data))


def demodulate(samples: np.ndarray, data: np.ndarray) -> np.ndarray:
    """Return the responses (N, M) of time samples (N, M) that carried `data`: the inverse of `transmit`.

    The division is by the sent symbol s; the paper's Eq. 24 would need its conjugate. The response alone remains.
    """
    return without(transforms.forward(samples), np.broadcast_to(data, samples.shape))


def without(tones: np.ndarray, data: np.ndarray) -> np.ndarray:
    """Return the responses (N, M) of tones (N, M) of samples that carried `data` (N, M) of unit modulus."""
    result = np.empty_like(tones)
    divided(tones, data, True, result)
    return result


def turned(angle_rad: np.ndarray) -> np.ndarray:
    """Return exp(j angle) to rounding, angles of any shape, in about a tenth of the complex exponential's time."""
    angle = np.ascontiguousarray(angle_rad, np.float64)
    result = np.empty(angle.shape, np.complex128)
    phasors(angle.reshape(-1), result.reshape(-1))
    return result


def baseband_hz(network: Network) -> np.ndarray:
    """Return the frequency of each subcarrier from the local oscillator, (m - M // 2) df (Hz), shape (M,)."""
    return (np.arange(network.subcarriers) - network.subcarriers // 2) * network.subcarrier_spacing_hz


@dataclass(frozen=True)
class Frame:
    """One coherent processing interval (look) as the receiver of one station knows it."""

    network: Network
    station: Station
    sent: np.ndarray
    """(N, M) complex128, the data, of mean power one."""
    reference: float = 0.0
    """The target echo's mean |Y_bin|^2 (W)."""
    delay_s: float = 0.0
    """Two-way delay of the target's reference point at n = 0, 2 r / c (s)."""
    aired: np.ndarray | None = None
    """(N, M) subcarriers on the air where an amplifier distorts them, None for the data themselves."""
    starts_s: np.ndarray | None = None
    """(N,) s, start of each symbol's useful part where it is not n T_r."""
    drawn: dict[str, Any] | None = field(default=None, repr=False, compare=False)
    """What effects have drawn for the look, by name, where it is computed more than once with the same streams."""

    def once(self, name: str, draw: Callable[[], Any]) -> Any:
        """Return what `draw` returns, for the effect `name`: of a look that is computed again, what it returned."""
        if self.drawn is None:
            return draw()
        if name not in self.drawn:
            self.drawn[name] = draw()
        return self.drawn[name]

    @property
    def waveform(self) -> np.ndarray:
        """Subcarriers (N, M) on the air."""
        return self.sent if self.aired is None else self.aired

    @property
    def sample_s(self) -> float:
        """Time between two samples, 1 / (M df) (s)."""
        return 1 / (self.network.subcarriers * self.network.subcarrier_spacing_hz)

    @cached_property
    def symbol_times_s(self) -> np.ndarray:
        """Start of each symbol's useful part (s), n T_r without jitter, shape (N,)."""
        if self.starts_s is not None:
            return self.starts_s
        return np.arange(len(self.sent)) * self.network.symbol_interval_s

    @cached_property
    def sample_times_s(self) -> np.ndarray:
        """Time i / (M df) of each sample in its symbol (s), shape (M,)."""
        return np.arange(self.sent.shape[1]) * self.sample_s

    @cached_property
    def times_s(self) -> np.ndarray:
        """Absolute time of every sample (s), shape (N, M)."""
        return self.symbol_times_s[:, None] + self.sample_times_s

    @cached_property
    def baseband_hz(self) -> np.ndarray:
        """Frequency of each subcarrier from the local oscillator, (m - M // 2) df (Hz), shape (M,)."""
        return baseband_hz(self.network)

    @property
    def oscillator_hz(self) -> float:
        """Frequency of the local oscillator, f_k + (M // 2) df (Hz)."""
        return self.station.frequency_hz + self.sent.shape[1] // 2 * self.network.subcarrier_spacing_hz
