"""The blade passing frequency of a rotor, read from slow-time signals: blades times rotation rate.

Two steps. Null space pursuit separates the body: second differences annihilate the signal demodulated by the body's
phase, so the body is the smooth part and the rotors are the rest. The rest is a comb: N equal blades that turn at F
give lines at multiples of N F from the body. The symbols sample the comb, so it is known only up to folding: N F and
any multiple of the symbol rate plus or minus N F give the same lines. The lines at multiples of F, which unequal blades
have, are too weak to tell N from F in the default's signals: in a trial, the number of blades came out no better than
by chance.
Source: Peng and Hwang, Null Space Pursuit, IEEE Trans. Signal Process. 58, 2010 (the separation); Chen, The
Micro-Doppler Effect in Radar, 2nd ed. 2019, ch. 3 (the comb). The rotor estimator that the paper cites could not be
obtained, so how near this one is to it is unknown.
"""

import functools
from typing import NamedTuple

import numpy as np
from scipy.linalg import solveh_banded

from lowalt.recognition.features import body_line_hz

POINTS = 8192
"""Points of the zero-padded transform of the rest."""
WEIGHTS = np.arange(1.0, 6.0) ** -0.5 / (np.arange(1.0, 6.0) ** -0.5).sum()
"""Weights of the comb's first lines; chosen on the first 14 motion models of the seen subtypes."""
LEAST_HZ, STEP_HZ = 8.0, 0.05
"""Smallest passing frequency that is looked for, below which the body's own line lies, and the steps of the search."""


class Passing(NamedTuple):
    """Folded blade passing frequency (Hz), between 0 and half the symbol rate, and the comb's level over the noise."""

    hertz: float
    level: float


@functools.cache
def _smoother(symbols: int, smooth: float) -> np.ndarray:
    """Bands (3, symbols) of 1 + smooth D2' D2, D2 being second differences."""
    difference = np.diff(np.eye(symbols), 2, axis=0)
    normal = np.eye(symbols) + smooth * difference.T @ difference
    return np.array([np.pad(np.diagonal(normal, -step), (0, step)) for step in range(3)])


def without_body(signal: np.ndarray, interval_s: float, rounds: int = 3, smooth: float = 1e4) -> np.ndarray:
    """Return the rest (N,) of a signal (N,) complex, demodulated by the body's phase, so the body would be at 0 Hz.

    The body's phase starts at its strongest line and follows the smooth part's own phase for `rounds` rounds. The
    smooth part r of the demodulated signal y minimises |y - r|^2 + smooth |D2 r|^2.
    """
    bands = _smoother(len(signal), smooth)
    times = np.arange(len(signal)) * interval_s
    phase = 2 * np.pi * body_line_hz(signal[None], interval_s)[0] * times

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


def folded(hertz: float | np.ndarray, interval_s: float) -> float | np.ndarray:
    """Return the distance (Hz) of a frequency to the nearest multiple of the symbol rate: all that symbols tell."""
    rate = 1 / interval_s
    return np.abs((hertz + rate / 2) % rate - rate / 2)


def passing(signals: np.ndarray, interval_s: float) -> Passing:
    """Return the folded blade passing frequency of signals (B, N) complex of one target, such as one a station.

    interval_s: T_r. All rotors turn at one rate. The logarithms of the signals' spectra are averaged.
    """
    window = np.hanning(signals.shape[-1] + 2)[1:-1]
    rests = np.array([without_body(signal, interval_s) for signal in signals])
    power = np.abs(np.fft.fft(rests * window, POINTS, axis=-1)) ** 2
    power /= np.maximum(np.median(power, axis=-1, keepdims=True), 1e-300)
    levels = np.exp(np.log(np.maximum(power, 1e-12)).mean(0))
    rates = np.arange(LEAST_HZ, 0.5 / interval_s, STEP_HZ)
    place = np.rint(rates[:, None] * np.arange(1, len(WEIGHTS) + 1) * interval_s * POINTS).astype(int)
    # A line has two sides, above and below the body.
    lines = 0.5 * (levels[place % POINTS] + levels[-place % POINTS])
    score = np.log1p(lines) @ WEIGHTS
    best = int(score.argmax())
    return Passing(float(rates[best]), float(np.expm1(score[best])))
