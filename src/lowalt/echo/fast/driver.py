"""Driver of the fast kernel: it loops over segments and strips, and proves the strongest cells.

All smooth factors are evaluated as the plan's polynomials, in the loops of `vector_loops`. The code
is compiled without reference counting, which took a quarter of the time, so nothing here may
allocate: see `workspace`.
"""

import math

import numpy as np

from lowalt.echo.fast import vector_loops
from lowalt.echo.fast.cell_kernel import POSITIONS, SIDE
from lowalt.echo.fast.error_model import SINGLE_BLOCK
from lowalt.echo.fast.range_bounds import END, MEAN, SIZE, SPREAD, START
from lowalt.echo.fast.segment import constants, fill_offsets, fit_gains
from lowalt.echo.fast.strip import STRIP, strip_size
from lowalt.echo.fast.strongest_cell import CERTAIN, UNCERTAIN, certify
from lowalt.echo.pointwise.reference_range import CELL, RANGE, REST
from lowalt.echo.pointwise.terms import cell_phase
from lowalt.machine.jit import INLINED, LEAN


@INLINED
def add_moments(strip, size, block, moments):
    """Add the strip's moments to moments (2, orders), `block` points at a time.

    orders: a multiple of four.
    """
    for at in range(0, size, block):
        many = min(block, size - at)
        for order in range(0, moments.shape[1], 4):
            a0, a1, a2, a3, b0, b1, b2, b3 = vector_loops.moments(strip, at, many)
            moments[0, order] += a0
            moments[0, order + 1] += a1
            moments[0, order + 2] += a2
            moments[0, order + 3] += a3
            moments[1, order] += b0
            moments[1, order + 1] += b1
            moments[1, order + 2] += b2
            moments[1, order + 3] += b3


@INLINED
def add_amplitudes(strip, share, point, plan, size):
    """Fill the strip's amplitudes by polynomials of the plan's degree.

    Returns sums of |z| and of |z| v^2.
    """
    c = plan.cosine
    s = plan.sine
    if len(c) == 6:
        return vector_loops.amplitudes(
            strip,
            share,
            point,
            (c[0], c[1], c[2], c[3], c[4], c[5]),
            (s[0], s[1], s[2], s[3], s[4], s[5]),
            size,
        )
    if len(c) == 8:
        return vector_loops.amplitudes(
            strip,
            share,
            point,
            (c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7]),
            (s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7]),
            size,
        )
    return vector_loops.amplitudes(
        strip,
        share,
        point,
        (c[0], c[1], c[2], c[3], c[4], c[5], c[6], c[7], c[8], c[9], c[10]),
        (s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10]),
        size,
    )


@INLINED
def sum_points(sample, n, r, constants, degrees, plan, block, work):
    """Fill work.moments with symbol n's moments, all divided by lay.total / r^2.

    Returns the sums of |z| and of |z| v^2, divided alike.

    r: the reference's range (m); constants: of `segment.constants`; degrees: of the gains'
    polynomials; block: most points added in the strip's type.
    """
    geometry, placing = constants
    strip = work.strip
    offsets = work.offsets
    padded = len(work.share)
    length = strip_size(padded)
    for order in range(work.moments.shape[1]):
        work.moments[0, order] = 0.0
        work.moments[1, order] = 0.0
    total = 0.0
    second = 0.0
    for point in range(0, padded, length):
        size = min(length, padded - point)
        fill_offsets(sample, n, r, point, size, placing, offsets)
        vector_loops.geometry(offsets, geometry, size, strip)
        vector_loops.horner(strip.psi, work.typed, np.int64(0), degrees[0], strip.gain_h, size)
        vector_loops.horner(strip.omega, work.typed, np.int64(1), degrees[1], strip.gain_v, size)
        a, b = add_amplitudes(strip, work.share, point, plan, size)
        total += a
        second += b
        add_moments(strip, size, block, work.moments)
    return total, second


