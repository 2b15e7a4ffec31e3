"""The inputs of one symbol: its segment's gain polynomials, its constants and its points.

A segment is a run of successive symbols that share polynomials for the array gains
(`range_bounds`).
"""

import numpy as np

from lowalt.echo.fast import vector_loops
from lowalt.echo.fast.polynomials import TOP, degree_for, economised, tail
from lowalt.echo.fast.range_bounds import OMEGA_CENTRE, OMEGA_HALF, PSI_CENTRE, PSI_HALF
from lowalt.echo.fast.strip import Geometry, Placing
from lowalt.echo.pointwise.reference_range import RANGE, REST, TURN, X, Y, Z
from lowalt.machine.jit import INLINED


@INLINED
def fit_gain(gain, centre, half, error, unit, fold, work, row):
    """Fit a gain on centre +- half to `error` into a row of `work`.

    Returns (degree, error bound with roundings).

    The degree is -1 where the polynomial would be too long. unit: the rounding of the type it is
    evaluated in. Order k rounds its argument, its coefficient, its products and sums: at most 3 k +
    3 roundings of |c_k|.
    """
    band = gain.rates[0] * half
    degree = degree_for(band, error)
    if degree > TOP:
        return -1, 0.0
    economised(gain, centre, half, degree, fold, work.taylor, work.coefficients[row])
    rounding = 0.0
    for k in range(degree + 1):
        work.typed[row, k] = work.coefficients[row, k]
        rounding += (3 * k + 3) * abs(work.coefficients[row, k])
    return degree, tail(band, degree) + rounding * unit


@INLINED
def fit_gains(segment, aims, gains, error, unit, fold, work):
    """Fit a segment's horizontal and vertical gain.

    Returns their degrees, and a bound of the error of their product.

    segment: row of the table of segments; aims: the beams' direction cosines; gains: `ArrayGains`;
    else as `fit_gain`.
    """
    centre_h = segment[PSI_CENTRE] - aims[0]
    centre_v = segment[OMEGA_CENTRE] - aims[1]
    degree_h, bound_h = fit_gain(
        gains.horizontal, centre_h, segment[PSI_HALF], error, unit, fold, work, np.int64(0)
    )
    degree_v, bound_v = fit_gain(
        gains.vertical, centre_v, segment[OMEGA_HALF], error, unit, fold, work, np.int64(1)
    )
    return degree_h, degree_v, bound_h + bound_v + bound_h * bound_v


@INLINED
def constants(sample, ref, segment, centre, half):
    """Return a symbol's `Geometry` and `Placing`.

    ref, segment: rows of their tables; centre, half: the range in cells, from the symbol's nearest
    whole cell, that the cell kernel is expanded about, and the range at |v| = 1.
    """
    radar = sample.radar
    aims = sample.aims
    r = ref[RANGE]
    hx = (radar.cosine * ref[X] + radar.sine * ref[Y]) / r
    hy = (radar.cosine * ref[Y] - radar.sine * ref[X]) / r
    hz = ref[Z] / r
    phase_h = radar.kappa / 4.0 * (radar.transmit_h + radar.receive_h - 2)
    phase_v = radar.kappa / 4.0 * (radar.transmit_v + radar.receive_v - 2)
    fixed = (
        phase_h * (segment[PSI_CENTRE] - aims[0])
        + phase_v * (segment[OMEGA_CENTRE] - aims[1])
        - ref[TURN]
    )
    geometry = Geometry(
        segment[PSI_CENTRE] / segment[PSI_HALF],
        segment[OMEGA_CENTRE] / segment[OMEGA_HALF],
        r * radar.cells / half,
        (ref[REST] - centre) / half,
        -r * radar.turns,
        phase_h * segment[PSI_HALF],
        phase_v * segment[OMEGA_HALF],
        fixed - np.rint(fixed),
    )
    placing = Placing(
        2.0 * hx,
        2.0 * hy,
        2.0 * hz,
        1.0 / segment[PSI_HALF],
        hy / segment[PSI_HALF],
        1.0 / segment[OMEGA_HALF],
        hz / segment[OMEGA_HALF],
    )
    return geometry, placing


@INLINED
def fill_offsets(sample, n, r, first, size, placing, offsets):
    """Fill the offsets with points first..first + size of symbol n.

    Offsets are relative to the reference and over r_ref = r.
    """
    rotation = sample.scene.rotation
    translation = sample.scene.translation
    q = sample.first
    groups = sample.lay.groups
    cosine = sample.radar.cosine
    sine = sample.radar.sine
    scale = 1.0 / r
    x0 = translation[n, q, 0]
    y0 = translation[n, q, 1]
    z0 = translation[n, q, 2]
    if rotation.shape[0] == 0:
        end = min(first + size, translation.shape[1])
        vector_loops.place_nodes(
            translation, n, q, first, end - first, (cosine, sine, scale), placing, offsets
        )
    else:
        end = min(first + size, groups.starts[len(groups.parts)])
        # Unsigned indices, as in `vector_loops`: signed ones would be tested for negative values at
        # every access.
        at = np.uint64(n)
        none = np.uint64(0)
        one = np.uint64(1)
        two = np.uint64(2)
        for group in range(len(groups.parts)):
            low = groups.starts[group]
            high = groups.starts[group + 1]
            if low < first or low >= end:
                continue
            p = np.uint64(groups.parts[group])
            a = rotation[at, p, none, none]
            b = rotation[at, p, one, none]
            c = rotation[at, p, two, none]
            d = rotation[at, p, none, one]
            e = rotation[at, p, one, one]
            f = rotation[at, p, two, one]
            g = rotation[at, p, none, two]
            h = rotation[at, p, one, two]
            k = rotation[at, p, two, two]
            x = translation[at, p, none] - x0
            y = translation[at, p, one] - y0
            z = translation[at, p, two] - z0
            pose = (
                (
                    (cosine * a + sine * b) * scale,
                    (cosine * d + sine * e) * scale,
                    (cosine * g + sine * h) * scale,
                ),
                (
                    (cosine * b - sine * a) * scale,
                    (cosine * e - sine * d) * scale,
                    (cosine * h - sine * g) * scale,
                ),
                (c * scale, f * scale, k * scale),
                (
                    (cosine * x + sine * y) * scale,
                    (cosine * y - sine * x) * scale,
                    z * scale,
                ),
            )
            vector_loops.place_part(
                sample.lay.coordinates, low, high - low, pose, placing, offsets, low - first
            )
    for i in range(end - first, size):
        offsets.eps[i] = 0.0
        offsets.y[i] = 0.0
        offsets.z[i] = 0.0
