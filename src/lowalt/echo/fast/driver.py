"""The fast kernel's driver: segments of symbols, tiles of points, certified strongest cells.

All smooth factors are the plan's polynomials; `lanes` holds the loops. Everything here is compiled without counted
references (they took a quarter of the time). So nothing here may allocate; rooms come in as arguments.
"""

import math

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.echo.fast import vector_loops
from lowalt.echo.fast.cell_kernel import PLACES, SIDE
from lowalt.echo.fast.polynomials import TOP
from lowalt.echo.fast.range_bounds import SIZE, SPREAD
from lowalt.echo.fast.segment import constants, fill_tile, fit_gains
from lowalt.echo.fast.strongest_cell import AGAIN, FINE, certify
from lowalt.echo.pointwise.terms import cell_phase


@LEAN
def add_moments(real, imag, cells, size, block, orders, moments):
    """Add the tile's moments of all orders (a multiple of four) to moments (2, orders), `block` points at a time."""
    for at in range(0, size, block):
        many = min(block, size - at)
        for order in range(0, orders, 4):
            a0, a1, a2, a3, b0, b1, b2, b3 = vector_loops.moments(real, imag, cells, at, many)
            moments[0, order] += a0
            moments[0, order + 1] += a1
            moments[0, order + 2] += a2
            moments[0, order + 3] += a3
            moments[1, order] += b0
            moments[1, order + 1] += b1
            moments[1, order + 2] += b2
            moments[1, order + 3] += b3


@LEAN
def sum_points(
    rotation, translation, lx, ly, lz, parts, starts, q, sine, cosine, r, n, m, k, near, excess, inverse, typed,
    degrees, waves, work, small, chunk, block, orders, moments,
):  # fmt: skip
    """Put symbol n's moments, relative to the points' shares, into moments (2, orders); returns sums of |z|, |z| v^2.

    k, m: `segment.constants`; typed, degrees: the gains' polynomials; waves: those of cosine and sine; else as `run`.
    """
    eps, ey, ez = work
    psi, omega, place, turn, square, gain_h, gain_v, real, imag, amplitude = small
    wave_c, wave_s = waves
    padded = len(amplitude)
    for order in range(orders):
        moments[0, order], moments[1, order] = 0.0, 0.0
    total, second = 0.0, 0.0
    for point in range(0, padded, chunk):
        size = min(chunk, padded - point)
        fill_tile(
            rotation, translation, lx, ly, lz, parts, starts, q, sine, cosine, r, n, point, size, m, eps, ey, ez
        )  # fmt: skip
        if near:
            vector_loops.near_geometry(eps, ey, ez, k, excess, inverse, size, psi, omega, place, turn, square)
        else:
            vector_loops.geometry(eps, ey, ez, k, size, psi, omega, place, turn, square)
        vector_loops.horner(psi, typed, 0, degrees[0], gain_h, size)
        vector_loops.horner(omega, typed, 1, degrees[1], gain_v, size)
        if len(wave_c) == 6:
            a, b = vector_loops.waves_5(
                turn, gain_h, gain_v, square, amplitude, point, place, wave_c, wave_s, size, real, imag
            )
        elif len(wave_c) == 8:
            a, b = vector_loops.waves_7(
                turn, gain_h, gain_v, square, amplitude, point, place, wave_c, wave_s, size, real, imag
            )
        else:
            a, b = vector_loops.waves_10(
                turn, gain_h, gain_v, square, amplitude, point, place, wave_c, wave_s, size, real, imag
            )
        total += a
        second += b
        add_moments(real, imag, place, size, block, orders, moments)
    return total, second


@LEAN
def rounding_of(unit, block, padded, orders):
    """What a moment's roundings come to: of order k, 3 k + 1 of a power and its argument, the product's, the sums'."""
    return unit * (min(block, vector_loops.chunk_of(padded)) + 3 * orders + 4 + padded / 2**20)


