"""The compiled loops of array sums of spherical waves: a box's polynomials at the directions of one symbol's points."""

import numpy as np

from lowalt.common.jit import INNER_VECTOR, VECTOR
from lowalt.effects.moment_loops import BLOCK


@VECTOR
def directions(places, station, axes, out):
    """Fill out (3, N, L) with direction cosines across and up, and inverse ranges (1/m), of places (N, 3, L)."""
    sine, cosine = axes
    s0, s1, s2 = station[0], station[1], station[2]
    for n in range(places.shape[0]):
        at, across, up, near = places[n], out[0, n], out[1, n], out[2, n]
        for i in range(np.uint64(places.shape[2])):
            x, y, z = at[0, i] - s0, at[1, i] - s1, at[2, i] - s2
            inverse = 1.0 / np.sqrt(x * x + y * y + z * z)
            across[i], up[i], near[i] = (cosine * y - sine * x) * inverse, z * inverse, inverse


@INNER_VECTOR
def chebyshev(at, middle, half, table):
    """Fill table (K, L) with the Chebyshev polynomials of (at - middle) / half, at (L,)."""
    scale = 1.0 / half
    for i in range(np.uint64(len(at))):
        table[0, i] = 1.0
    for k in range(1, len(table)):
        for i in range(np.uint64(len(at))):
            x = (at[i] - middle) * scale
            table[k, i] = 2.0 * x * table[k - 1, i] - table[k - 2, i] if k > 1 else x


@INNER_VECTOR
def added(real, imag, first, across, weight, total):
    """Add to total weight (L,) times the sums of real and imag (A,) from `first`, BLOCK each, times rows of `across`.

    across: (A, L); total: (2, L), real and imaginary.
    """
    t, u, v, w = real[first], real[first + 1], real[first + 2], real[first + 3]
    a, b, c, d = imag[first], imag[first + 1], imag[first + 2], imag[first + 3]
    one, two, three, four = across[first], across[first + 1], across[first + 2], across[first + 3]
    re, im = total[0], total[1]
    for i in range(np.uint64(len(weight))):
        e, f, g, h, own = one[i], two[i], three[i], four[i], weight[i]
        re[i] += own * ((t * e + u * f) + (v * g + w * h))
        im[i] += own * ((a * e + b * f) + (c * g + d * h))


@VECTOR
def evaluated(at, middle, half, terms, lengths, across, up, near, weight, total, out):
    """Fill out (Q, N, L) with the polynomials `terms` (2, Q, B, C, A), real and imaginary, of directions at (3, N, L).

    Chebyshev polynomials of (at - middle) / half: A across, B up, C inverse range; of each (B, C) the first
    lengths[b, c] count, which are multiples of BLOCK. across (A, L), up (B, L), near (C, L), weight (L,) and total
    (Q, 2, L): work space.
    """
    count = np.uint64(at.shape[2])
    for n in range(at.shape[1]):
        chebyshev(at[0, n], middle[0], half[0], across)
        chebyshev(at[1, n], middle[1], half[1], up)
        chebyshev(at[2, n], middle[2], half[2], near)
        for q in range(terms.shape[1]):
            for i in range(count):
                total[q, 0, i], total[q, 1, i] = 0.0, 0.0
        for b in range(terms.shape[2]):
            for c in range(terms.shape[3]):
                for i in range(count):
                    weight[i] = up[b, i] * near[c, i]
                for q in range(terms.shape[1]):
                    for a in range(0, lengths[b, c], BLOCK):
                        added(terms[0, q, b, c], terms[1, q, b, c], a, across, weight, total[q])
        for q in range(terms.shape[1]):
            for i in range(count):
                out[q, n, i] = complex(total[q, 0, i], total[q, 1, i])
