"""From a receiver's samples to signals at a radar's symbol rate, cut into coherent processing
intervals.

A real channel is one mixer output, Re y(t). Its analytic signal keeps the positive frequencies
only, so the sign of the Doppler is lost: towards and away look the same, and both sides of a
rotor's spectrum lie on top of each other.

The sampling is one of three, by name:
    anti_aliased   frequencies beyond half the symbol rate are filtered out first
    one_sided      for a real channel, whose analytic signal has no negative frequencies: the band
    from 0 to 94 % of the
                   symbol rate is kept, so speeds up to nearly twice the usual bound stay apart;
                   those above the usual bound appear as negative speeds
    bare           every symbol takes the unfiltered value at its time, so faster lines fold, as in
    a radar that
                   measures once a symbol (the published network folds every rotor this way)
All evaluate the recording between its samples by the same windowed sinc kernel, so any rate goes to
any rate. The gain of each at every tone of its band is a table (`python
benchmarks/sampling_gain.py`).
"""

import math
from functools import lru_cache

import numpy as np
from scipy.signal import firwin, hilbert, kaiserord, oaconvolve
from scipy.signal.windows import dpss

from lowalt.files.errors import InputError

SAMPLINGS = ("anti_aliased", "one_sided", "bare")
LOBES = 24
"""Zero crossings of the sinc on either side."""
BETA = 8.0
"""Kaiser window of the kernel: side lobes near -80 dB (Kaiser and Schafer 1980)."""
EDGE = 0.9
"""Pass band of the anti-aliasing filter over half the symbol rate. In the last tenth the kernel
falls off.
"""
ONE_SIDED_EDGE = 0.94
"""Pass band of one-sided sampling over the symbol rate. The filter falls off between here and the
symbol rate itself, beyond which a tone would fold onto a slow target."""
STOP_DB = 80.0
"""Attenuation of one-sided sampling from the symbol rate on."""
FALL_CELLS = 6
"""Doppler cells below the slowest speed over which the filter of what is slower falls off."""
FURTHER = 7
"""Sequences beyond the dimension of the slow band: with them the rest of its energy is below -60
dB.
"""
PHASES = 1024
"""Number of places between two samples at which the kernel is tabulated. Linear interpolation
between them is accurate to 1e-6."""
CHUNK = 4096


def analytic(values: np.ndarray) -> np.ndarray:
    """Return the analytic signal (samples,) complex128 of a real channel, its mean removed; complex
    values as they are.

    Source: Marple 1999, IEEE Trans. Signal Processing 47(9), computed by FFT.
    """
    if np.iscomplexobj(values):
        return np.asarray(values, np.complex128)
    centred = values - values.mean()
    # Pad to a power of two: the FFT of a prime length would take minutes.
    fast = 1 << (len(centred) - 1).bit_length()
    return hilbert(centred, fast)[: len(centred)]


def _kernel(distance: np.ndarray, band: float) -> np.ndarray:
    """Low-pass kernel at `distance` (input samples) that passes up to `band` (0..1) of half the
    input's rate.
    """
    from scipy.special import i0

    reach = LOBES / band
    inside = np.clip(1 - (distance / reach) ** 2, 0.0, None)
    return band * np.sinc(band * distance) * i0(BETA * np.sqrt(inside)) / i0(BETA) * (inside > 0)


