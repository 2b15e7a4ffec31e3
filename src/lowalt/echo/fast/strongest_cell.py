"""The proved strongest cell: moments give the near cells, a bound excludes all others."""

import math

import numpy as np

from lowalt.echo.fast.cell_kernel import POSITIONS, SIDE
from lowalt.echo.pointwise.arg_max import NEAR_TIE, strongest_of
from lowalt.machine.jit import INLINED, INNER_VECTOR, LEAN

CERTAIN = 0
UNCERTAIN = 1
"""State of a symbol.

Its strongest cell is proved, or it must be computed again by the exact plan or pointwise.
"""


@INNER_VECTOR
def cell_sums(kernels, position, moments, first, last, sums):
    """Fill rows first..last of sums (2 SIDE + 1, 2) with real and imaginary parts.

    The rows start at cell -SIDE.
    """
    position = np.uint64(position)
    for j in range(np.uint64(first), np.uint64(last + 1)):
        re = 0.0
        im = 0.0
        for k in range(np.uint64(kernels.shape[2])):
            re += kernels[position, j, k] * moments[0, k]
            im += kernels[position, j, k] * moments[1, k]
        sums[j, 0] = re
        sums[j, 1] = im


@INNER_VECTOR
def _product(sines, position, moments, shift):
    """Return |sum of z sin(pi u) v^shift|, the sine's series cut after the last moment there is."""
    re = 0.0
    im = 0.0
    position = np.uint64(position)
    shift = np.uint64(shift)
    for i in range(np.uint64(sines.shape[1]) - shift):
        re += sines[position, i] * moments[0, i + shift]
        im += sines[position, i] * moments[1, i + shift]
    return math.sqrt(re * re + im * im)


@LEAN
def far_moments(sines, position, moments, half, total, second, error, far):
    """Fill far (4,) with bounds of |sum c y^k|, k = 0, 1, 2, and of sum |c y^3|.

    y: in cells from the position of the table's row.

    c = z sin(pi u). Orders of the sine that the moments do not reach are bounded by `second`, the
    sum of |z| v^2.
    """
    degree = sines.shape[1] - 1
    scale = 1.0
    missing = 0.0
    for k in range(3):
        found = _product(sines, position, moments, k)
        far[k] = scale * (found + missing * second + error * total)
        missing += abs(sines[position, degree - k])
        scale *= half
    far[3] = scale * second


@LEAN
def far_limit(far, distance, half, count):
    """Return a bound of |sum| in every cell at least `distance` from the table row's position.

    Compare `results.far_bound`.

    g(x) = 1 / (M sin(pi x / M)) expanded to third order: |g'''| <= 6 (pi / M)^3 / (M sin^4(pi x /
    M)). All factors fall with distance up to M / 2; the sine is bounded from below by x - x^3 / 6.
    """
    if distance - half <= 0.0:
        return math.inf
    step = math.pi / count
    x = step * distance
    near = step * (distance - half)
    s = step / (x * (1.0 - x * x / 6.0))
    n = step / (near * (1.0 - near * near / 6.0))
    return (
        (far[0] * s + (far[1] + far[2] * s) * s * s + far[3] * (n * n) * (n * n))
        / math.pi
        * (1.0 + 1e-9)
    )


@INLINED
def certify(table, position, size, totals, error, bound, count, work):
    """Return (state, row in `sums`, near-tie, lead) of one symbol's strongest cell.

    The cells around the target are computed first, then all 2 SIDE + 1 if the bound cannot exclude
    the others. table: `cell_kernel.CellPolynomials`; position: row of its tables; size: largest
    distance of a point from the reference (cells); totals: sums of |z| and of |z| v^2; error:
    relative to them, of the sums in `far_moments`; bound: of the error of any cell's sum; work:
    `workspace.Workspace`, which holds the moments. lead: lower bound of |sum| in the strongest cell
    less |sum| in any other, negative where none is proved.
    """
    half = table.half
    centre = position / POSITIONS - 0.5
    moments = work.moments
    sums = work.sums
    far = work.far
    far_moments(table.sines, position, moments, half, totals[0], totals[1], error, far)
    margin = 0.6 + 1.5 * size
    first = SIDE + max(-SIDE, min(math.ceil(centre - margin), SIDE))
    last = SIDE + max(-SIDE, min(math.floor(centre + margin), SIDE))
    for whole in range(2):
        if whole:
            first = 0
            last = 2 * SIDE
        cell_sums(table.kernels, position, moments, first, last, sums)
        best, second, which = strongest_of(sums, first, last)
        gap = min(centre - (first - 1 - SIDE), last + 1 - SIDE - centre, 0.5 * count)
        limit = far_limit(far, gap, half, count)
        if limit + bound < best * (1.0 - NEAR_TIE) - bound:
            near_tie = best - second <= NEAR_TIE * best
            lead = best - max(second, limit) - 2.0 * bound
            return CERTAIN, which, near_tie, lead
    return UNCERTAIN, 0, False, 0.0
