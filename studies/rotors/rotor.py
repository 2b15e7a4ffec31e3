"""The blade passing frequency of a rotor, read from slow-time signals: blades times rotation rate.

Two steps. The body is separated: demodulated by its own phase it is the smooth part of the signal, and the rotors are
the rest (`without_body`); null space pursuit does the same with an operator that it adapts (`without_pursued_body`).
The rest is a comb: N equal blades that turn at F give lines at multiples of N F from the body. The symbols sample the
comb, so it is known only up to folding: N F and any multiple of the symbol rate plus or minus N F give the same lines.
Length and number of blades are read from the same comb (`rotor_blades.py`).
Source: Chen, The Micro-Doppler Effect in Radar, 2nd ed. 2019, ch. 3 (the comb). The paper cites J. Wei et al.,
arXiv:2408.16415, whose rotor micro-Doppler null space pursuit separates rotors from a body that vibrates; of it and of
its kin (Zhao and Su, IEEE Trans. Geosci. Remote Sens. 61, 2023) only the abstracts were at hand, so how near this
comes to them is unknown.
"""

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from null_space_pursuit import pursue, second_difference_bands
from scipy.linalg import solveh_banded

POINTS_A_SYMBOL = 20
"""Points of the zero-padded transform of the rest for each symbol, raised to a power of two."""
SMOOTH_SYMBOLS = 40
"""A look of this many symbols has smoothing weight 1; the weight grows so that a wave of 6.4 cycles per look halves."""
WEIGHTS = np.arange(1.0, 6.0) ** -0.5 / (np.arange(1.0, 6.0) ** -0.5).sum()
"""Weights of the comb's first lines; chosen on the first 14 motion models of the seen subtypes."""
LEAST_CYCLES, STEP_CYCLES = 8.0, 0.05
"""Smallest passing frequency of the search, in cycles per look, and its steps; below lies the body."""


def body_line_hz(signal: np.ndarray, interval_s: float) -> float:
    """Return the Doppler frequency (Hz) of the strongest line of a signal (N,), folded, by a parabola through its peak.

    The window is Hann's, so a strong body line does not cover weak lines of moving parts by its side lobes.
    """
    points = 1024
    power = np.abs(np.fft.fft(signal * np.hanning(len(signal) + 2)[1:-1], points)) ** 2
    place = int(power.argmax())
    left, middle, right = np.log(power[[place - 1, place, (place + 1) % points]] / (power.sum() or 1) + 1e-300)
    bend = left - 2 * middle + right
    shift = np.clip(0.5 * (left - right) / bend, -0.5, 0.5) if bend < 0 else 0.0
    found = (place + shift) / (points * interval_s)
    return (found + 0.5 / interval_s) % (1 / interval_s) - 0.5 / interval_s


class Passing(NamedTuple):
    """Folded blade passing frequency (Hz), between 0 and half the symbol rate, and the comb's level over the noise."""

    hertz: float
    level: float


@functools.cache
def _smoother(symbols: int, smooth: float) -> np.ndarray:
    """Bands (3, symbols) of 1 + smooth D2' D2, D2 being second differences."""
    bands = smooth * second_difference_bands(symbols)
    bands[0] += 1
    return bands


def without_body(signal: np.ndarray, interval_s: float, rounds: int = 3) -> np.ndarray:
    """Return the rest (N,) of a signal (N,) complex, demodulated by the body's phase, so the body would be at 0 Hz.

    The body's phase starts at its strongest line and follows the smooth part's own phase for `rounds` rounds. The
    smooth part r of the demodulated signal y minimises |y - r|^2 + w |D2 r|^2, where w = (N / SMOOTH_SYMBOLS)^4.
    """
    bands = _smoother(len(signal), (len(signal) / SMOOTH_SYMBOLS) ** 4)
    times = np.arange(len(signal)) * interval_s
    phase = 2 * np.pi * body_line_hz(signal, interval_s) * times

    def body_of(turned: np.ndarray) -> np.ndarray:
        """Return the smooth part of a demodulated signal."""
        return solveh_banded(bands, turned.real, lower=True) + 1j * solveh_banded(bands, turned.imag, lower=True)

    for _ in range(rounds):
        body = body_of(signal * np.exp(-1j * phase))
        # A parabola of phase is an acceleration of the body; a finer course would take in the rotors.
        weights = np.maximum(np.abs(body), 1e-9 * np.abs(signal).max() + 1e-300)
        course = np.polynomial.Polynomial.fit(times, np.unwrap(np.angle(body)), 2, w=weights)
        phase = phase + course(times)
    turned = signal * np.exp(-1j * phase)
    return turned - body_of(turned)


def without_pursued_body(signal: np.ndarray, interval_s: float) -> np.ndarray:
    """Return the rest as `without_body` does, the body found by null space pursuit; shapes as there."""
    start_hz = float(body_line_hz(signal, interval_s))
    found = pursue(signal, start_hz, interval_s)
    phase = np.concatenate([[0.0], np.cumsum(np.angle(found.course))])
    return found.rest * np.exp(-1j * phase)


def folded(hertz: float | np.ndarray, interval_s: float) -> float | np.ndarray:
    """Return the distance (Hz) of a frequency to the nearest multiple of the symbol rate: all that symbols tell."""
    rate = 1 / interval_s
    return np.abs((hertz + rate / 2) % rate - rate / 2)


def passing(signals: np.ndarray, interval_s: float, separate: Callable = without_body) -> Passing:
    """Return the folded blade passing frequency of signals (B, N) complex of one target, such as one per station.

    interval_s: T_r; separate: `without_body` or `without_pursued_body`. All rotors turn at one rate. The logarithms of
    the signals' spectra are averaged.
    """
    return passing_of_rests(np.array([separate(signal, interval_s) for signal in signals]), interval_s)


def passing_of_rests(rests: np.ndarray, interval_s: float) -> Passing:
    """Return the folded blade passing frequency of rests (B, N) complex, from which the body at 0 Hz is taken away."""
    symbols = rests.shape[-1]
    points = 1 << (POINTS_A_SYMBOL * symbols - 1).bit_length()
    window = np.hanning(symbols + 2)[1:-1]
    power = np.abs(np.fft.fft(rests * window, points, axis=-1)) ** 2
    power /= np.maximum(np.median(power, axis=-1, keepdims=True), 1e-300)
    levels = np.exp(np.log(np.maximum(power, 1e-12)).mean(0))
    look_s = symbols * interval_s
    rates = np.arange(LEAST_CYCLES / look_s, 0.5 / interval_s, STEP_CYCLES / look_s)
    place = np.rint(rates[:, None] * np.arange(1, len(WEIGHTS) + 1) * interval_s * points).astype(int)
    # A line has two sides, above and below the body.
    lines = 0.5 * (levels[place % points] + levels[-place % points])
    score = np.log1p(lines) @ WEIGHTS
    best = int(score.argmax())
    return Passing(float(rates[best]), float(np.expm1(score[best])))