@LEAN
def run(
    scene, lay, radar, q, refs, span, segs, symbols, aims, rules, table, fits, fold, plan, slow, rooms, work, small, out
):
    """Compute the symbols of all segments.

    q: part (or point, without rotations) whose translation is the reference; symbols: indices that refs, span, segs
    and slow are cut from; table: `cells.Cells` as a tuple; fits: polynomials of the range over eps, of 1 / r (float64),
    cosine and sine (the tile's type); plan: error of the segments' fits, bound relative to the sum of amplitudes and to
    the sum of peak amplitudes, rounding of the tile's type, most points summed in it, 1 where ranges are polynomials, 1
    where close calls are final; slow: `interpolate.Slow` of other points, or none; rooms, work, small: see
    `rooms_for`; out: values, cells, state, totals, bounds, ties, gaps, each (N,).
    """
    excess, inverse, cosine, sine = fits
    kernels, sines, half, error, sizes = table
    values, cells, state, totals, bounds, ties, gaps = out
    slow_moments, slow_sums, slow_errors = slow
    room, m, k, moments, coefficients, typed, sums, far = rooms
    fit, share, peak, unit, block, near, final = plan
    psi0, omega0 = aims
    padded = len(small[9])
    chunk, orders = vector_loops.chunk_of(padded), kernels.shape[2]
    rounding = rounding_of(unit, block, padded, orders)
    for index in range(len(segs)):
        start, end = int(segs[index, 0]), int(segs[index, 1])
        degree_h, degree_v, gains = fit_gains(segs, index, aims, rules, fit, unit, fold, room, coefficients, typed)
        if degree_h < 0 or degree_v < 0:
            for i in range(start, end):
                state[symbols[i]] = AGAIN
            continue
        for i in range(start, end):
            n, r = symbols[i], refs[i, 3]
            cell = int(np.rint((refs[i, 6] + 0.5) * PLACES))
            cell = max(0, min(cell, PLACES))
            centre = cell / PLACES - 0.5
            constants(radar, refs, i, segs, index, psi0, omega0, centre, half, k, m)
            total, second = sum_points(
                scene.rotation, scene.translation, lay.x, lay.y, lay.z, lay.parts, lay.starts, q, radar.sine,
                radar.cosine, r, n, m, k, near, excess, inverse, typed, (degree_h, degree_v), (cosine, sine), work,
                small, chunk, block, orders, moments,
            )  # fmt: skip
            # Amplitudes were relative to their sum, so that float32 neither overflows nor vanishes.
            scale = lay.total / (r * r)
            for order in range(orders):
                moments[0, order] *= scale
                moments[1, order] *= scale
            total *= scale * (1.0 + unit * (chunk + 20))
            second *= scale * (1.0 + unit * (chunk + 24))
            peaks = scale / (1.0 - span[i, SPREAD]) ** 2
            summed = rounding * (sizes[0] * total + sizes[1] * math.sqrt(total * second) + sizes[2] * second)
            bound = total * (share + error) + summed + peaks * (peak + gains)
            if len(slow_moments):
                away = (refs[i, 6] - centre) / half
                add_slow(slow_moments, i, refs[i, 4], away, 1.0 / (r * r), orders, moments)
                more = slow_sums[i, 0] / (r * r)
                bound += slow_errors[i] / (r * r) + more * error
                second += slow_sums[i, 1] / (r * r)
                second += abs(away) * (2.0 * math.sqrt(more * slow_sums[i, 1] / (r * r)) + abs(away) * more)
                total += more
            totals[n], bounds[n] = total, bound
            fate, which, tie, lead = certify(
                kernels, sines, cell, centre, moments, span[i, SIZE] * radar.cells, half, (total, second),
                error + 4.0 * rounding * (sizes[0] + sizes[1] + sizes[2]), bound, radar.subcarriers, sums, far,
            )  # fmt: skip
            if lead <= 0.0 and final == 0.0:
                fate = AGAIN
            state[n] = fate
            if fate == FINE:
                whole = int(refs[i, 5]) + which - SIDE
                values[n] = complex(sums[which, 0], sums[which, 1]) * cell_phase(whole, radar.subcarriers)
                cells[n], ties[n], gaps[n] = whole % radar.subcarriers, tie, max(lead, 0.0)


