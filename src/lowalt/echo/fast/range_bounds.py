"""Bounds of the points' positions at every symbol, from the poses of the parts alone, before any
point is computed.
"""

import math

import numpy as np

from lowalt.echo.pointwise.reference_range import RANGE, X, Y, Z
from lowalt.machine.jit import LEAN

PSI, OMEGA, SPREAD, SIZE, MEAN = range(5)
"""Columns of the table of extents: two direction cosines of the reference; the largest distance of
a point from the reference, relative to the range and in metres; and a bound of the
amplitude-weighted mean distance (m)."""
START, END, PSI_CENTRE, PSI_HALF, OMEGA_CENTRE, OMEGA_HALF = range(6)
"""Columns of the table of segments: first symbol, end, centre and half-width of the points'
direction cosines.
"""
DRIFT = 1.0
"""Radians of gain phase by which a segment may be wider than the target."""


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
                bound = norm(rotation, n, p) if radii[group] > 0.0 else 0.0
                away = math.sqrt(x * x + y * y + z * z)
                size = max(size, away + bound * radii[group])
                mean += groups.weights[group] * away + bound * groups.strays[group]
        size *= 1.0 + 1e-12
        out[n, PSI] = (radar.cosine * refs[n, Y] - radar.sine * refs[n, X]) / r if r > 0.0 else 0.0
        out[n, OMEGA] = refs[n, Z] / r if r > 0.0 else 0.0
        out[n, SPREAD] = size / r if r > 0.0 else np.inf
        out[n, SIZE], out[n, MEAN] = size, mean * (1.0 + 1e-12)
        worst = max(worst, out[n, SPREAD])
    return worst


@LEAN
def norm(rotation, n, p):
    """Return a bound of the norm of rotation[n, p]: sqrt of the largest row sum of |m m^T| (1 for a
    rotation).
    """
    rows = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for j in range(3):
        x, y, z = rotation[n, p, 0, j], rotation[n, p, 1, j], rotation[n, p, 2, j]
        rows = (
            rows[0] + x * x,
            rows[1] + y * y,
            rows[2] + z * z,
            rows[3] + x * y,
            rows[4] + x * z,
            rows[5] + y * z,
        )
    a = rows[0]
    b = rows[1]
    c = rows[2]
    d = abs(rows[3])
    e = abs(rows[4])
    f = abs(rows[5])
    return math.sqrt(max(a + d + e, b + d + f, c + e + f))


@LEAN
def cut_segments(extents, rate_h, rate_v, longest, out):
    """Split the symbols into segments over which polynomials of low degree represent the array
    gains.

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
            d = extents[end, SPREAD]
            turn = 2.0 * d / (2.0 - d) if d < 1.0 else 2.0
            a = extents[end, PSI]
            b = extents[end, OMEGA]
            l0 = min(low_h, a - turn)
            l1 = min(low_v, b - turn)
            h0 = max(high_h, a + turn)
            h1 = max(high_v, b + turn)
            if end == n:
                # Trade-off: a wider segment needs fewer polynomials, but of a higher degree.
                room_h = 1.2 * (h0 - l0) * rate_h + DRIFT
                room_v = 1.2 * (h1 - l1) * rate_v + DRIFT
            elif (h0 - l0) * rate_h > room_h or (h1 - l1) * rate_v > room_v:
                break
            low_h = l0
            low_v = l1
            high_h = h0
            high_v = h1
            end += 1
        out[count, START], out[count, END] = n, end
        out[count, PSI_CENTRE] = 0.5 * (low_h + high_h)
        out[count, PSI_HALF] = 0.5 * (high_h - low_h) * (1.0 + 1e-9) + 1e-9
        out[count, OMEGA_CENTRE] = 0.5 * (low_v + high_v)
        out[count, OMEGA_HALF] = 0.5 * (high_v - low_v) * (1.0 + 1e-9) + 1e-9
        count += 1
        n = end
    return count
