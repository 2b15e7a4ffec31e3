"""The range cells of a window around a given cell of each symbol: a few cells of `sums.matrix`, computed faster."""

import math

import numpy as np

from lowalt.echo.pointwise.reference_range import CELL
from lowalt.echo.pointwise.terms import cell_phase, cell_weight, sin_pi, terms
from lowalt.machine.jit import INNER_VECTOR, PLAIN


@INNER_VECTOR
def _add_shares(z, first, last, at, top, s, c, sines, cosines, re, im):
    """Add z top / sin(pi (k + a) / M) to the cells first .. last - 1, where k = i + at - K; s, c: of pi a / M."""
    for i in range(first, last):
        weight = top / (sines[i + at] * c + cosines[i + at] * s)
        re[i] += z.real * weight
        im[i] += z.imag * weight


@PLAIN
def _add_point(z, u, first, count, sines, cosines, re, im):
    """Add a point of amplitude z at u cells to re and im (cells,), the cells from `first` on, without their phases.

    With a = j0 - u and j = j0 + k, sin(pi (j - u)) is +-sin(pi a), and sin(pi (k + a) / M) is a sum of two products, so
    a cell needs no sine of its own. sines, cosines: of pi k / M for k = -K .. K, times (-1)^k.
    """
    nearest = int(np.rint(u))
    a, reach, cells = nearest - u, len(sines) // 2, len(re)
    low = first - nearest
    if low < -reach or low + cells - 1 > reach:
        # Far from the window, where steps may come near a whole turn of M cells.
        for i in range(cells):
            weight = cell_weight(first + i - u, count)
            re[i] += z.real * weight
            im[i] += z.imag * weight
        return
    top, s, c = sin_pi(a) / count, math.sin(math.pi * a / count), math.cos(math.pi * a / count)
    # In the nearest cell both sines may vanish, so it takes the definition with its limit.
    own = -low if 0 <= -low < cells else cells
    _add_shares(z, 0, own, low + reach, top, s, c, sines, cosines, re, im)
    if own < cells:
        weight = cell_weight(a, count)
        re[own] += z.real * weight
        im[own] += z.imag * weight
        _add_shares(z, own + 1, cells, low + reach, top, s, c, sines, cosines, re, im)


@PLAIN
def profile_cells(scene, radar, refs, aims, tracked, sines, cosines, out):
    """Fill out (N, cells) with the range cells around `tracked` (N,), which comes in the middle, modulo M.

    sines, cosines (2 K + 1,): of pi k / M for k = -K .. K, times (-1)^k, with K below M / 2.
    Returns 0, or n L + l + 1 where point l stands in the station at symbol n. Source: paper, Eqs. 24 and 25.
    """
    points = scene.translation.shape[1] if scene.rotation.shape[0] == 0 else len(scene.points)
    e, z, u, risk = np.empty((points, 3)), np.empty(points, np.complex128), np.empty(points), np.empty(points)
    cells, count = out.shape[1], radar.subcarriers
    re, im = np.empty(cells), np.empty(cells)
    for n in range(len(refs)):
        fault = terms(scene, radar, refs[n], n, aims, e, z, u, risk)
        if fault:
            return n * points + fault
        base = int(refs[n, CELL])
        # The distance of the tracked cell from the reference's, the short way round the M cells.
        apart = (int(tracked[n]) - base + count // 2) % count - count // 2
        first = apart - cells // 2
        re[:], im[:] = 0.0, 0.0
        for l in range(points):  # noqa: E741
            _add_point(z[l], u[l], first, count, sines, cosines, re, im)
        for i in range(cells):
            out[n, i] = complex(re[i], im[i]) * cell_phase(base + first + i, count)
    return 0
