"""One range cell of one symbol in double-double: the paper's sum over all points.

The error is 2^-64 of the terms.

The loops are compiled without fast-math flags. Vector instructions of any width give equal results,
because only the last loop sums over points, in a fixed order.
"""

import numpy as np

from lowalt.echo.radar import constants
from lowalt.machine.jit import INLINED, INNER, LEAN
from lowalt.numerics.exact.arithmetic import add, divide, multiply, product, root, subtract, two_sum
from lowalt.numerics.exact.sines import dirichlet, sine_cosine

constants_of = INLINED(constants)

X, Y, Z, SIDE, UP, TURN, CELL, AMPLITUDE = range(0, 16, 2)
"""Rows of the work array (16, points), the low half in the row that follows.

They are the vector from the station (m), half turns of array phase per element, horizontally and
vertically, turns of phase, distance from the cell over M, and amplitude.
"""
ROWS = 16


@INNER
def vectors(sample, n, work):
    """Fill rows X, Y, Z with the vectors from the station to all points at symbol n.

    The padding stands at one metre.
    """
    scene = sample.scene
    station = sample.radar.station
    groups = sample.lay.groups
    x, y, z = sample.lay.coordinates
    for i in range(work.shape[1]):
        for row in range(SIDE):
            work[row, i] = 0.0
        work[X, i] = 1.0
    if scene.rotation.shape[0] == 0:
        for i in range(scene.translation.shape[1]):
            for axis in range(3):
                at = two_sum(scene.translation[n, i, axis], -station[axis])
                work[2 * axis, i], work[2 * axis + 1, i] = at
        return
    for group in range(len(groups.parts)):
        p = groups.parts[group]
        low = np.uint64(groups.starts[group])
        high = np.uint64(groups.starts[group + 1])
        for axis in range(3):
            a = scene.rotation[n, p, axis, 0]
            b = scene.rotation[n, p, axis, 1]
            c = scene.rotation[n, p, axis, 2]
            origin = two_sum(scene.translation[n, p, axis], -station[axis])
            row = np.uint64(2 * axis)
            below = np.uint64(2 * axis + 1)
            # Write full vectors of four. The next group overwrites the surplus, and the padding has
            # zero amplitude.
            for i in range(low, low + (high - low + np.uint64(3)) // np.uint64(4) * np.uint64(4)):
                at = add(add(product(a, x[i]), product(b, y[i])), product(c, z[i]))
                work[row, i], work[below, i] = add(at, origin)


@INLINED
def cosines(x, y, z, constants):
    """Return (range, its inverse, horizontal and vertical direction cosine).

    They are those of a vector from the station (m).
    """
    r = root(add(add(multiply(x, x), multiply(y, y)), multiply(z, z)))
    inverse = divide((1.0, 0.0), r)
    across = subtract(multiply(constants.cosine, y), multiply(constants.sine, x))
    return r, inverse, multiply(across, inverse), multiply(z, inverse)


@INNER
def geometry(work, root_rcs, rcs_m2, constants, aims, cell, count):
    """Fill rows SIDE to AMPLITUDE from X, Y, Z; aims: the beams' direction cosines; cell, count:
    whole doubles.
    """
    for i in range(np.uint64(len(root_rcs))):
        x = (work[X, i], work[X + 1, i])
        y = (work[Y, i], work[Y + 1, i])
        z = (work[Z, i], work[Z + 1, i])
        r, inverse, psi, omega = cosines(x, y, z, constants)
        psi = subtract(psi, aims[0])
        omega = subtract(omega, aims[1])
        work[SIDE, i], work[SIDE + 1, i] = multiply(constants.half_kappa, psi)
        work[UP, i], work[UP + 1, i] = multiply(constants.half_kappa, omega)
        turn = add(multiply(constants.phase_h, psi), multiply(constants.phase_v, omega))
        work[TURN, i], work[TURN + 1, i] = subtract(turn, multiply(constants.turns, r))
        away = subtract((cell, 0.0), multiply(constants.cells, r))
        work[CELL, i], work[CELL + 1, i] = divide(away, (count, 0.0))
        high = root_rcs[i]
        p, e = product(high, high)
        divisor = 1.0
        if high > 0.0:
            divisor = 2.0 * high
        low = ((rcs_m2[i] - p) - e) / divisor
        amplitude = multiply((high, low), multiply(inverse, inverse))
        work[AMPLITUDE, i], work[AMPLITUDE + 1, i] = amplitude


@INLINED
def patterns(radar):
    """Return the five Dirichlet kernels that a point's amplitude is multiplied by.

    Each is (row, elements, squared).

    They are the patterns of both arrays, horizontal and vertical, and of the subcarriers; row: that
    of the half turns in the work array; squared: where both arrays are alike, one kernel is squared
    and the other one has one element, which makes it 1.
    """
    like_h = radar.transmit_h == radar.receive_h
    like_v = radar.transmit_v == radar.receive_v
    other_h = float(radar.receive_h)
    other_v = float(radar.receive_v)
    if like_h:
        other_h = 1.0
    if like_v:
        other_v = 1.0
    return (
        (SIDE, float(radar.transmit_h), like_h),
        (SIDE, other_h, False),
        (UP, float(radar.transmit_v), like_v),
        (UP, other_v, False),
        (CELL, float(radar.subcarriers), False),
    )


@INNER
def times_dirichlet(work, row, count, twice, points):
    """Multiply the amplitudes by U_{count-1} of a row's half turns, or by its square."""
    below = np.uint64(row + 1)
    row = np.uint64(row)
    for i in range(np.uint64(points)):
        u = dirichlet((work[row, i], work[below, i]), count)
        if twice:
            u = multiply(u, u)
        amplitude = (work[AMPLITUDE, i], work[AMPLITUDE + 1, i])
        work[AMPLITUDE, i], work[AMPLITUDE + 1, i] = multiply(amplitude, u)


@INNER
def wave(work, points):
    """Replace rows TURN and CELL by the real and imaginary parts of all points."""
    for i in range(np.uint64(points)):
        s, c = sine_cosine((work[TURN, i], work[TURN + 1, i]))
        a = (work[AMPLITUDE, i], work[AMPLITUDE + 1, i])
        work[TURN, i], work[TURN + 1, i] = multiply(a, c)
        work[CELL, i], work[CELL + 1, i] = multiply(a, s)


@INLINED
def phase_of(cell, count):
    """Return sine and cosine of a cell's own phase, exp(j pi (M - 1) m / M).

    The phase is reduced in whole numbers.
    """
    half_turns = float((count - 1) * cell % (2 * count))
    return sine_cosine(divide((half_turns, 0.0), (2.0 * count, 0.0)))


@LEAN
def cell_value(sample, n, cell, work):
    """Return the real and imaginary part, double-doubles, of range cell `cell` at symbol n.

    sample: `layout.EchoSample`, of whose radar whole numbers, the station's position and the
    double-doubles are used; work (ROWS, padded L + 4): work array. No point may stand in the
    station.
    """
    scene = sample.scene
    lay = sample.lay
    radar = sample.radar
    x = two_sum(scene.aim[0], -radar.station[0])
    y = two_sum(scene.aim[1], -radar.station[1])
    z = two_sum(scene.aim[2], -radar.station[2])
    exact = constants_of(radar.exact)
    points = len(lay.root)
    _, _, psi0, omega0 = cosines(x, y, z, exact)
    vectors(sample, n, work)
    geometry(work, lay.root, lay.rcs, exact, (psi0, omega0), float(cell), float(radar.subcarriers))
    for row, elements, squared in patterns(radar):
        if elements > 1.0:
            times_dirichlet(work, row, elements, squared, points)
    wave(work, points)
    real = (0.0, 0.0)
    imag = (0.0, 0.0)
    for i in range(points):
        real = add(real, (work[TURN, i], work[TURN + 1, i]))
        imag = add(imag, (work[CELL, i], work[CELL + 1, i]))
    factor = divide(exact.scale, (float(radar.subcarriers), 0.0))
    real = multiply(real, factor)
    imag = multiply(imag, factor)
    s, c = phase_of(cell, radar.subcarriers)
    return subtract(multiply(real, c), multiply(imag, s)), add(multiply(real, s), multiply(imag, c))
