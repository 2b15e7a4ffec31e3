"""The compiled loops of array sums of spherical waves: a box's polynomials at the directions of one symbol's points."""

import numpy as np

from lowalt.common.jit import INNER_VECTOR, ORDERED, VECTOR
from lowalt.effects.moment_loops import BLOCK


@ORDERED
def directions(places, station, axes, low, high, out):
    """Fill out (3, N, L) with direction cosines across and up, and inverse ranges (1/m), of places (N, 3, L).

    low, high: (3, N), filled with the least and the largest of each symbol.
    """
    sine, cosine = axes
    s0, s1, s2 = station[0], station[1], station[2]
    for n in range(places.shape[0]):
        at, across, up, near = places[n], out[0, n], out[1, n], out[2, n]
        for i in range(np.uint64(places.shape[2])):
            x, y, z = at[0, i] - s0, at[1, i] - s1, at[2, i] - s2
            inverse = 1.0 / np.sqrt(x * x + y * y + z * z)
            across[i], up[i], near[i] = (cosine * y - sine * x) * inverse, z * inverse, inverse
        for k in range(3):
            row = out[k, n]
            least, most = row[0], row[0]
            for i in range(np.uint64(len(row))):
                least, most = min(least, row[i]), max(most, row[i])
            low[k, n], high[k, n] = least, most


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


@INNER_VECTOR
def added_twice(real, imag, first, across, weight, total):
    """As `added`, of two times BLOCK: the totals then pass through the processor half as often."""
    t, u, v, w, a, b, c, d = first, first + 1, first + 2, first + 3, first + 4, first + 5, first + 6, first + 7
    s0, s1, s2, s3, s4, s5, s6, s7 = real[t], real[u], real[v], real[w], real[a], real[b], real[c], real[d]
    r0, r1, r2, r3, r4, r5, r6, r7 = imag[t], imag[u], imag[v], imag[w], imag[a], imag[b], imag[c], imag[d]
    x0, x1, x2, x3 = across[t], across[u], across[v], across[w]
    x4, x5, x6, x7 = across[a], across[b], across[c], across[d]
    re, im = total[0], total[1]
    for i in range(np.uint64(len(weight))):
        e, f, g, h, j, k, m, n, own = x0[i], x1[i], x2[i], x3[i], x4[i], x5[i], x6[i], x7[i], weight[i]
        re[i] += own * (((s0 * e + s1 * f) + (s2 * g + s3 * h)) + ((s4 * j + s5 * k) + (s6 * m + s7 * n)))
        im[i] += own * (((r0 * e + r1 * f) + (r2 * g + r3 * h)) + ((r4 * j + r5 * k) + (r6 * m + r7 * n)))


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
                    real, imag, own = terms[0, q, b, c], terms[1, q, b, c], total[q]
                    for a in range(0, lengths[b, c] - BLOCK, 2 * BLOCK):
                        added_twice(real, imag, a, across, weight, own)
                    if lengths[b, c] % (2 * BLOCK):
                        added(real, imag, lengths[b, c] - BLOCK, across, weight, own)
        for q in range(terms.shape[1]):
            for i in range(count):
                out[q, n, i] = complex(total[q, 0, i], total[q, 1, i])
