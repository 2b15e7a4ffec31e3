"""The fast kernel's loops over a strip of points, which the compiler turns into vector code.

Every smooth factor is a polynomial whose degree the plan chose by its error bound, so the same
loops serve exact mode and every tolerance, in float64 or float32. The compiler may reorder sums and
fuse products, since no bound depends on the order of roundings. Indices are unsigned, because
Python's negative indices would prevent vectorisation.
"""

import math

import numpy as np

from lowalt.echo.fast.strip import MULTIPLE
from lowalt.machine.jit import INNER_VECTOR


@INNER_VECTOR
def horner(x, c, row, degree, out, size):
    """Fill out[:size] with the polynomial sum of c[row, k] x^k, k up to `degree`.

    Each pass over the strip takes four orders.
    """
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
        c0 = c[row, degree - 1]
        c1 = c[row, degree - 2]
        for i in range(np.uint64(size)):
            t = x[i]
            out[i] = (top * t + c0) * t + c1
    else:
        c0 = c[row, degree - 1]
        c1 = c[row, degree - 2]
        c2 = c[row, degree - 3]
        for i in range(np.uint64(size)):
            t = x[i]
            out[i] = ((top * t + c0) * t + c1) * t + c2
    k = degree - first
    while k > 0:
        c0 = c[row, k - 1]
        c1 = c[row, k - 2]
        c2 = c[row, k - 3]
        c3 = c[row, k - 4]
        for i in range(np.uint64(size)):
            t = x[i]
            out[i] = (((out[i] * t + c0) * t + c1) * t + c2) * t + c3
        k -= 4


@INNER_VECTOR
def place_part(coordinates, low, size, pose, placing, offsets, at):
    """Fill the offsets from `at` with `size` points of a part from `low`.

    Up to MULTIPLE - 1 offsets beyond are filled, too.

    coordinates: those of all points in their parts' frames (m); pose: rows of the part's matrix and
    its offset from the reference, in the array's axes (normal, horizontal, up), over r_ref. The
    loop processes full vectors, because a scalar remainder loop would be slower.
    """
    px, py, pz = coordinates
    (xx, xy, xz), (yx, yy, yz), (zx, zy, zz), (x0, y0, z0) = pose
    hx, hy, hz, y_scale, y_shift, z_scale, z_shift = placing
    eps, ey, ez = offsets
    at = np.uint64(at)
    low = np.uint64(low)
    for i in range(np.uint64(-(-size // MULTIPLE) * MULTIPLE)):
        x = px[low + i]
        y = py[low + i]
        z = pz[low + i]
        a = xx * x + xy * y + xz * z + x0
        b = yx * x + yy * y + yz * z + y0
        c = zx * x + zy * y + zz * z + z0
        eps[at + i] = a * (hx + a) + b * (hy + b) + c * (hz + c)
        ey[at + i] = b * y_scale + y_shift
        ez[at + i] = c * z_scale + z_shift


@INNER_VECTOR
def place_nodes(translation, n, q, low, size, axes, placing, offsets):
    """Fill the offsets with `size` points from `low` that are parts of their own.

    They are relative to the point q; everything else is as in `place_part`.

    axes: cosine and sine of the array's normal, and 1 / r_ref.
    """
    cosine, sine, scale = axes
    hx, hy, hz, y_scale, y_shift, z_scale, z_shift = placing
    eps, ey, ez = offsets
    n = np.uint64(n)
    low = np.uint64(low)
    q = np.uint64(q)
    px = translation[n, q, 0]
    py = translation[n, q, 1]
    pz = translation[n, q, 2]
    for i in range(np.uint64(size)):
        x = translation[n, low + i, 0] - px
        y = translation[n, low + i, 1] - py
        z = translation[n, low + i, 2] - pz
        a = (cosine * x + sine * y) * scale
        b = (cosine * y - sine * x) * scale
        c = z * scale
        eps[i] = a * (hx + a) + b * (hy + b) + c * (hz + c)
        ey[i] = b * y_scale + y_shift
        ez[i] = c * z_scale + z_shift


@INNER_VECTOR
def geometry(offsets, constants, size, strip):
    """Fill psi, omega, cells, turn and square of the strip, by one root and one quotient a point.

    constants: a `Geometry`. The range difference is eps / (1 + sqrt(1 + eps)), in which nothing
    cancels.
    """
    cp, co, su, cu, td, tp, to, t0 = constants
    eps, ey, ez = offsets
    psi = strip.psi
    omega = strip.omega
    cells = strip.cells
    turn = strip.turn
    square = strip.square
    for i in range(np.uint64(size)):
        e = eps[i]
        r = math.sqrt(1.0 + e)
        q = 1.0 / (r + r * r)
        d = e * (q * r)
        f = q + q * r
        p = ey[i] * f - cp
        o = ez[i] * f - co
        t = td * d + tp * p + to * o + t0
        psi[i] = p
        omega[i] = o
        cells[i] = su * d + cu
        turn[i] = t - np.rint(t)
        square[i] = f * f


@INNER_VECTOR
def amplitudes(strip, share, first, cosine, sine, size):
    """Fill real and imag of the strip: share times gains times (cosine, sine) of the turn.

    share: all points' amplitudes over their sum; cosine, sine: tuples of the coefficients of cos(2
    pi t) and sin(2 pi t) / t in t^2. Returns the sums of |amplitude| and of |amplitude| times
    cells^2.
    """
    turn = strip.turn
    cells = strip.cells
    square = strip.square
    gain_h = strip.gain_h
    gain_v = strip.gain_v
    real = strip.real
    imag = strip.imag
    total = cosine[0] - cosine[0]
    second = cosine[0] - cosine[0]
    first = np.uint64(first)
    top = len(cosine) - 1
    for i in range(np.uint64(size)):
        t = turn[i]
        v = cells[i]
        x = t * t
        a = share[first + i] * gain_h[i] * gain_v[i] * square[i]
        b = abs(a)
        total += b
        second += b * v * v
        # The number of coefficients is known to the compiler, which writes this loop out.
        c = cosine[top]
        s = sine[top]
        for k in range(top):
            c = c * x + cosine[top - 1 - k]
            s = s * x + sine[top - 1 - k]
        real[i] = a * c
        imag[i] = a * t * s
    return total, second


@INNER_VECTOR
def moments(strip, at, size):
    """Return the sums of real and of imag times 1, v, v^2, v^3 over `size` points from `at`.

    v: the strip's cells.

    real and imag are then multiplied by v^4, for the next four orders.
    """
    real = strip.real
    imag = strip.imag
    cells = strip.cells
    a = real[0] - real[0]
    a0 = a
    a1 = a
    a2 = a
    a3 = a
    b0 = a
    b1 = a
    b2 = a
    b3 = a
    at = np.uint64(at)
    for i in range(np.uint64(size)):
        x = real[at + i]
        y = imag[at + i]
        t = cells[at + i]
        t2 = t * t
        t3 = t2 * t
        t4 = t2 * t2
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
