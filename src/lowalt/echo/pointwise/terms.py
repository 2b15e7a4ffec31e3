"""The pointwise kernel: every point's complex amplitude and range at one symbol.

It serves any geometry and array.

Used for symbols that the fast kernel cannot decide.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.echo.pointwise.reference_range import RANGE, REST, TURN
from lowalt.machine.jit import LEAN, PLAIN


class PointTerms(NamedTuple):
    """Values of all points at one symbol, (L,) each but `e`.

    e: (L, 3) m, position from the reference's point; z: complex amplitude without the cell's own
    phase; u: range in cells from the reference's cell; risk: of `terms`.
    """

    e: np.ndarray
    z: np.ndarray
    u: np.ndarray
    risk: np.ndarray


@PLAIN
def sin_pi(x):
    """Return sin(pi x), exactly zero for integer x.

    The argument is reduced before the product with pi.
    """
    k = np.rint(x)
    s = math.sin(math.pi * (x - k))
    if int(k) & 1:
        return -s
    return s


@PLAIN
def dirichlet(x, count):
    """Return U_{count-1}(cos(pi x)) = sin(pi count x) / sin(pi x), with its limits at whole x.

    For compiled doubles; double-doubles, torch tensors and slow references have their own versions.
    """
    k = np.rint(x)
    f = x - k
    sign = 1.0
    if (int(k) & 1) and (count - 1) & 1:
        sign = -1.0
    if f == 0.0:
        return sign * count
    return sign * sin_pi(count * f) / math.sin(math.pi * f)


@LEAN
def aim_cosines(aim, station, sine, cosine):
    """Return the direction cosines (horizontal, vertical) of the beams.

    They are Eq. 4 put into Psi and Omega.
    """
    x = aim[0] - station[0]
    y = aim[1] - station[1]
    z = aim[2] - station[2]
    r = math.sqrt(x * x + y * y + z * z)
    return (cosine * y - sine * x) / r, z / r


@PLAIN
def offsets(scene, n, origin, e):
    """Fill e (L, 3) with the points' positions relative to `origin` (3,) at symbol n (m)."""
    if scene.rotation.shape[0] == 0:
        for l in range(len(e)):  # noqa: E741
            for i in range(3):
                e[l, i] = scene.translation[n, l, i] - origin[i]
        return
    for l in range(len(e)):  # noqa: E741
        p = scene.part[l]
        for i in range(3):
            turned = 0.0
            for j in range(3):
                turned += scene.rotation[n, p, i, j] * scene.points[l, j]
            e[l, i] = turned + (scene.translation[n, p, i] - origin[i])


@PLAIN
def terms(scene, radar, ref, n, aims, out):
    """Fill `out` (`PointTerms`) with the share of each point at symbol n.

    ref: the symbol's row of `reference_range.reference`; aims: direction cosines of the beams. The
    risk is the peak amplitude times (r_ref + |e|) / r, which grows with the rounding of the point's
    direction. Returns 0, or 1 + l where point l stands in the station. Source: paper Eqs. 7 and 24,
    steering sums as Chebyshev polynomials.
    """
    first = 0
    if scene.rotation.shape[0] > 0:
        first = scene.part[0]
    e, z, u, risk = out
    offsets(scene, n, scene.translation[n, first], e)
    phase_h = radar.kappa / 4.0 * (radar.transmit_h + radar.receive_h - 2)
    phase_v = radar.kappa / 4.0 * (radar.transmit_v + radar.receive_v - 2)
    cells = radar.cells
    peak = float(radar.transmit_h * radar.transmit_v) * float(radar.receive_h * radar.receive_v)
    for l in range(len(e)):  # noqa: E741
        x = ref[0] + e[l, 0]
        y = ref[1] + e[l, 1]
        w = ref[2] + e[l, 2]
        r2 = x * x + y * y + w * w
        if r2 == 0.0:
            return 1 + l
        r = math.sqrt(r2)
        # (r^2 - r_ref^2) / (r + r_ref) is the difference of the ranges without cancellation.
        excess = 0.0
        for i in range(3):
            excess += e[l, i] * (2.0 * ref[i] + e[l, i])
        more = excess / (r + ref[RANGE])
        psi = (radar.cosine * y - radar.sine * x) / r - aims[0]
        omega = w / r - aims[1]
        h = 0.5 * radar.kappa * psi
        v = 0.5 * radar.kappa * omega
        gain = dirichlet(h, radar.transmit_h) * dirichlet(h, radar.receive_h)
        gain *= dirichlet(v, radar.transmit_v) * dirichlet(v, radar.receive_v)
        turn = phase_h * psi + phase_v * omega - ref[TURN] - radar.turns * more
        turn -= np.rint(turn)
        strength = radar.scale * scene.root_rcs[l] / r2
        a = strength * gain
        offset = math.sqrt(e[l, 0] ** 2 + e[l, 1] ** 2 + e[l, 2] ** 2)
        risk[l] = strength * peak * (ref[RANGE] + offset) / r
        z[l] = complex(a * math.cos(2.0 * math.pi * turn), a * math.sin(2.0 * math.pi * turn))
        u[l] = ref[REST] + cells * more
    return 0


@PLAIN
def cell_phase(m, count):
    """Return the phase factor exp(j pi (M-1) m / M) of range cell m.

    Its argument is reduced in whole numbers.
    """
    turn = ((count - 1) * (m % (2 * count)) % (2 * count)) / (2.0 * count)
    return complex(math.cos(2.0 * math.pi * turn), math.sin(2.0 * math.pi * turn))


@PLAIN
def cell_weight(x, count):
    """Return the real part of the range-cell kernel, sin(pi x) / (M sin(pi x / M)), x in cells."""
    return dirichlet(x / count, count) / count


@PLAIN
def cell_sum(z, u, j, count):
    """Return the sum of the points in the cell j cells after the reference's.

    The cell's own phase is left out.
    """
    total = 0.0j
    for l in range(len(z)):  # noqa: E741
        total += z[l] * cell_weight(j - u[l], count)
    return total
