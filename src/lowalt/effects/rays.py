"""The loops of the frequency response: one symbol's points at a time, in short passes the compiler turns into vectors.

Sines, cosines and polynomials are those of `lowalt.echo`. Only a few work arrays a call are allocated.
"""

import math

import numpy as np

from lowalt.echo.compile import kernel
from lowalt.echo.fits import smooth
from lowalt.echo.lanes import horner
from lowalt.echo.terms import dirichlet

LOOPS = kernel(error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
DEGREE = 11
WAVE = np.stack([smooth(name, 0.25, DEGREE)[0] for name in ("cosine", "sine")])
"""Rows COSINE and SINE: cos(2 pi t) and sin(2 pi t) / t as polynomials of t^2, t on [-1/2, 1/2] turns, to rounding."""
COSINE, SINE = 0, 1


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
def routes(places, station, axes, refs, origin, half_turns, aims, kappas, shape, coefficient, gains, out, excess):
    """Fill out (N, L), one array's complex factor over one route, and excess (N, L), range beyond the reference's (m).

    places: (N, L, 3) m; axes: sine and cosine of the normal; refs: `precise.reference`; origin: (N, 3) m, its points;
    kappas: frequency over the carrier now and of the beams' weights; shape: the array; coefficient: (N or 1, L or 1);
    gains: (N, L) array sums to use instead of the plane wave's, or (0, 0). Returns 0, or n L + l + 1 where r = 0.
    """
    count = places.shape[1]
    sine, cosine = axes
    psi0, omega0 = aims
    h, v, turn, weight = np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    square, c, gain_h, gain_v, ct, st = (
        np.empty(count), np.empty(count), np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    )  # fmt: skip
    plane = gains.shape[0] == 0
    phase_h, phase_v = 0.5 * (shape[0] - 1), 0.5 * (shape[1] - 1)
    for n in range(places.shape[0]):
        rx, ry, rz, r_ref = refs[n, 0], refs[n, 1], refs[n, 2], refs[n, 3]
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
            excess[n, i] = more
            weight[i] = inverse
            p = 0.5 * (kappas[0] * ((cosine * y - sine * x) * inverse) - kappas[1] * psi0)
            o = 0.5 * (kappas[0] * (z * inverse) - kappas[1] * omega0)
            h[i], v[i] = p, o
            t = -half_turns * more
            if plane:
                t += phase_h * p + phase_v * o
            turn[i] = t - np.rint(t)
            square[i] = turn[i] * turn[i]
        if least == 0.0:
            return n * count + 1
        horner(square, WAVE, COSINE, DEGREE, ct, count)
        horner(square, WAVE, SINE, DEGREE, st, count)
        if plane:
            array_sum(h, shape[0], square, c, gain_h, count)
            array_sum(v, shape[1], square, c, gain_v, count)
            for i in range(count):
                weight[i] *= gain_h[i] * gain_v[i]
        row = n % coefficient.shape[0]
        for i in range(count):
            out[n, i] = coefficient[row, i % coefficient.shape[1]] * complex(
                weight[i] * ct[i], weight[i] * (st[i] * turn[i])
            )
        if not plane:
            for i in range(count):
                out[n, i] *= gains[n, i]
    return 0


@LOOPS
def near_field(places, station, axes, spacing, wave, weight, aims, shape, out):
    """Array sums (N, L) of spherical waves: element (i, j) at i d y' + j d z, its range minus r without cancellation.

    wave: turns a metre at the arrays' frequency; weight: turns an element and direction cosine of the beams.
    """
    sine, cosine = axes
    wide, high = shape
    count = wide * high
    across, up, fixed = np.empty(count), np.empty(count), np.empty(count)
    for i in range(wide):
        for j in range(high):
            across[i * high + j], up[i * high + j] = i * spacing, j * spacing
            fixed[i * high + j] = weight * (i * aims[0] + j * aims[1])
    turn, square, ct, st, share = np.empty(count), np.empty(count), np.empty(count), np.empty(count), np.empty(count)
    for n in range(places.shape[0]):
        for l in range(places.shape[1]):  # noqa: E741
            x, y, z = places[n, l, 0] - station[0], places[n, l, 1] - station[1], places[n, l, 2] - station[2]
            r = math.sqrt(x * x + y * y + z * z)
            side = cosine * y - sine * x
            for e in range(count):
                step = across[e] * (across[e] - 2.0 * side) + up[e] * (up[e] - 2.0 * z)
                own = math.sqrt(r * r + step)
                t = -wave * step / (own + r) - fixed[e]
                turn[e] = t - np.rint(t)
                square[e] = turn[e] * turn[e]
                share[e] = r / own
            horner(square, WAVE, COSINE, DEGREE, ct, count)
            horner(square, WAVE, SINE, DEGREE, st, count)
            re, im = 0.0, 0.0
            for e in range(count):
                re += share[e] * ct[e]
                im += share[e] * (st[e] * turn[e])
            out[n, l] = complex(re, im)


@LOOPS
def moments(strength, out, back, times, base, excess_a, excess_b, half_cells, reach, result):
    """Add sum over points of z T_p(u) to result (N, P): z = times strength out back, u the two-way range in cells.

    strength: (N or 1, L); base: (N,) the reference's range beyond its whole cell; u runs from -1 to 1 over reach cells.
    """
    count = out.shape[1]
    x, before, last = np.empty(count), np.empty(count), np.empty(count)
    real, imag = np.empty(count), np.empty(count)
    for n in range(out.shape[0]):
        row = n % strength.shape[0]
        for i in range(count):
            x[i] = (base[n] + half_cells * (excess_a[n, i] + excess_b[n, i])) / reach
            z = times * strength[row, i] * (out[n, i] * back[n, i])
            real[i], imag[i] = z.real, z.imag
            before[i], last[i] = x[i], 1.0
        for p in range(result.shape[1]):
            re, im = 0.0, 0.0
            for i in range(count):
                t = last[i]
                re += t * real[i]
                im += t * imag[i]
                last[i] = 2.0 * x[i] * t - before[i] if p else x[i]
                before[i] = t
            result[n, p] += complex(re, im)


@LOOPS
def spread(sums, own, table, weight, result):
    """Add own[n] sum_p (-j)^p sums[n, p] table[p, m] weight[m] to result (N, M); table is real."""
    total = table.shape[1]
    re, im = np.empty(total), np.empty(total)
    for n in range(sums.shape[0]):
        for m in range(total):
            re[m], im[m] = 0.0, 0.0
        for p in range(sums.shape[1]):
            value = sums[n, p] * own[n]
            a, b = value.real, value.imag
            if p % 4 == 1:
                a, b = b, -a
            elif p % 4 == 2:
                a, b = -a, -b
            elif p % 4 == 3:
                a, b = -b, a
            for m in range(total):
                re[m] += a * table[p, m]
                im[m] += b * table[p, m]
        for m in range(total):
            result[n, m] += complex(re[m] * weight[m], im[m] * weight[m])
