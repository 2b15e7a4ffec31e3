"""The waveform of a look: the data sent, the samples received, and the receiver's view of both.

Samples of OFDM are the complex baseband around the station's local oscillator, which stands at
subcarrier M // 2 as in NR (3GPP TS 38.211, 5.3.1 and 5.4): subcarrier m lies at (m - M // 2) df.
Only the useful part of each symbol is kept. Other radars send no data (None): they mix the echo
with what they send, and subcarrier m of Eq. 24 is sample m.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import fft

from lowalt.config.network import Network, Station

QPSK = np.sqrt(0.5) * np.array([1 + 1j, -1 + 1j, -1 - 1j, 1 - 1j])
"""The four data symbols, of unit modulus."""
NORMAL_PREFIX = 144 / 2048
"""Length of NR's normal cyclic prefix, in useful symbol lengths (3GPP TS 38.211, 5.3.1)."""


def qpsk(rng: np.random.Generator, symbols: int, subcarriers: int) -> np.ndarray:
    """Return random QPSK data (symbols, subcarriers) complex128 of unit modulus.

    All four values are equally likely.

    Source: paper, Eq. 5, whose data symbols have unit power; 3GPP TS 38.211, 5.1.3 (QPSK).
    """
    count = symbols * subcarriers
    # The upper two bits of each byte choose a symbol; the lowest byte of a word comes first.
    words = rng.bit_generator.random_raw(-(-count // 8)).astype("<u8", copy=False)
    return QPSK[words.view(np.uint8)[:count] >> 6].reshape(symbols, subcarriers)


def transmit(response: np.ndarray, data: np.ndarray | None) -> np.ndarray:
    """Return the received time samples (N, M) of frequency responses (N, M).

    data: (N, M), which they carried.

    Sample i is (1/M) sum_m response[m] data[m] exp(j 2 pi (m - M // 2) i / M), so its 2-norm is 1 /
    sqrt(M) of the response's; without data it is response[i] / sqrt(M). Source: 3GPP TS 38.211,
    5.3.1.
    """
    if data is None:
        return response / np.sqrt(response.shape[-1])
    return fft.ifft(fft.ifftshift(response * data, axes=-1), axis=-1, overwrite_x=True)


def demodulate(samples: np.ndarray, data: np.ndarray | None) -> np.ndarray:
    """Return the responses (N, M) of time samples (N, M).

    data: (N, M), which they carried. This is the inverse of `transmit`.

    The division is by the sent symbol s; the paper's Eq. 24 would need its conjugate. The response
    alone remains.
    """
    if data is None:
        return samples * np.sqrt(samples.shape[-1])
    return fft.fftshift(fft.fft(samples, axis=-1), axes=-1) / data


def range_cells(response: np.ndarray) -> np.ndarray:
    """Return the range cells (N, M) of frequency responses (N, M).

    They are the inverse transform over subcarriers.
    """
    return fft.ifft(response, axis=-1)


def normal_prefix_s(network: Network) -> float:
    """Return the length (s) of NR's normal cyclic prefix."""
    return NORMAL_PREFIX / network.subcarrier_spacing_hz


def baseband_hz(network: Network) -> np.ndarray:
    """Return each subcarrier's frequency from the local oscillator, (m - M // 2) df (Hz).

    The shape is (M,).
    """
    number = np.arange(network.subcarriers) - network.subcarriers // 2
    return number * network.subcarrier_spacing_hz


def oscillator_hz(network: Network, station: Station) -> float:
    """Return the frequency of a station's local oscillator, f_k + (M // 2) df (Hz)."""
    return station.frequency_hz + network.subcarriers // 2 * network.subcarrier_spacing_hz


def windowed(
    network: Network,
    prefix_s: float,
    response: np.ndarray,
    late: int,
    on_air: Callable[[str], np.ndarray | None],
) -> np.ndarray:
    """Return the time samples (N, M) of a response (N, M) with samples of another symbol.

    Its first `late` samples are still the previous symbol's.

    late: negative where the last samples are the next symbol's already; on_air: subcarriers (N, M)
    on the air in the "waveform", the "previous waveform" and the "next waveform". The previous
    symbol ends a prefix before the window.
    """
    samples = transmit(response, on_air("waveform"))
    turn = np.exp(2j * np.pi * baseband_hz(network) * prefix_s)
    if late > 0:
        samples[:, :late] = transmit(response * turn, on_air("previous waveform"))[:, :late]
    if late < 0:
        samples[:, late:] = transmit(response * turn.conj(), on_air("next waveform"))[:, late:]
    return samples


@dataclass(frozen=True)
class Look:
    """One look (coherent processing interval) as the receiver of one station knows it."""

    network: Network
    station: Station
    data: np.ndarray | None
    """(N, M) complex128, the data, of mean power one; None where the waveform has none."""
    aired: np.ndarray | None
    """(N, M) subcarriers on the air: the data, as an amplifier distorts them."""
    times_s: np.ndarray
    """(N,) s, start of each symbol's useful part."""
    reference: float
    """The target echo's mean |Y_bin|^2 (W), to which set SNRs refer."""
    delay_s: float
    """Delay there and back of the place at which the receiver's beam was pointed first (s)."""

    @property
    def sample_s(self) -> float:
        """Time between two samples, of OFDM 1 / (M df) (s)."""
        return 1 / (self.network.subcarriers * self.network.symbol_rate_hz)

    @property
    def cell_s(self) -> float:
        """Delay of a range cell, 1 / (M df) (s)."""
        return 1 / (self.network.subcarriers * self.network.subcarrier_spacing_hz)

    @cached_property
    def within_s(self) -> np.ndarray:
        """Time of each sample from its symbol's beginning (s), shape (M,)."""
        return np.arange(self.network.subcarriers) * self.sample_s

    @cached_property
    def sample_times_s(self) -> np.ndarray:
        """Absolute time of every sample (s), shape (N, M)."""
        return self.times_s[:, None] + self.within_s

    @cached_property
    def baseband_hz(self) -> np.ndarray:
        """Frequency of each subcarrier from the local oscillator (Hz), shape (M,)."""
        return baseband_hz(self.network)

    @property
    def oscillator_hz(self) -> float:
        """Frequency of the local oscillator (Hz)."""
        return oscillator_hz(self.network, self.station)