@lru_cache(maxsize=8)
def _tabulated(band: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the offsets (taps,) of the input samples used, and their weights (PHASES + 1, taps) by
    place.
    """
    reach = math.ceil(LOBES / band)
    taps = np.arange(-reach + 1, reach + 1)
    table = _kernel(taps - np.arange(PHASES + 1)[:, None] / PHASES, band)
    # Each row sums to one, so that a constant stays that constant to the last bits.
    return taps, table / table.sum(axis=1, keepdims=True)


def symbol_rate(
    values: np.ndarray, rate_hz: float, symbol_interval_s: float, sampling: str
) -> np.ndarray:
    """Return the signal at one value per symbol interval, complex128, from the first sample on.

    values: (samples,) real or complex at `rate_hz`; sampling: one of SAMPLINGS.
    Raises: InputError for an unknown sampling, samples slower than one per symbol, or one-sided
    sampling of a complex channel.
    """
    if sampling not in SAMPLINGS:
        raise InputError(f"sampling is {sampling!r}, expected one of {SAMPLINGS}")
    step = rate_hz * symbol_interval_s
    if step < 1 - 1e-9:
        raise InputError(
            f"recording at {rate_hz:.6g} samples/s has less than one per symbol of"
            f" {symbol_interval_s:.4g} s, expected at least {1 / symbol_interval_s:.6g} samples/s"
        )
    signal = analytic(values)
    if sampling == "one_sided":
        if np.iscomplexobj(values):
            raise InputError(
                "sampling is 'one_sided' for a complex channel, which has negative frequencies; "
                "expected "
                "anti_aliased or bare"
            )
        signal = _below(signal, rate_hz, 1 / symbol_interval_s)
    if sampling == "bare" and math.isclose(step, round(step), rel_tol=1e-12):
        return signal[:: round(step)].copy()
    if sampling == "anti_aliased":
        return _resampled(signal, step, EDGE / step)
    if np.iscomplexobj(values):
        return _resampled(signal, step, 1.0)
    # A real channel's spectrum lies between 0 and half its rate. About a quarter of the rate it is
    # symmetric, so that the kernel, which falls off near half the rate, passes all of it.
    turned = _resampled(signal * (-1j) ** (np.arange(len(signal)) % 4), step, 1.0)
    return turned * np.exp(0.5j * np.pi * step * np.arange(len(turned)))


def _below(signal: np.ndarray, rate_hz: float, symbol_rate_hz: float) -> np.ndarray:
    """An analytic signal without what lies from the symbol rate (Hz) on; its side of negative
    frequencies is empty.

    Source: the length of a Kaiser window's filter, Kaiser 1974 (`scipy.signal.kaiserord`).
    """
    if rate_hz <= 2 * symbol_rate_hz:
        return signal
    fall = (1 - ONE_SIDED_EDGE) * symbol_rate_hz
    taps, beta = kaiserord(STOP_DB, fall / (rate_hz / 2))
    kernel = firwin(taps | 1, symbol_rate_hz - fall / 2, window=("kaiser", beta), fs=rate_hz)
    return oaconvolve(signal, kernel, mode="same")


def _resampled(signal: np.ndarray, step: float, band: float) -> np.ndarray:
    """The signal at every `step`-th sample, interpolated by the kernel that passes up to `band` of
    half its rate.
    """
    reach = math.ceil(LOBES / band)
    padded = np.concatenate([np.full(reach, signal[0]), signal, np.full(reach + 1, signal[-1])])
    count = int((len(signal) - 1) / step) + 1
    taps, table = _tabulated(band)
    result = np.empty(count, np.complex128)
    for start in range(0, count, CHUNK):
        places = np.arange(start, min(start + CHUNK, count)) * step
        first = np.floor(places).astype(np.int64)
        phase = (places - first) * PHASES
        row = np.minimum(phase.astype(np.int64), PHASES - 1)
        weights = table[row] + (phase - row)[:, None] * (table[row + 1] - table[row])
        gathered = padded[first[:, None] + taps + reach]
        result[start : start + len(places)] = np.einsum("nt,nt->n", gathered, weights)
    return result


@lru_cache(maxsize=8)
def _slow_sequences(symbols: int, slow: float) -> np.ndarray:
    """Orthonormal sequences (n, symbols) that span what is slower than `slow` (cycles per symbol)
    less `FALL_CELLS`.

    Source: Slepian 1978, Bell System Technical Journal 57(5): of length N and half-band W, some 2 N
    W sequences hold all but a share of a band's energy that falls tenfold or more with each further
    one.
    """
    product = symbols * slow - FALL_CELLS
    return (
        dpss(symbols, product, int(2 * product) + FURTHER)
        if product >= 1
        else np.empty((0, symbols))
    )


def coherent_intervals(
    signal: np.ndarray, symbols: int, name: str = "recording", slow: float = 0.0
) -> np.ndarray:
    """Return the coherent processing intervals (intervals, symbols) of a signal, each without its
    mean.

    No two share a symbol. The mean is the echo of everything that does not move, which is orders of
    magnitude above the target's. slow: frequency, cycles per symbol, above which a line keeps its
    level. More than 5 / symbols below it what is slower is gone as well, by 50 dB or more.
    Raises: InputError naming the recording where it is shorter than one interval.
    """
    if len(signal) < symbols:
        raise InputError(f"{name}: {len(signal)} symbols, shorter than one window of {symbols}")
    windows = signal[: len(signal) // symbols * symbols].reshape(-1, symbols)
    # Subtract the first symbol before the mean: a constant signal then becomes exactly zero.
    moved = windows - windows[:, :1]
    moved = moved - moved.mean(axis=1, keepdims=True)
    sequences = _slow_sequences(symbols, slow)
    return moved - (moved @ sequences.T) @ sequences if len(sequences) else moved
