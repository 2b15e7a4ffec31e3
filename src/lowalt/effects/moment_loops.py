"""The compiled loops between a target's points and all subcarriers: moments of the ranges, and their spectra."""

import math

import numpy as np

from lowalt.common.jit import kernel

LOOPS = kernel(error_model="numpy", fastmath={"contract", "reassoc", "nsz"})
STRIDE = 16
"""Subcarriers that share one short phase ramp."""
QUARTERS = np.array([1, -1j, -1, 1j])
"""(-j)^p by p modulo 4."""


@LOOPS
def moments(strength, out, back, times, excess_a, excess_b, middle, half_cells, reach, result):
    """Fill result (Q, N, P) with the sum over points of z T_p(u): z = times strength out back, u the two-way range.

    out, back: (Q, N, L) at Q frequencies; strength: (N or 1, L); u counts from `middle` (N,), in cells as `reach`, and
    runs from -1 to 1 over `reach`. Symbols without any strength stay zero.
    """
    nodes, symbols, count = out.shape
    x, before, last = np.empty(count), np.empty(count), np.empty(count)
    real, imag = np.empty((nodes, count)), np.empty((nodes, count))
    for n in range(symbols):
        row = n % strength.shape[0]
        result[:, n] = 0.0
        if not strength[row].any():
            continue
        for i in range(count):
            x[i] = (half_cells * (excess_a[n, i] + excess_b[n, i]) - middle[n]) / reach
            before[i], last[i] = x[i], 1.0
        for q in range(nodes):
            for i in range(count):
                z = times * strength[row, i] * (out[q, n, i] * back[q, n, i])
                real[q, i], imag[q, i] = z.real, z.imag
        for p in range(result.shape[2]):
            for q in range(nodes):
                re, im = 0.0, 0.0
                for i in range(count):
                    re += last[i] * real[q, i]
                    im += last[i] * imag[q, i]
                result[q, n, p] = complex(re, im)
            for i in range(count):
                t = last[i]
                last[i] = 2.0 * x[i] * t - before[i] if p else x[i]
                before[i] = t


@LOOPS
def turned(whole, cells, half_steps, total):
    """Phase factor of a delay by `whole` + `cells` range cells, `half_steps` halves of a subcarrier off the middle.

    Whole cells turn by multiples of pi / M, which are reduced in whole numbers.
    """
    index = whole % (2 * total) * half_steps % (2 * total)
    angle = math.pi * (cells * half_steps + index) / total
    return complex(math.cos(angle), -math.sin(angle))


@LOOPS
def spread(sums, own, whole, cells, table, weights, result):
    """Add own[n] sum_q weights[q, m] sum_p (-j)^p sums[q, n, p] table[p, m], delayed, to result (N, M).

    sums: (Q, N, P); table: (P, M) real; weights: (Q, M); the delay about the middle subcarrier is `whole` (N,) int64
    plus `cells` (N,) range cells.
    """
    nodes, symbols, orders = sums.shape
    total = table.shape[1]
    re, im, node_re, node_im = np.empty(total), np.empty(total), np.empty(total), np.empty(total)
    ramp_re, ramp_im = np.empty(STRIDE), np.empty(STRIDE)
    for n in range(symbols):
        if not sums[:, n].any():
            continue
        re[:] = 0.0
        im[:] = 0.0
        for q in range(nodes):
            node_re[:] = 0.0
            node_im[:] = 0.0
            for p in range(orders):
                value = sums[q, n, p] * QUARTERS[p % 4]
                a, b = value.real, value.imag
                for m in range(total):
                    node_re[m] += a * table[p, m]
                    node_im[m] += b * table[p, m]
            for m in range(total):
                re[m] += node_re[m] * weights[q, m]
                im[m] += node_im[m] * weights[q, m]
        step, wide = turned(whole[n], cells[n], 2, total), turned(whole[n], cells[n], 2 * STRIDE, total)
        phase = 1.0 + 0.0j
        for k in range(STRIDE):
            ramp_re[k], ramp_im[k] = phase.real, phase.imag
            phase *= step
        phase = own[n] * turned(whole[n], cells[n], 1 - total, total)
        for first in range(0, total, STRIDE):
            a, b = phase.real, phase.imag
            for k in range(min(STRIDE, total - first)):
                x, y = re[first + k], im[first + k]
                c, d = a * x - b * y, a * y + b * x
                result[n, first + k] += complex(c * ramp_re[k] - d * ramp_im[k], c * ramp_im[k] + d * ramp_re[k])
            phase *= wide
