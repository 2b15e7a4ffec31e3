"""The compiled loops of the frequency response; each goes through one symbol's points in short vectorised passes.

Sines, cosines and polynomials are those of `lowalt.echo`. Each call allocates only a few work arrays.
"""

import math

import numpy as np

from lowalt.common.jit import INNER_VECTOR, VECTOR, kernel
from lowalt.echo.fast.vector_loops import horner
from lowalt.echo.pointwise.reference_range import RANGE, X, Y, Z
from lowalt.effects.plane_loops import plane_sums
from lowalt.effects.waves import COSINE, DEGREE, SINE, WAVE

LOOPS = kernel(error_model="numpy", fastmath={"contract", "reassoc", "nsz"})


@INNER_VECTOR
def beyond(across, up, side, z, r, spherical):
    """Path (m) to the element `across` and `up` (m) from the array's corner, minus r; plane or spherical wave.

    side, z: the point's coordinates along the array (m). A difference of squares over a sum avoids cancellation.
    """
    if not spherical:
        return -(across * side + up * z) / r
    step = across * (across - 2.0 * side) + up * (up - 2.0 * z)
    return step / (math.sqrt(r * r + step) + r)


@INNER_VECTOR
def beyond_middle(side, z, r, inverse, across, up, spherical, out):
    """Fill out (L,) with `beyond` for points at side, z (m) and range r; inverse: 1 / r."""
    for i in range(np.uint64(len(out))):
        out[i] = -(across * side[i] + up * z[i]) * inverse[i]
    if spherical:
        for i in range(np.uint64(len(out))):
            step = across * (across - 2.0 * side[i]) + up * (up - 2.0 * z[i])
            out[i] = step / (math.sqrt(r[i] * r[i] + step) + r[i])


@INNER_VECTOR
def geometry(x, y, z, station, axes, ref, origin, more, side, up, r, inverse):
    """Fill (L,) arrays of points x, y, z (L,) m: excess range, coordinates along the array, range and 1 / range (m).

    ref: a row of `precise.reference`; origin: (3,) m, its point. Returns how many points are in the station.
    """
    sine, cosine = axes
    s0, s1, s2, o0, o1, o2 = station[0], station[1], station[2], origin[0], origin[1], origin[2]
    rx, ry, rz, r_ref = ref[X], ref[Y], ref[Z], ref[RANGE]
    zeros = 0
    for i in range(np.uint64(len(x))):
        across, along, high = x[i] - s0, y[i] - s1, z[i] - s2
        a, b, d = x[i] - o0, y[i] - o1, z[i] - o2
        far = math.sqrt(across * across + along * along + high * high)
        # A count, unlike a branch or a least range, leaves this loop to vector instructions.
        zeros += 1 if far == 0.0 else 0
        # One quotient for both 1 / r and 1 / (r + r_ref): a division takes as long as ten products.
        both = far + r_ref
        share = 1.0 / (far * both)
        # r^2 - r_ref^2 over r + r_ref: a difference of ranges without cancellation.
        more[i] = (a * (2.0 * rx + a) + b * (2.0 * ry + b) + d * (2.0 * rz + d)) * (far * share)
        side[i], up[i], r[i], inverse[i] = cosine * along - sine * across, high, far, both * share
    return zeros


@INNER_VECTOR
def scaled(own, weight, c, s, turn, real, imag):
    """Fill real, imag (L,) with own weight (c + j s turn); own: complex, (1,) for all points or (L,)."""
    if len(own) == 1:
        a, b = own[0].real, own[0].imag
        for i in range(np.uint64(len(real))):
            x, y = weight[i] * c[i], weight[i] * (s[i] * turn[i])
            real[i], imag[i] = a * x - b * y, a * y + b * x
        return
    for i in range(np.uint64(len(real))):
        z = own[i] * complex(weight[i] * c[i], weight[i] * (s[i] * turn[i]))
        real[i], imag[i] = z.real, z.imag


