"""The compiled loops of the frequency response; each goes through one symbol's points in short vectorised passes.

Sines, cosines and polynomials are those of `lowalt.echo`. Each call allocates only a few work arrays.
"""

import math
from functools import lru_cache

import numpy as np

from lowalt.common.jit import kernel
from lowalt.echo.fast.polynomials import smooth
from lowalt.echo.fast.vector_loops import horner
from lowalt.echo.pointwise.reference_range import RANGE, X, Y, Z
from lowalt.echo.pointwise.terms import dirichlet

LOOPS = kernel(error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
DEGREE = 11
WAVE = np.stack([smooth(name, 0.25, DEGREE)[0] for name in ("cosine", "sine")])
"""Rows COSINE and SINE: cos(2 pi t) and sin(2 pi t) / t as polynomials of t^2, t on [-1/2, 1/2] turns, to rounding."""
COSINE, SINE = 0, 1


@lru_cache(maxsize=16)
def waves(error: float) -> np.ndarray:
    """Return polynomials as in WAVE, of the smallest degree at which cosine and sine err by at most `error`."""
    for degree in range(1, DEGREE):
        (cosine, off), (sine, slope) = smooth("cosine", 0.25, degree), smooth("sine", 0.25, degree)
        if off + 0.5 * slope <= error:
            return np.stack([cosine, sine])
    return WAVE


@LOOPS
def array_sum(x, count, square, c, out, size):
    """out = sin(pi count x) / sin(pi x) with its limits; powers of two are products of cosines of doubled angles."""
    if count & (count - 1):
        for i in range(size):
            out[i] = dirichlet(x[i], count)
        return
    for i in range(size):
        k = np.rint(x[i])
        out[i] = 1.0 - 2.0 * (k - 2.0 * np.floor(0.5 * k)) if count > 1 else 1.0
        half = 0.5 * (x[i] - k)
        square[i] = half * half
    horner(square, WAVE, COSINE, DEGREE, c, size)
    doubled = 1
    while doubled < count:
        for i in range(size):
            out[i] *= 2.0 * c[i]
            c[i] = 2.0 * c[i] * c[i] - 1.0
        doubled *= 2


@LOOPS
def beyond(across, up, side, z, r, spherical):
    """Path (m) to the element `across` and `up` (m) from the array's corner, minus r; plane or spherical wave.

    side, z: the point's coordinates along the array (m). A difference of squares over a sum avoids cancellation.
    """
    if not spherical:
        return -(across * side + up * z) / r
    step = across * (across - 2.0 * side) + up * (up - 2.0 * z)
    return step / (math.sqrt(r * r + step) + r)


@LOOPS
def one_way(
    places, station, axes, refs, origin, half_turns, spacing, aims, beam, kappas, squint, shape, coefficient, gains,
    out, excess,
):  # fmt: skip
    """Fill out (Q, N, L), one array's complex factors over one path at Q frequencies, and excess (N, L) (m).

    places: (N, L, 3) m; axes: sine and cosine of the normal; refs: `precise.reference`; origin: (N, 3) m, its points;
    beam, kappas (Q,): frequencies of the beams' weights and of the arrays over the carrier; shape: the array;
    coefficient: (N or 1, L or 1); gains: (Q, N, L) sums of `near_field` to use instead of the plane wave's, or empty.
    excess: range minus the reference's; with squint the range of the array's middle, else of its corner.
    Returns 0, or n L + l + 1 where r = 0.
    """
    count = places.shape[1]
    sine, cosine = axes
    h, v, turn, weight = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    square, c, gain_h, gain_v, ct, st = (
        np.empty(count), np.empty(count), np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    )  # fmt: skip
    spherical = gains.shape[0] > 0
    middle_h, middle_v = 0.5 * (shape[0] - 1), 0.5 * (shape[1] - 1)
    fixed = 0.5 * beam * (middle_h * aims[0] + middle_v * aims[1])
    wave = half_turns if squint else 0.5 * kappas[0] / spacing
    each = min(1, coefficient.shape[1] - 1)
    for n in range(places.shape[0]):
        rx, ry, rz, r_ref = refs[n, X], refs[n, Y], refs[n, Z], refs[n, RANGE]
        ox, oy, oz = origin[n, 0], origin[n, 1], origin[n, 2]
        least = np.inf
        for i in range(count):
            x, y, z = places[n, i, 0] - station[0], places[n, i, 1] - station[1], places[n, i, 2] - station[2]
            a, b, d = places[n, i, 0] - ox, places[n, i, 1] - oy, places[n, i, 2] - oz
            r = math.sqrt(x * x + y * y + z * z)
            least = min(least, r)
            inverse = 1.0 / r
            # r^2 - r_ref^2 over r + r_ref: a difference of ranges without cancellation.
            more = (a * (2.0 * rx + a) + b * (2.0 * ry + b) + d * (2.0 * rz + d)) / (r + r_ref)
            side = cosine * y - sine * x
            middle = beyond(middle_h * spacing, middle_v * spacing, side, z, r, spherical)
            excess[n, i] = more + middle if squint else more
            weight[i], h[i], v[i] = inverse, side * inverse, z * inverse
            t = -half_turns * more - wave * middle - fixed
            turn[i] = t - np.rint(t)
            square[i] = turn[i] * turn[i]
        if least == 0.0:
            return n * count + 1
        horner(square, WAVE, COSINE, DEGREE, ct, count)
        horner(square, WAVE, SINE, DEGREE, st, count)
        row = n % coefficient.shape[0]
        for i in range(count):
            own = coefficient[row, i * each]
            out[0, n, i] = own * complex(weight[i] * ct[i], weight[i] * (st[i] * turn[i]))
        # Go through the frequencies in reverse: entry 0 holds the factor that all others need.
        for q in range(len(kappas) - 1, -1, -1):
            if spherical:
                for i in range(count):
                    out[q, n, i] = out[0, n, i] * gains[q, n, i]
                continue
            for i in range(count):
                turn[i] = 0.5 * (kappas[q] * h[i] - beam * aims[0])
            array_sum(turn, shape[0], square, c, gain_h, count)
            for i in range(count):
                turn[i] = 0.5 * (kappas[q] * v[i] - beam * aims[1])
            array_sum(turn, shape[1], square, c, gain_v, count)
            for i in range(count):
                out[q, n, i] = out[0, n, i] * (gain_h[i] * gain_v[i])
    return 0


@LOOPS
def near_field(places, station, axes, spacing, wave, beam, aims, shape, series, rows, out):
    """Fill out (Q, N, L) with array sums of spherical waves at Q frequencies, phases as seen from the array's middle.

    wave: turns a metre at the frequency in the middle; beam: the weights' frequency over the carrier; series: (Q, K)
    complex, factor of the sum over elements of s^k at each frequency, s in metres: how much longer an element's path
    is than the middle's; rows: `waves`. Element (i, j) stands at i d y' + j d z.
    """
    sine, cosine = axes
    wide, high = shape
    count, orders = wide * high, series.shape[1]
    across, up, fixed = np.empty(count), np.empty(count), np.empty(count)
    middle_h, middle_v = 0.5 * (wide - 1), 0.5 * (high - 1)
    for i in range(wide):
        for j in range(high):
            across[i * high + j], up[i * high + j] = i * spacing, j * spacing
            fixed[i * high + j] = 0.5 * beam * ((i - middle_h) * aims[0] + (j - middle_v) * aims[1])
    turn, square, ct, st = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    longer, real, imag, sums = np.empty(count), np.empty(count), np.empty(count), np.empty(orders + 1, np.complex128)
    for n in range(places.shape[0]):
        for l in range(places.shape[1]):  # noqa: E741
            x, y, z = places[n, l, 0] - station[0], places[n, l, 1] - station[1], places[n, l, 2] - station[2]
            r = math.sqrt(x * x + y * y + z * z)
            side = cosine * y - sine * x
            middle = beyond(middle_h * spacing, middle_v * spacing, side, z, r, True)
            for e in range(count):
                step = across[e] * (across[e] - 2.0 * side) + up[e] * (up[e] - 2.0 * z)
                own = math.sqrt(r * r + step)
                # One quotient for both the path and the amplitude.
                whole = own + r
                inverse = 1.0 / (own * whole)
                s = step * own * inverse - middle
                t = -wave * s - fixed[e]
                longer[e], real[e] = s, r * whole * inverse
                turn[e] = t - np.rint(t)
                square[e] = turn[e] * turn[e]
            horner(square, rows, COSINE, rows.shape[1] - 1, ct, count)
            horner(square, rows, SINE, rows.shape[1] - 1, st, count)
            for e in range(count):
                imag[e] = real[e] * (st[e] * turn[e])
                real[e] *= ct[e]
            # Two orders a pass over the elements.
            for k in range(0, orders, 2):
                re, im, more_re, more_im = 0.0, 0.0, 0.0, 0.0
                for e in range(count):
                    a, b = real[e] * longer[e], imag[e] * longer[e]
                    re += real[e]
                    im += imag[e]
                    more_re += a
                    more_im += b
                    real[e] = a * longer[e]
                    imag[e] = b * longer[e]
                sums[k], sums[k + 1] = complex(re, im), complex(more_re, more_im)
            for q in range(len(series)):
                total = 0j
                for k in range(orders):
                    total += series[q, k] * sums[k]
                out[q, n, l] = total
