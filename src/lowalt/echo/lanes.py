"""The fast kernel: short loops over a tile of symbols and points that the compiler turns into vector instructions.

A tile's arrays stay in the first-level cache. Every smooth factor is a polynomial whose degree the plan has chosen
by its bound, so that the same loops serve the exact mode and every tolerance, in float64 or float32.
Sums may be reordered and products fused; nothing here depends on the order of roundings. Places in arrays are
unsigned: a signed one may be negative, and Python's wrap-around of those would keep the loops from being vectors;
views of arrays would do as well, but cost a counted reference each.
"""

import numpy as np

from lowalt.echo.compile import LEAN, VECTOR

TILE = 256
"""Points worked on at a time: some fifteen arrays of 2 kB stay in the nearest cache."""
KEPT = 512
"""Largest target whose waves are all kept until its strongest cell is certain."""
ROW = KEPT + 24
"""Room of a work array, of odd length: rows a whole 4096 bytes apart would make loads wait for unrelated stores."""
LANES = 16
"""Tiles hold whole multiples of this many points; the padding has no amplitude."""


@LEAN
def chunk_of(points: int) -> int:
    """Points of a tile when a target has `points` (padded): equal shares of at most TILE, whole multiples of LANES."""
    shares = -(-points // TILE)
    return -(-points // (shares * LANES)) * LANES


@VECTOR
def horner(x, c, degree, out, size):
    """out[:size] = sum of c[k] x^k for k up to `degree`, four orders a pass over the tile."""
    k = degree
    top = c[degree]
    first = degree & 3
    if first == 0:
        for i in range(size):
            out[i] = top
    elif first == 1:
        c0 = c[degree - 1]
        for i in range(size):
            out[i] = top * x[i] + c0
    elif first == 2:
        c0, c1 = c[degree - 1], c[degree - 2]
        for i in range(size):
            t = x[i]
            out[i] = (top * t + c0) * t + c1
    else:
        c0, c1, c2 = c[degree - 1], c[degree - 2], c[degree - 3]
        for i in range(size):
            t = x[i]
            out[i] = ((top * t + c0) * t + c1) * t + c2
    k = degree - first
    while k > 0:
        c0, c1, c2, c3 = c[k - 1], c[k - 2], c[k - 3], c[k - 4]
        for i in range(size):
            t = x[i]
            out[i] = (((out[i] * t + c0) * t + c1) * t + c2) * t + c3
        k -= 4


@VECTOR
def place_part(px, py, pz, low, size, m, ex, ey, ez, at):
    """Fill offsets ex, ey, ez from `at` with `size` points of a part from `low`.

    m: 12 numbers, the rows of the part's matrix, then its offset, all over r_ref.
    """
    m0, m1, m2, m3, m4, m5 = m[0], m[1], m[2], m[3], m[4], m[5]
    m6, m7, m8, m9, m10, m11 = m[6], m[7], m[8], m[9], m[10], m[11]
    at, low = np.uint64(at), np.uint64(low)
    for i in range(np.uint64(size)):
        x, y, z = px[low + i], py[low + i], pz[low + i]
        ex[at + i] = m0 * x + m1 * y + m2 * z + m9
        ey[at + i] = m3 * x + m4 * y + m5 * z + m10
        ez[at + i] = m6 * x + m7 * y + m8 * z + m11


@VECTOR
def relative_excess(ex, ey, ez, hx, hy, hz, eps, at, size):
    """eps = r^2 / r_ref^2 - 1 from offsets per r_ref and twice the unit vector (hx, hy, hz) to the reference."""
    at = np.uint64(at)
    for i in range(np.uint64(size)):
        j = at + i
        eps[j] = ex[j] * (hx + ex[j]) + ey[j] * (hy + ey[j]) + ez[j] * (hz + ez[j])


@VECTOR
def arguments(k, s, ey, ez, eps, inverse, excess, amplitude, first, psi, omega, u, turn, amp, at, size):
    """From the two polynomials: arguments of gains and cell kernel on [-1, 1], turns on [-1/2, 1/2], amplitude.

    k: (symbols, 16), row s the symbol's constants: y and z of the unit vector, scale and shift of psi, omega and u,
    turns per excess, per psi and per omega, the reference's turn, 1 / r_ref^2.
    """
    hy, hz, sp, cp, so, co, su, cu = k[s, 0], k[s, 1], k[s, 2], k[s, 3], k[s, 4], k[s, 5], k[s, 6], k[s, 7]
    te, tp, to, t0, inverse_r2 = k[s, 8], k[s, 9], k[s, 10], k[s, 11], k[s, 12]
    at, first = np.uint64(at), np.uint64(first)
    for i in range(np.uint64(size)):
        j = at + i
        f = inverse[j]
        d = eps[j] * excess[j]
        p = (hy + ey[j]) * f * sp - cp
        o = (hz + ez[j]) * f * so - co
        psi[j] = p
        omega[j] = o
        u[j] = d * su + cu
        t = te * d + tp * p + to * o + t0
        turn[j] = t - np.rint(t)
        amp[j] = amplitude[first + i] * f * f * inverse_r2


@VECTOR
def waves(size, amp, gain_h, gain_v, cosine, sine, turn, real, imag):
    """real, imag = amplitude times gains times (cosine, sine); `sine` comes divided by the turn."""
    for i in range(size):
        a = amp[i] * gain_h[i] * gain_v[i]
        real[i] = a * cosine[i]
        imag[i] = a * sine[i] * turn[i]
        amp[i] = abs(a)


@VECTOR
def squares(size, turn, square):
    """square = turn^2."""
    for i in range(size):
        square[i] = turn[i] * turn[i]


@VECTOR
def weigh(weight, real, imag, at, size):
    """Sums of weight * real and weight * imag."""
    re, im = weight[0] - weight[0], weight[0] - weight[0]
    at = np.uint64(at)
    for i in range(np.uint64(size)):
        j = at + i
        re += weight[j] * real[j]
        im += weight[j] * imag[j]
    return re, im


@VECTOR
def far_sums(sine, u, real, imag, amp, at, size):
    """Sums of c and c u with c = z sin(pi u), and of |z|, |z| u and |z| u^2, for the bound on far cells."""
    a = sine[0] - sine[0]
    b, c, d, total, first, second = a, a, a, a, a, a
    at = np.uint64(at)
    for i in range(np.uint64(size)):
        j = at + i
        x, y, t, w = real[j] * sine[j], imag[j] * sine[j], u[j], amp[j]
        a += x
        b += y
        c += x * t
        d += y * t
        total += w
        first += w * t
        second += w * t * t
    return a, b, c, d, total, first, second


@VECTOR
def distant_cell(cell, scale, shift, count, sine, u, real, imag, at, size):
    """Sum in one cell, which no point is near, of c / (M sin(pi (cell - u) / M)) with c = z sin(pi u).

    u: on [-1, 1], cells = scale u + shift. |pi (cell - cells) / M| must stay below 1.6 for the sine's polynomial.
    """
    re, im = 0.0, 0.0
    step = np.pi / count
    at = np.uint64(at)
    for i in range(np.uint64(size)):
        j = at + i
        x = (cell - shift - scale * u[j]) * step
        q = x * x
        s = x * (1.0 + q * (-1 / 6 + q * (1 / 120 + q * (-1 / 5040 + q * (1 / 362880 + q * (
            -1 / 39916800 + q * (1 / 6227020800 + q * (-1 / 1307674368000))))))))  # fmt: skip
        w = sine[j] / s
        re += w * real[j]
        im += w * imag[j]
    return re / count, im / count