@INLINED
def precision(plan, padded, orders):
    """Return (unit rounding, block, relative rounding of a moment) of the strip's type.

    The block is the largest number of points added in that type.

    A moment of order k takes 3 k + 1 roundings of a power and its argument, one of the product, and
    those of the sums.
    """
    unit = 2.0**-53
    block = STRIP
    if plan.single:
        unit = 2.0**-24
        block = SINGLE_BLOCK
    roundings = min(block, strip_size(padded)) + 3 * orders + 4 + padded / 2**20
    return unit, block, unit * roundings


@LEAN
def run(sample, symbols, approximation, final, work, found):
    """Compute the symbols into `found`.

    sample: `layout.EchoSample`; symbols, approximation, work, found: the bundles of `workspace`;
    final: accept a strongest cell without proof, because there is no more precise plan.
    """
    plan = approximation.plan
    table = approximation.cells
    radar = sample.radar
    orders = table.kernels.shape[2]
    half = table.half
    sizes = table.sizes
    padded = len(work.share)
    unit, block, rounding = precision(plan, padded, orders)
    length = strip_size(padded)
    refs = symbols.refs
    extents = symbols.extents
    moments = work.moments
    for index in range(len(symbols.segments)):
        segment = symbols.segments[index]
        start = int(segment[START])
        end = int(segment[END])
        degree_h, degree_v, gains = fit_gains(
            segment, sample.aims, approximation.gains, plan.fit, unit, approximation.fold, work
        )
        if degree_h < 0 or degree_v < 0:
            for i in range(start, end):
                found.state[symbols.index[i]] = UNCERTAIN
            continue
        for i in range(start, end):
            n = symbols.index[i]
            r = refs[i, RANGE]
            nearest = int(np.rint((refs[i, REST] + 0.5) * POSITIONS))
            position = max(0, min(nearest, POSITIONS))
            fixed = constants(sample, refs[i], segment, position / POSITIONS - 0.5, half)
            degrees = (degree_h, degree_v)
            total, second = sum_points(sample, n, r, fixed, degrees, plan, block, work)
            # Undo the division by the sum of amplitudes, which keeps float32 from overflow and
            # underflow.
            scale = sample.lay.total / (r * r)
            for order in range(orders):
                moments[0, order] *= scale
                moments[1, order] *= scale
            total *= scale * (1.0 + unit * (length + 20))
            second *= scale * (1.0 + unit * (length + 24))
            peaks = scale / (1.0 - extents[i, SPREAD]) ** 2
            # `total` sums approximate amplitudes; add their error to bound the sum of the true
            # ones.
            total += total * plan.share + peaks * (plan.peak + gains)
            summed = rounding * (
                sizes[0] * total + sizes[1] * math.sqrt(total * second) + sizes[2] * second
            )
            bound = total * (plan.share + table.error) + summed + peaks * (plan.peak + gains)
            bound += plan.phase * min(total * extents[i, SIZE], peaks * extents[i, MEAN])
            found.totals[n] = total
            found.bounds[n] = bound
            state, row, tie, lead = certify(
                table,
                position,
                extents[i, SIZE] * radar.cells,
                (total, second),
                table.error + 4.0 * rounding * (sizes[0] + sizes[1] + sizes[2]),
                bound,
                radar.subcarriers,
                work,
            )
            if lead <= 0.0 and not final:
                state = UNCERTAIN
            found.state[n] = state
            if state == CERTAIN:
                cell = int(refs[i, CELL]) + row - SIDE
                keep(found, n, cell, work.sums[row], radar.subcarriers, tie, lead)


@INLINED
def keep(found, n, cell, value, subcarriers, tie, lead):
    """Write symbol n's strongest cell into `found`.

    cell: its number before reduction modulo M; value: its real and imaginary part before the cell's
    phase factor; tie, lead: as returned by `strongest_cell.certify`.
    """
    found.values[n] = complex(value[0], value[1]) * cell_phase(cell, subcarriers)
    found.cells[n] = cell % subcarriers
    found.ties[n] = tie
    found.gaps[n] = max(lead, 0.0)