@INNER_VECTOR
def blended(gains, shares, q, n, out):
    """Fill out (L,) with the sum of gains (K, Q, N, L) at q and n times shares (K,), two at least."""
    one, two, a, b = gains[0, q, n], gains[1, q, n], shares[0], shares[1]
    for i in range(np.uint64(len(out))):
        out[i] = complex(a * one[i].real + b * two[i].real, a * one[i].imag + b * two[i].imag)
    for k in range(2, len(shares)):
        more, c = gains[k, q, n], shares[k]
        for i in range(np.uint64(len(out))):
            out[i] = complex(out[i].real + c * more[i].real, out[i].imag + c * more[i].imag)


@VECTOR
def one_way(
    places, station, axes, refs, origin, half_turns, spacing, aims, beam, kappas, steps, rows, squint, shape,
    coefficient, gains, shares, work, wide, high, blend, out, excess,
):  # fmt: skip
    """Fill out (2, Q, N, L), real and imaginary parts of one array's factors over one path, and excess (N, L) (m).

    places: (N, 3, L) m; axes: sine and cosine of the normal; refs: `precise.reference`; origin: (N, 3) m, its points;
    beam, kappas (Q,): frequencies of the beams' weights and of the arrays over the carrier; steps, rows: as in
    `plane_sums`; shape: the array; coefficient: (N or 1, L or 1); gains: (K, Q, N, L) sums of `near_field`, which count
    by shares (K,), to use instead of the plane wave's, or empty; work (13, L), wide and high (Q, L), blend (L,): work
    space.
    excess: range minus the reference's; with squint the range of the array's middle, else of its corner.
    Returns 0, or n L + l + 1 where r = 0.
    """
    count = places.shape[2]
    side, up, r, weight, middle = work[0], work[1], work[2], work[3], work[4]
    turn, square, ct, st, more, real, imag = work[5], work[6], work[7], work[8], work[9], work[10], work[11]
    spherical = gains.shape[0] > 0
    middle_h, middle_v = 0.5 * (shape[0] - 1), 0.5 * (shape[1] - 1)
    fixed = 0.5 * beam * (middle_h * aims[0] + middle_v * aims[1])
    wave = half_turns if squint else 0.5 * kappas[0] / spacing
    for n in range(places.shape[0]):
        at, ahead = places[n], excess[n]
        if geometry(at[0], at[1], at[2], station, axes, refs[n], origin[n], more, side, up, r, weight):
            for i in range(count):
                if r[i] == 0.0:
                    return n * count + i + 1
        beyond_middle(side, up, r, weight, middle_h * spacing, middle_v * spacing, spherical, middle)
        for i in range(np.uint64(count)):
            ahead[i] = more[i] + middle[i] if squint else more[i]
            t = -half_turns * more[i] - wave * middle[i] - fixed
            turn[i] = t - np.rint(t)
            square[i] = turn[i] * turn[i]
        horner(square, WAVE, COSINE, DEGREE, ct, count)
        horner(square, WAVE, SINE, DEGREE, st, count)
        scaled(coefficient[n % coefficient.shape[0]], weight, ct, st, turn, real, imag)
        if spherical:
            for q in range(len(kappas)):
                seen = gains[0, q, n]
                if len(shares) > 1:
                    seen = blend
                    blended(gains, shares, q, n, seen)
                own_re, own_im = out[0, q, n], out[1, q, n]
                for i in range(np.uint64(count)):
                    x, y = seen[i].real, seen[i].imag
                    own_re[i], own_im[i] = real[i] * x - imag[i] * y, real[i] * y + imag[i] * x
            continue
        # The array sums need none of what stands in these rows.
        spare, centre = work[4:9], 0.25 * (kappas[0] + kappas[-1])
        plane_sums(side, weight, centre, steps, 0.5 * beam * aims[0], shape[0], rows, spare, more, work[12], wide)
        plane_sums(up, weight, centre, steps, 0.5 * beam * aims[1], shape[1], rows, spare, more, work[12], high)
        for q in range(len(kappas)):
            own_re, own_im, one, other = out[0, q, n], out[1, q, n], wide[q], high[q]
            for i in range(np.uint64(count)):
                gain = one[i] * other[i]
                own_re[i], own_im[i] = gain * real[i], gain * imag[i]
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
