"""The fast kernel: short loops over a tile of one symbol's points that the compiler turns into vector instructions.

A tile's arrays stay in the first-level cache. Every smooth factor is a polynomial whose degree the plan has chosen
by its bound, so that the same loops serve the exact mode and every tolerance, in float64 or float32.
Sums may be reordered and products fused; nothing here depends on the order of roundings. Places in arrays are
unsigned: a signed one may be negative, and Python's wrap-around of those would keep the loops from being vectors;
views of arrays would do as well, but cost a counted reference each.
"""

import math

import numpy as np

from lowalt.common.jit import LEAN, VECTOR

TILE = 256
"""Most points worked on at a time: a dozen arrays of 2 kB stay in the nearest cache."""
LANES = 16
"""Tiles hold whole multiples of this many points; the padding has no amplitude."""
ROW = TILE + LANES + 8
"""Room of a work array: a tile and what the last run of a part may write beyond it; of odd length, since rows a
whole 4096 bytes apart would make loads wait for unrelated stores."""


@LEAN
def chunk_of(points: int) -> int:
    """Points of a tile when a target has `points` (padded): equal shares of at most TILE, whole multiples of LANES."""
    shares = -(-points // TILE)
    return -(-points // (shares * LANES)) * LANES


@VECTOR
def horner(x, c, row, degree, out, size):
    """out[:size] = sum of c[row, k] x^k for k up to `degree`, four orders a pass over the tile."""
    top = c[row, degree]
    first = degree & 3
    if first == 0:
        for i in range(np.uint64(size)):
            out[i] = top
    elif first == 1:
        c0 = c[row, degree - 1]
        for i in range(np.uint64(size)):
            out[i] = top * x[i] + c0
    elif first == 2:
        c0, c1 = c[row, degree - 1], c[row, degree - 2]
        for i in range(np.uint64(size)):
            t = x[i]
            out[i] = (top * t + c0) * t + c1
    else:
        c0, c1, c2 = c[row, degree - 1], c[row, degree - 2], c[row, degree - 3]
        for i in range(np.uint64(size)):
            t = x[i]
            out[i] = ((top * t + c0) * t + c1) * t + c2
    k = degree - first
    while k > 0:
        c0, c1, c2, c3 = c[row, k - 1], c[row, k - 2], c[row, k - 3], c[row, k - 4]
        for i in range(np.uint64(size)):
            t = x[i]
            out[i] = (((out[i] * t + c0) * t + c1) * t + c2) * t + c3
        k -= 4


@VECTOR
def place_part(px, py, pz, low, size, m, eps, ey, ez, at):
    """Place `size` points of a part from `low`, and up to LANES - 1 beyond: eps, ey, ez from `at`.

    m: the rows of the part's matrix, then its offset, all over r_ref; twice the unit vector to the reference; scale
    and shift of ey and of ez. eps = r^2 / r_ref^2 - 1. Whole vectors: single steps would cost more.
    """
    m0, m1, m2, m3, m4, m5 = m[0], m[1], m[2], m[3], m[4], m[5]
    m6, m7, m8, m9, m10, m11 = m[6], m[7], m[8], m[9], m[10], m[11]
    hx, hy, hz, ys, y0, zs, z0 = m[12], m[13], m[14], m[15], m[16], m[17], m[18]
    at, low = np.uint64(at), np.uint64(low)
    for i in range(np.uint64(-(-size // LANES) * LANES)):
        x, y, z = px[low + i], py[low + i], pz[low + i]
        a = m0 * x + m1 * y + m2 * z + m9
        b = m3 * x + m4 * y + m5 * z + m10
        c = m6 * x + m7 * y + m8 * z + m11
        eps[at + i] = a * (hx + a) + b * (hy + b) + c * (hz + c)
        ey[at + i] = b * ys + y0
        ez[at + i] = c * zs + z0


@VECTOR
def place_still(m, size, eps, ey, ez, at):
    """As `place_part` for a part whose matrix is zero, as a node's is: all its points stand at its offset."""
    a, b, c = m[9], m[10], m[11]
    e = a * (m[12] + a) + b * (m[13] + b) + c * (m[14] + c)
    y, z = b * m[15] + m[16], c * m[17] + m[18]
    at = np.uint64(at)
    for i in range(np.uint64(-(-size // LANES) * LANES)):
        eps[at + i], ey[at + i], ez[at + i] = e, y, z


@VECTOR
def place_nodes(translation, n, q, low, size, cosine, sine, scale, m, eps, ey, ez):
    """As `place_part` for `size` points from `low` that are parts of their own, relative to the point q."""
    hx, hy, hz, ys, y0, zs, z0 = m[12], m[13], m[14], m[15], m[16], m[17], m[18]
    n, low, q = np.uint64(n), np.uint64(low), np.uint64(q)
    px, py, pz = translation[n, q, 0], translation[n, q, 1], translation[n, q, 2]
    for i in range(np.uint64(size)):
        x, y = translation[n, low + i, 0] - px, translation[n, low + i, 1] - py
        a, b = (cosine * x + sine * y) * scale, (cosine * y - sine * x) * scale
        c = (translation[n, low + i, 2] - pz) * scale
        eps[i] = a * (hx + a) + b * (hy + b) + c * (hz + c)
        ey[i] = b * ys + y0
        ez[i] = c * zs + z0


@VECTOR
def geometry(eps, ey, ez, k, size, psi, omega, cells, turn, square):
    """Arguments of gains and cell kernel on [-1, 1], turns on [-1/2, 1/2] and (r_ref / r)^2, by root and quotient.

    k: shifts of psi and omega, scale and shift of the cells, turns per relative range, per psi and per omega, the
    reference's turn. ey and ez come scaled. The range difference is eps / (1 + sqrt(1 + eps)): nothing cancels.
    """
    cp, co, su, cu, td, tp, to, t0 = k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7]
    for i in range(np.uint64(size)):
        e = eps[i]
        r = math.sqrt(1.0 + e)
        q = 1.0 / (r + r * r)
        d, f = e * (q * r), q + q * r
        p, o = ey[i] * f - cp, ez[i] * f - co
        t = td * d + tp * p + to * o + t0
        psi[i] = p
        omega[i] = o
        cells[i] = su * d + cu
        turn[i] = t - np.rint(t)
        square[i] = f * f


@VECTOR
def near_geometry(eps, ey, ez, k, excess, inverse, size, psi, omega, cells, turn, square):
    """As `geometry`, with polynomials of degree 4 and 3 in eps for the range difference over eps and for 1 / r."""
    cp, co, su, cu, td, tp, to, t0 = k[0], k[1], k[2], k[3], k[4], k[5], k[6], k[7]
    c0, c1, c2, c3, c4 = excess[0], excess[1], excess[2], excess[3], excess[4]
    f0, f1, f2, f3 = inverse[0], inverse[1], inverse[2], inverse[3]
    for i in range(np.uint64(size)):
        e = eps[i]
        d = e * ((((c4 * e + c3) * e + c2) * e + c1) * e + c0)
        f = ((f3 * e + f2) * e + f1) * e + f0
        p, o = ey[i] * f - cp, ez[i] * f - co
        t = td * d + tp * p + to * o + t0
        psi[i] = p
        omega[i] = o
        cells[i] = su * d + cu
        turn[i] = t - np.rint(t)
        square[i] = f * f


@VECTOR
def waves_5(turn, gain_h, gain_v, square, amplitude, first, cells, c, s, size, real, imag):
    """real, imag = amplitude times gains times (cosine, sine) of `turn`; returns sums of |amplitude| and of it times
    cells^2. c, s: coefficients of cos(2 pi t) and sin(2 pi t) / t in t^2, of degree 5.
    """
    c0, c1, c2, c3, c4, c5 = c[0], c[1], c[2], c[3], c[4], c[5]
    s0, s1, s2, s3, s4, s5 = s[0], s[1], s[2], s[3], s[4], s[5]
    total, second = c0 - c0, c0 - c0
    first = np.uint64(first)
    for i in range(np.uint64(size)):
        t, v = turn[i], cells[i]
        x = t * t
        a = amplitude[first + i] * gain_h[i] * gain_v[i] * square[i]
        b = abs(a)
        total += b
        second += b * v * v
        real[i] = a * (((((c5 * x + c4) * x + c3) * x + c2) * x + c1) * x + c0)
        imag[i] = a * t * (((((s5 * x + s4) * x + s3) * x + s2) * x + s1) * x + s0)
    return total, second


@VECTOR
def waves_7(turn, gain_h, gain_v, square, amplitude, first, cells, c, s, size, real, imag):
    """As `waves_5`, of degree 7."""
    c0, c1, c2, c3, c4, c5, c6, c7 = c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]
    s0, s1, s2, s3, s4, s5, s6, s7 = s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7]
    total, second = c0 - c0, c0 - c0
    first = np.uint64(first)
    for i in range(np.uint64(size)):
        t, v = turn[i], cells[i]
        x = t * t
        a = amplitude[first + i] * gain_h[i] * gain_v[i] * square[i]
        b = abs(a)
        total += b
        second += b * v * v
        real[i] = a * (((((((c7 * x + c6) * x + c5) * x + c4) * x + c3) * x + c2) * x + c1) * x + c0)
        imag[i] = a * t * (((((((s7 * x + s6) * x + s5) * x + s4) * x + s3) * x + s2) * x + s1) * x + s0)
    return total, second


@VECTOR
def waves_10(turn, gain_h, gain_v, square, amplitude, first, cells, c, s, size, real, imag):
    """As `waves_5`, of degree 10."""
    c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10 = c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10]
    s0, s1, s2, s3, s4, s5, s6, s7, s8, s9, s10 = s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10]
    total, second = c0 - c0, c0 - c0
    first = np.uint64(first)
    for i in range(np.uint64(size)):
        t, v = turn[i], cells[i]
        x = t * t
        a = amplitude[first + i] * gain_h[i] * gain_v[i] * square[i]
        b = abs(a)
        total += b
        second += b * v * v
        high = ((((c10 * x + c9) * x + c8) * x + c7) * x + c6) * x + c5
        real[i] = a * (((((high * x + c4) * x + c3) * x + c2) * x + c1) * x + c0)
        high = ((((s10 * x + s9) * x + s8) * x + s7) * x + s6) * x + s5
        imag[i] = a * t * (((((high * x + s4) * x + s3) * x + s2) * x + s1) * x + s0)
    return total, second


@VECTOR
def moments(real, imag, cells, at, size):
    """Sums of real and of imag times 1, v, v^2, v^3 with v = cells, which are then multiplied by v^4, from `at` on."""
    a = real[0] - real[0]
    a0, a1, a2, a3, b0, b1, b2, b3 = a, a, a, a, a, a, a, a
    at = np.uint64(at)
    for i in range(np.uint64(size)):
        x, y, t = real[at + i], imag[at + i], cells[at + i]
        t2 = t * t
        t3, t4 = t2 * t, t2 * t2
        a0 += x
        b0 += y
        a1 += x * t
        b1 += y * t
        a2 += x * t2
        b2 += y * t2
        a3 += x * t3
        b3 += y * t3
        real[at + i] = x * t4
        imag[at + i] = y * t4
    return a0, a1, a2, a3, b0, b1, b2, b3
