"""The compiled loops of array sums of spherical waves: a box's polynomials at the directions of one symbol's points."""

import math

import numpy as np

from lowalt.common.jit import INNER_VECTOR, LEAN, ORDERED, VECTOR, kernel
from lowalt.effects.moment_loops import filled
from lowalt.effects.near_field_sizes import least_of

TOGETHER = 4
"""Terms that share a pass over the points."""
INLINED_VECTOR = kernel(
    inner=True, forceinline=True, error_model="numpy", _nrt=False, fastmath={"contract", "reassoc", "nsz"}
)
"""As INNER_VECTOR, and copied into its callers, since a pass over few points takes little longer than a call."""


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


@LEAN
def held(low, high, first, last, middle, half, least, most):
    """Fill least and most (3,) with the bounds low and high (3, N) of symbols from first to last, together.

    Returns whether they lie within half (3,) of middle (3,).
    """
    inside = True
    for k in range(3):
        a, b = low[k, first], high[k, first]
        for n in range(first + 1, last):
            a, b = min(a, low[k, n]), max(b, high[k, n])
        least[k], most[k] = a, b
        inside = inside and a >= middle[k] - half[k] and b <= middle[k] + half[k]
    return inside


@LEAN
def nodes(across, up, near, station, axes, out):
    """Fill out (A, B, C, 3) m with places at direction cosines across (A,) and up (B,), inverse ranges near (C,) (1/m).

    Returns whether all are directions. The sums depend on the direction along the array alone, so its front stands for
    its back.
    """
    sine, cosine = axes
    for k in range(len(near)):
        if not near[k] > 0.0:
            return False
    for i in range(len(across)):
        for j in range(len(up)):
            ahead = 1.0 - across[i] * across[i] - up[j] * up[j]
            if not ahead > 0.0:
                return False
            front = math.sqrt(ahead)
            x, y = front * cosine - across[i] * sine, front * sine + across[i] * cosine
            for k in range(len(near)):
                out[i, j, k, 0] = x / near[k] + station[0]
                out[i, j, k, 1] = y / near[k] + station[1]
                out[i, j, k, 2] = up[j] / near[k] + station[2]
    return True


@LEAN
def listed(found, matters, allowed, size, place, pairs, terms, names, ends):
    """Fill pairs, terms, names and ends as `evaluated` takes them; return how many pairs and orders there are.

    found: (D, A, B, C) complex terms, of which at most matters (A, B, C) are used; smaller ones that sum to at most
    `allowed` are left out. size (D, A, B, C), place (B, C) int64: work space. Those of an order fill whole passes,
    first passes of one order across each, then those left over.
    """
    orders, wide, high, deep = found.shape
    for d in range(orders):
        for a in range(wide):
            for b in range(high):
                for c in range(deep):
                    one = found[d, a, b, c]
                    own = math.sqrt(one.real * one.real + one.imag * one.imag) if matters[a, b, c] else 0.0
                    size[d, a, b, c] = own
    least = least_of(size.reshape(size.size), allowed)
    for b in range(high):
        for c in range(deep):
            # The polynomials of order zero are one, so their products stand in the table already.
            place[b, c] = wide + b if c == 0 else wide + high + c if b == 0 else -1
    used, at, last = 0, 0, 0
    ends[0] = 0
    for d in range(orders):
        first = at
        for rest in range(2):
            for a in range(wide):
                count = 0
                for b in range(high):
                    for c in range(deep):
                        count += size[d, a, b, c] >= least and size[d, a, b, c] > 0.0
                whole, number = count - count % TOGETHER, 0
                for b in range(high):
                    for c in range(deep):
                        if size[d, a, b, c] < least or size[d, a, b, c] == 0.0:
                            continue
                        number += 1
                        if (number > whole) != (rest == 1):
                            continue
                        if place[b, c] < 0:
                            place[b, c], pairs[used, 0], pairs[used, 1] = (
                                wide + high + deep + used,
                                wide + b,
                                wide + high + c,
                            )
                            used += 1
                        terms[at, 0], terms[at, 1] = found[d, a, b, c].real, found[d, a, b, c].imag
                        names[at, 0], names[at, 1] = a, place[b, c]
                        at += 1
        last = d if at > first else last
        while at % TOGETHER:
            terms[at, 0], terms[at, 1], names[at, 0], names[at, 1] = 0.0, 0.0, 0, 0
            at += 1
        ends[d + 1] = at
    return used, last + 1


