"""Bounds of the points' positions at every symbol, from the poses of the parts alone."""

import math

import numpy as np

from lowalt.echo.pointwise.reference_range import RANGE, X, Y, Z
from lowalt.machine.jit import LEAN

PSI, OMEGA, SPREAD, SIZE, MEAN = range(5)
"""Columns of the table of extents.

They are two direction cosines of the reference; the largest distance of a point from the reference,
relative to the range and in metres; and a bound of the amplitude-weighted mean distance (m).
"""
START, END, PSI_CENTRE, PSI_HALF, OMEGA_CENTRE, OMEGA_HALF = range(6)
"""Columns of the table of segments.

They are the first symbol, the end, and centre and half-width of the points' direction cosines.
"""
DRIFT = 1.0
WIDER = 1.2
"""Radians of gain phase, and factor, by which a segment may be wider than the target."""


@LEAN
def fill_extents(sample, refs, out):
    """Fill the table of extents out (N, 5) of an `EchoSample` and return its largest SPREAD.

    Each point of a group is at most radius x norm away from the group's moved centre, where `norm`
    bounds the norm of the part's matrix.
    """
    rotation = sample.scene.rotation
    translation = sample.scene.translation
    first = sample.first
    radar = sample.radar
    groups = sample.lay.groups
    parts = groups.parts
    centres = groups.centres
    radii = groups.radii
    worst = 0.0
    for n in range(len(refs)):
        r = refs[n, RANGE]
        size = 0.0
        mean = 0.0
        if rotation.shape[0] == 0:
            for p in range(translation.shape[1]):
                x = translation[n, p, 0] - translation[n, first, 0]
                y = translation[n, p, 1] - translation[n, first, 1]
                z = translation[n, p, 2] - translation[n, first, 2]
                away = math.sqrt(x * x + y * y + z * z)
                size = max(size, away)
                mean = mean + groups.weights[p] * away
        else:
            for group in range(len(parts)):
                p = parts[group]
                x = translation[n, p, 0] - translation[n, first, 0]
                y = translation[n, p, 1] - translation[n, first, 1]
                z = translation[n, p, 2] - translation[n, first, 2]
                a = centres[group, 0]
                b = centres[group, 1]
                c = centres[group, 2]
                x += rotation[n, p, 0, 0] * a + rotation[n, p, 0, 1] * b + rotation[n, p, 0, 2] * c
                y += rotation[n, p, 1, 0] * a + rotation[n, p, 1, 1] * b + rotation[n, p, 1, 2] * c
                z += rotation[n, p, 2, 0] * a + rotation[n, p, 2, 1] * b + rotation[n, p, 2, 2] * c
                bound = 0.0
                if radii[group] > 0.0:
                    bound = norm(rotation, n, p)
                away = math.sqrt(x * x + y * y + z * z)
                size = max(size, away + bound * radii[group])
                mean += groups.weights[group] * away + bound * groups.strays[group]
        size *= 1.0 + 1e-12
        out[n, PSI] = 0.0
        out[n, OMEGA] = 0.0
        out[n, SPREAD] = np.inf
        if r > 0.0:
            out[n, PSI] = (radar.cosine * refs[n, Y] - radar.sine * refs[n, X]) / r
            out[n, OMEGA] = refs[n, Z] / r
            out[n, SPREAD] = size / r
        out[n, SIZE] = size
        out[n, MEAN] = mean * (1.0 + 1e-12)
        worst = max(worst, out[n, SPREAD])
    return worst


@LEAN
def norm(rotation, n, p):
    """Return a bound of the norm of rotation[n, p], 1 for a rotation.

    It is the square root of the largest row sum of |m m^T|.
    """
    xx = 0.0
    yy = 0.0
    zz = 0.0
    xy = 0.0
    xz = 0.0
    yz = 0.0
    for j in range(3):
        x = rotation[n, p, 0, j]
        y = rotation[n, p, 1, j]
        z = rotation[n, p, 2, j]
        xx += x * x
        yy += y * y
        zz += z * z
        xy += x * y
        xz += x * z
        yz += y * z
    xy = abs(xy)
    xz = abs(xz)
    yz = abs(yz)
    return math.sqrt(max(xx + xy + xz, yy + xy + yz, zz + xz + yz))


@LEAN
def cut_segments(extents, rate_h, rate_v, longest, out):
    """Split the symbols into segments over which the array gains are polynomials of low degree.

    Fills the table of segments out (N, 6) and returns how many segments there are. rate_h, rate_v:
    largest rate of the gains (rad per unit of direction cosine); longest: most symbols of a
    segment. A single symbol may be wider than the limits; fitting the gains then fails, and the
    pointwise kernel computes it.
    """
    count = 0
    n = 0
    while n < len(extents):
        low_h = np.inf
        high_h = -np.inf
        low_v = np.inf
        high_v = -np.inf
        end = n
        room_h = 0.0
        room_v = 0.0
        while end < len(extents) and end - n < longest:
            # How far a point's direction cosine may be from that of the reference.
            spread = extents[end, SPREAD]
            away = 2.0
            if spread < 1.0:
                away = 2.0 * spread / (2.0 - spread)
            psi = extents[end, PSI]
            omega = extents[end, OMEGA]
            next_low_h = min(low_h, psi - away)
            next_low_v = min(low_v, omega - away)
            next_high_h = max(high_h, psi + away)
            next_high_v = max(high_v, omega + away)
            phase_h = (next_high_h - next_low_h) * rate_h
            phase_v = (next_high_v - next_low_v) * rate_v
            if end == n:
                # Trade-off: a wider segment needs fewer polynomials, but of a higher degree.
                room_h = WIDER * (next_high_h - next_low_h) * rate_h + DRIFT
                room_v = WIDER * (next_high_v - next_low_v) * rate_v + DRIFT
            elif phase_h > room_h or phase_v > room_v:
                break
            low_h = next_low_h
            low_v = next_low_v
            high_h = next_high_h
            high_v = next_high_v
            end += 1
        out[count, START] = n
        out[count, END] = end
        out[count, PSI_CENTRE] = 0.5 * (low_h + high_h)
        out[count, PSI_HALF] = 0.5 * (high_h - low_h) * (1.0 + 1e-9) + 1e-9
        out[count, OMEGA_CENTRE] = 0.5 * (low_v + high_v)
        out[count, OMEGA_HALF] = 0.5 * (high_v - low_v) * (1.0 + 1e-9) + 1e-9
        count += 1
        n = end
    return count
