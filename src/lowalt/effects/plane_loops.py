"""The compiled sums of an array's elements under plane waves, in short vectorised passes over one symbol's points."""

import numpy as np

from lowalt.common.jit import INNER_VECTOR
from lowalt.echo.fast.vector_loops import horner
from lowalt.echo.pointwise.terms import dirichlet
from lowalt.effects.waves import COSINE, DEGREE, SINE, WAVE

NARROW = 1.0 / 16
"""Largest half of x in `cosines` at which polynomials of degree FEW are exact to rounding, and x' is x."""
FEW = 7
FEWEST = 3
"""Degree of the polynomials of the steps between frequencies of a band below 1 % of the carrier."""


@INNER_VECTOR
def cosines(x, square, sign, c, size):
    """Fill c with cos(pi x'), x' being x less the nearest whole number, and sign with 1 or -1 as it is even or odd."""
    wide = 0
    for i in range(np.uint64(size)):
        half = 0.5 * x[i]
        square[i], sign[i] = half * half, 1.0
        # A count, unlike a branch or a largest value, leaves this loop to vector instructions.
        wide += 1 if half * half > NARROW * NARROW else 0
    if wide == 0:
        horner(square, WAVE, COSINE, FEW, c, size)
        return
    for i in range(np.uint64(size)):
        k = np.rint(x[i])
        sign[i] = 1.0 - 2.0 * (k - 2.0 * np.floor(0.5 * k))
        half = 0.5 * (x[i] - k)
        square[i] = half * half
    horner(square, WAVE, COSINE, DEGREE, c, size)


@INNER_VECTOR
def doublings(count, c, out, size):
    """Multiply signs in out by the array sum of `count` elements, a power of two; c: cos(pi x'), overwritten."""
    if count == 1:
        for i in range(np.uint64(size)):
            out[i] = 1.0
        return
    if count == 2:
        for i in range(np.uint64(size)):
            out[i] *= 2.0 * c[i]
        return
    if count == 4:
        for i in range(np.uint64(size)):
            out[i] = out[i] * (2.0 * c[i]) * (4.0 * c[i] * c[i] - 2.0)
        return
    for i in range(np.uint64(size)):
        one = 2.0 * c[i] * c[i] - 1.0
        two = 2.0 * one * one - 1.0
        out[i] = out[i] * (2.0 * c[i]) * (4.0 * one * two)
        c[i] = two
    doubled = 8
    while 2 * doubled < count:
        for i in range(np.uint64(size)):
            one = 2.0 * c[i] * c[i] - 1.0
            two = 2.0 * one * one - 1.0
            c[i] = two
            out[i] *= 4.0 * one * two
        doubled *= 4
    if doubled < count:
        for i in range(np.uint64(size)):
            out[i] *= 4.0 * c[i] * c[i] - 2.0


@INNER_VECTOR
def array_sum(x, count, square, c, out, size):
    """out = sin(pi count x) / sin(pi x) with its limits; powers of two are products of cosines of doubled angles."""
    if count & (count - 1):
        for i in range(np.uint64(size)):
            out[i] = dirichlet(x[i], count)
        return
    cosines(x, square, out, c, size)
    doublings(count, c, out, size)


@INNER_VECTOR
def turned(c, s, seen, step, rows, plus, minus, first, last):
    """Fill plus and minus (L,) with the cosines of angles, c and s their cosines and sines, and step seen more or less.

    Angles in half turns. rows: `waves_within` half of the largest step; first, last: (L,) work space.
    """
    half, size, degree = 0.5 * step, len(c), rows.shape[1] - 1
    if degree == FEWEST:
        a, b, d, e = rows[COSINE, 3], rows[COSINE, 2], rows[COSINE, 1], rows[COSINE, 0]
        f, g, h, j = rows[SINE, 3], rows[SINE, 2], rows[SINE, 1], rows[SINE, 0]
        for i in range(np.uint64(size)):
            turn = half * seen[i]
            x = turn * turn
            one, two = c[i] * (((a * x + b) * x + d) * x + e), s[i] * ((((f * x + g) * x + h) * x + j) * turn)
            plus[i], minus[i] = one - two, one + two
        return
    for i in range(np.uint64(size)):
        turn = half * seen[i]
        plus[i] = turn * turn
    horner(plus, rows, COSINE, degree, first, size)
    horner(plus, rows, SINE, degree, last, size)
    for i in range(np.uint64(size)):
        one, two = c[i] * first[i], s[i] * (last[i] * (half * seen[i]))
        plus[i], minus[i] = one - two, one + two


@INNER_VECTOR
def turned_sums(x, seen, steps, rows, count, square, c, work, out):
    """Fill out (Q, L) with the array sums of `count` elements, a power of two, at x + steps[q] seen; x, seen (L,).

    Q is two at least, and the last step is the first with the other sign, and so on, so that both share what follows
    from the step. rows: `waves_within` half of the largest step; work: (3, L) work space.
    """
    size, pairs = len(x), len(steps) // 2
    sign, s, turn = work[0], work[1], work[2]
    cosines(x, square, sign, c, size)
    horner(square, WAVE, SINE, DEGREE, s, size)
    for i in range(np.uint64(size)):
        s[i] *= 0.5 * (x[i] - np.rint(x[i]))
    for q in range(pairs):
        one, two = out[q], out[len(steps) - 1 - q]
        turned(c, s, seen, steps[q], rows, turn, square, one, two)
        for i in range(np.uint64(size)):
            one[i], two[i] = sign[i], sign[i]
        doublings(count, turn, one, size)
        doublings(count, square, two, size)
    if 2 * pairs < len(steps):
        # In the middle of the band the step is zero.
        for i in range(np.uint64(size)):
            out[pairs, i] = sign[i]
        doublings(count, c, out[pairs], size)


@INNER_VECTOR
def plane_sums(seen, weight, middle, steps, steered, count, rows, work, cosine, turn, out):
    """Fill out (Q, L) with the sums of `count` elements under plane waves, at direction cosines seen weight, (L,) each.

    middle, steps: half the frequencies over the carrier are middle + steps (Q,); steered: half of the beam's, times its
    direction cosine; rows: `waves_within` half of the largest step; the others are work space, work (5, L).
    """
    square, c = work[3], work[4]
    for i in range(np.uint64(len(seen))):
        cosine[i] = seen[i] * weight[i]
        turn[i] = middle * cosine[i] - steered
    if len(steps) > 1 and not count & (count - 1):
        turned_sums(turn, cosine, steps, rows, count, square, c, work, out)
        return
    for q in range(len(steps)):
        for i in range(np.uint64(len(seen) if len(steps) > 1 else 0)):
            turn[i] = (middle + steps[q]) * cosine[i] - steered
        array_sum(turn, count, square, c, out[q], len(seen))