@INNER_VECTOR
def chebyshev(at, middle, half, table):
    """Fill table (K, L) with the Chebyshev polynomials of (at - middle) / half, at (L,), except order zero, ones."""
    scale, size, k = 1.0 / half, np.uint64(len(at)), 2
    if len(table) == 1:
        return
    one = table[1]
    for i in range(size):
        one[i] = (at[i] - middle) * scale
    # Four orders a pass while there are so many.
    while k + 3 < len(table):
        older, old, a, b, c, d = table[k - 2], table[k - 1], table[k], table[k + 1], table[k + 2], table[k + 3]
        for i in range(size):
            x = 2.0 * one[i]
            e = x * old[i] - older[i]
            f = x * e - old[i]
            g = x * f - e
            a[i], b[i], c[i], d[i] = e, f, g, x * g - f
        k += 4
    while k < len(table):
        older, old, own = table[k - 2], table[k - 1], table[k]
        for i in range(size):
            own[i] = 2.0 * one[i] * old[i] - older[i]
        k += 1


@INLINED_VECTOR
def added(terms, names, first, table, re, im):
    """Add to re and im (L,) the TOGETHER terms (T, 2) from `first`: each times its two rows of table (R, L).

    names: (T, 2), numbers of rows, in the order of the first.
    """
    k, l, m, n = first, first + 1, first + 2, first + 3  # noqa: E741
    t, u, v, w = terms[k, 0], terms[l, 0], terms[m, 0], terms[n, 0]
    a, b, c, d = terms[k, 1], terms[l, 1], terms[m, 1], terms[n, 1]
    five, six, seven, eight = table[names[k, 1]], table[names[l, 1]], table[names[m, 1]], table[names[n, 1]]
    one = table[names[k, 0]]
    if names[k, 0] == names[l, 0] and names[k, 0] == names[m, 0] and names[k, 0] == names[n, 0]:
        for i in range(np.uint64(len(re))):
            e, f, g, h = five[i], six[i], seven[i], eight[i]
            re[i] += one[i] * ((t * e + u * f) + (v * g + w * h))
            im[i] += one[i] * ((a * e + b * f) + (c * g + d * h))
        return
    two, three, four = table[names[l, 0]], table[names[m, 0]], table[names[n, 0]]
    for i in range(np.uint64(len(re))):
        e, f, g, h = one[i] * five[i], two[i] * six[i], three[i] * seven[i], four[i] * eight[i]
        re[i] += (t * e + u * f) + (v * g + w * h)
        im[i] += (a * e + b * f) + (c * g + d * h)


@INNER_VECTOR
def joined(mix, orders, re, im):
    """Fill re and im (L,) with the sum over orders (D, 2, L) of mix (D,) times each."""
    last = np.uint64(len(mix) - 1)
    for d in range(np.uint64(0), np.uint64(len(mix)), np.uint64(2)):
        # Two orders a pass; the last one may be alone.
        e = min(d + np.uint64(1), last)
        a, b = mix[d], mix[e] if e > d else 0.0
        one, two, three, four = orders[d, 0], orders[d, 1], orders[e, 0], orders[e, 1]
        if d == 0:
            for i in range(np.uint64(len(re))):
                re[i], im[i] = a * one[i] + b * three[i], a * two[i] + b * four[i]
            continue
        for i in range(np.uint64(len(re))):
            re[i] += a * one[i] + b * three[i]
            im[i] += a * two[i] + b * four[i]


@VECTOR
def evaluated(at, start, stop, middle, half, counts, pairs, terms, names, ends, mix, spot, table, orders, out):
    """Fill out (Q, K) from start to stop with a box's polynomials at directions (3, K), of all its points.

    Chebyshev polynomials of (at - middle) / half: counts (A, B, C) of them across, up and in inverse range. pairs: (P,
    2), numbers of the rows of the table whose products the terms have too; terms, names: as in `added`, those of the
    d-th order in frequency from ends[d] to ends[d + 1]; mix: (Q, D), values of these orders at the frequencies. Work
    space for S points at a time: spot (2, S), table (A + B + C + P, S), orders (D, 2, S).
    """
    size, products = table.shape[1], counts[0] + counts[1] + counts[2]
    for k in range(np.uint64(size)):
        table[0, k], table[counts[0], k], table[counts[0] + counts[1], k] = 1.0, 1.0, 1.0
    for first in range(start, stop, size):
        width, row = min(size, stop - first), 0
        for k in range(3):
            filled(at[k, first : first + width], size, spot[0])
            chebyshev(spot[0], middle[k], half[k], table[row : row + counts[k]])
            row += counts[k]
        for k in range(len(pairs)):
            one, two, own = table[pairs[k, 0]], table[pairs[k, 1]], table[products + k]
            for i in range(np.uint64(size)):
                own[i] = one[i] * two[i]
        for d in range(len(orders)):
            re, im = orders[d, 0], orders[d, 1]
            for i in range(np.uint64(size)):
                re[i], im[i] = 0.0, 0.0
            for k in range(ends[d], ends[d + 1], TOGETHER):
                added(terms, names, k, table, re, im)
        for q in range(len(mix)):
            own, re, im = out[q, first : first + width], orders[0, 0], orders[0, 1]
            if len(mix) > 1:
                re, im = spot[0], spot[1]
                joined(mix[q], orders, re, im)
            for i in range(np.uint64(width)):
                own[i] = complex(re[i], im[i])
