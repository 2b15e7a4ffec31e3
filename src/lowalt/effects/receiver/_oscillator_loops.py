"""Compiled loops of an oscillator's phase."""

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.effects.phasors import phasor


@LEAN
def range_correlated(weight, frequency, width, delay, out):
    """Fill out (K,) with weight (K,) times the factor on the density of phi(t) - phi(t - delay).

    It is 4 sin^2(pi f delay), the mean over each node's width; frequency, width (K,) Hz, delay s. Source: M. C. Budge,
    M. P. Burt, Range correlation effects on phase and amplitude noise, IEEE Southeastcon 1993.
    """
    for k in range(np.uint64(len(out))):
        _, sine = phasor(np.pi * frequency[k] * delay)
        angle = np.pi * width[k] * delay
        _, wide = phasor(angle)
        # What the mean loses of a wave: 1 - sin(x) / x, for small x by its series, which keeps its digits.
        z = angle * angle
        small = z * (1.0 - z * (1.0 - z * (1.0 - z / 72.0) / 42.0) / 20.0) / 6.0
        lost = small if z < 0.01 else 1.0 - wide / angle
        out[k] = weight[k] * (4.0 * sine * sine * (1.0 - lost) + 2.0 * lost)


@LEAN
def weighed_lines(drawn, amplitude, many, few, out):
    """Fill out (R, 2, S) with real and imaginary parts of lines k = 1 .. J, of row k // S; other entries become zero.

    Line k is the number drawn[:, k - 1], (2, J) real and imaginary parts, times amplitude[k - 1] times twice the size
    of the imaginary part of many[k // S] times few[k % S], (R,) and (S,) complex128.
    """
    count, turns = len(amplitude), len(few)
    for row in range(len(many)):
        first = max(row * turns, 1)
        size = max(min((row + 1) * turns, count + 1) - first, 0)
        real, imaginary, skipped = out[row, 0], out[row, 1], first - row * turns
        for j in range(skipped):
            real[j], imaginary[j] = 0.0, 0.0
        for j in range(skipped + size, turns):
            real[j], imaginary[j] = 0.0, 0.0
        if size == 0:
            continue
        real, imaginary, between = real[skipped:], imaginary[skipped:], few[skipped:]
        x, y, weight = drawn[0, first - 1 :], drawn[1, first - 1 :], amplitude[first - 1 :]
        c, s = many[row].real, many[row].imag
        for j in range(np.uint64(size)):
            share = weight[j] * 2.0 * abs(s * between[j].real + c * between[j].imag)
            real[j], imaginary[j] = x[j] * share, y[j] * share


@LEAN
def halved_lines(folded, between, out):
    """Fill out (Q, N + 1) with half the lines of real sequences, those of the even part first, then of the odd part.

    folded (Q, 2, 2 N), overwritten: sums of lines times cosines, then times sines, real and imaginary parts; between
    (2, P, 2 N): cosines and sines that carry both on, as in `_oscillator._waves`.
    """
    even, turns = between.shape[1], between.shape[2]
    middle = 2 * even - len(folded)
    for q in range(even):
        cosine, sine, re, im = between[0, q], between[1, q], folded[q, 0], folded[q, 1]
        if q >= middle:
            other_re, other_im = folded[even + q - middle, 0], folded[even + q - middle, 1]
            for k in range(np.uint64(turns)):
                c, s, a, b, x, y = cosine[k], sine[k], re[k], im[k], other_re[k], other_im[k]
                re[k], im[k] = a * c - x * s, b * c - y * s
                other_re[k], other_im[k] = x * c + a * s, y * c + b * s
            half = out[even + q - middle]
            half[0] = complex(-other_im[0], 0.0)
            for k in range(1, len(half)):
                x, y = other_re[k] - other_re[turns - k], other_im[k] + other_im[turns - k]
                half[k] = complex(-0.5 * y, 0.5 * x)
        half = out[q]
        half[0] = complex(re[0], 0.0)
        for k in range(1, len(half)):
            half[k] = complex(0.5 * (re[k] + re[turns - k]), 0.5 * (im[k] - im[turns - k]))