@LEAN
def add_slow(slow, i, turn, away, scale, orders, moments):
    """Add symbol i's interpolated moments (N, 2, orders): turned by the reference's phase, taken `away` further on.

    Sums of z (v + a)^k are binomial sums of those of z v^k, here by differences as in Pascal's triangle. slow[i] is
    overwritten.
    """
    for low in range(1, orders):
        for order in range(orders - 1, low - 1, -1):
            slow[i, 0, order] += away * slow[i, 0, order - 1]
            slow[i, 1, order] += away * slow[i, 1, order - 1]
    c, s = scale * math.cos(2.0 * math.pi * turn), -scale * math.sin(2.0 * math.pi * turn)
    for order in range(orders):
        re, im = slow[i, 0, order], slow[i, 1, order]
        moments[0, order] += c * re - s * im
        moments[1, order] += c * im + s * re


@LEAN
def moments_at(scene, lay, radar, q, refs, span, segs, aims, rules, table, fits, fold, plan, rooms, work, small, out):
    """Moments of all points at every symbol, about the reference's range and without its phase, times r^2.

    Arguments as `run`, columns 4 to 6 of refs zero. out: moments (N, 2, orders), sums of |z| and of |z| v^2 (N, 2),
    bounds of the moments' errors as the cell kernels see them (N,). Returns False where the gains need long
    polynomials.
    """
    excess, inverse, cosine, sine = fits
    kernels, _, half, _, sizes = table
    found, strengths, errors = out
    room, m, k, moments, coefficients, typed, _, _ = rooms
    fit, share, peak, unit, block, near, _ = plan
    psi0, omega0 = aims
    padded = len(small[9])
    chunk, orders = vector_loops.chunk_of(padded), kernels.shape[2]
    rounding = rounding_of(unit, block, padded, orders)
    for index in range(len(segs)):
        start, end = int(segs[index, 0]), int(segs[index, 1])
        degree_h, degree_v, gains = fit_gains(segs, index, aims, rules, fit, unit, fold, room, coefficients, typed)
        if degree_h < 0 or degree_v < 0:
            return False
        for i in range(start, end):
            constants(radar, refs, i, segs, index, psi0, omega0, 0.0, half, k, m)
            total, second = sum_points(
                scene.rotation, scene.translation, lay.x, lay.y, lay.z, lay.parts, lay.starts, q, radar.sine,
                radar.cosine, refs[i, 3], i, m, k, near, excess, inverse, typed, (degree_h, degree_v), (cosine, sine),
                work, small, chunk, block, orders, moments,
            )  # fmt: skip
            for order in range(orders):
                found[i, 0, order] = moments[0, order] * lay.total
                found[i, 1, order] = moments[1, order] * lay.total
            total *= lay.total * (1.0 + unit * (chunk + 20))
            second *= lay.total * (1.0 + unit * (chunk + 24))
            strengths[i, 0], strengths[i, 1] = total, second
            peaks = lay.total / (1.0 - span[i, SPREAD]) ** 2
            errors[i] = total * share + peaks * (peak + gains)
            errors[i] += rounding * (sizes[0] * total + sizes[1] * math.sqrt(total * second) + sizes[2] * second)
    return True


def rooms_for(rates: int, orders: int, amplitude: np.ndarray, single: bool):
    """Work arrays of `run`: (rooms, work in float64, small in the tile's type).

    The tile's arrays are separate and of odd length: as rows of one array a whole 4096 bytes apart, loads would wait
    for unrelated stores.
    """
    kind = np.float32 if single else np.float64
    rooms = (
        np.empty((3, rates)), np.empty(19), np.empty(8), np.empty((2, orders)), np.empty((2, TOP + 1)),
        np.empty((2, TOP + 1), kind), np.empty((2 * SIDE + 1, 2)), np.empty(4),
    )  # fmt: skip
    small = tuple(np.empty(vector_loops.ROW, kind) for _ in range(9))
    total = amplitude.sum()
    shares = (amplitude / total if total > 0 else amplitude).astype(kind)
    return rooms, tuple(np.empty(vector_loops.ROW) for _ in range(3)), (*small, shares)
