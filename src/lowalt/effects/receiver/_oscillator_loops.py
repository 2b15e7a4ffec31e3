"""Compiled loops of an oscillator's phase."""

import numpy as np

from lowalt.common.jit import LEAN


@LEAN
def weighed_lines(drawn, amplitude, many, few, out):
    """Fill out (K,) with the lines k = 1 .. J of a phase less its delayed copy; other entries become zero.

    Line k is the number drawn[k - 1], (J, 2) real and imaginary parts, times amplitude[k - 1] times
    2 abs(sin(k step)). many (2, R), few (2, S): sine and cosine of R multiples of S step and of the first S multiples
    of step; R S is more than J.
    """
    count, side = len(amplitude), few.shape[1]
    out[0] = 0.0
    for k in range(count + 1, len(out)):
        out[k] = 0.0
    for row in range(many.shape[1]):
        first = max(row * side, 1)
        size = min((row + 1) * side, count + 1) - first
        if size <= 0:
            continue
        skipped = first - row * side
        s, c, sines, cosines = many[0, row], many[1, row], few[0, skipped:], few[1, skipped:]
        given, weight, lines = drawn[first - 1 :], amplitude[first - 1 :], out[first:]
        for j in range(np.uint64(size)):
            share = weight[j] * 2.0 * abs(s * cosines[j] + c * sines[j])
            lines[j] = complex(given[j, 0] * share, given[j, 1] * share)
