"""The number of nodes in time that is enough: bounds of a slow part's echo on ellipses about the time axis.

A part's moments, the reference's phase left out, are an analytic function of time. On the ellipse with foci at a
block's ends and semi-axes that sum to rho they are at most M, so the polynomial through d + 1 Chebyshev points is off
by at most 4 M rho^-d / (rho - 1) (Trefethen, Approximation Theory and Approximation Practice, theorem 8.2). M follows
from the sizes of the poses' series (`pose_series`).
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.common.jit import PLAIN
from lowalt.echo.fast.cell_kernel import PLACES
from lowalt.echo.radar import Radar

RHO = np.exp(np.linspace(math.log(1.15), math.log(40.0), 24))
"""Ellipses on which bounds are computed."""
ROUND = 2.0**-53
"""Largest relative rounding error of a double."""


class Nodes(NamedTuple):
    """How a block is interpolated: `degree` in time; `error`: bound of the interpolation relative to the sum of peak
    amplitudes at the reference's range; `phase`: largest error of the phase by the poses' series (rad); `gain`: the
    array gains' error by it, relative to their peak; `flat`, `bent`: by how much the sums of |amplitude| and of
    |amplitude| v^2 may exceed their linear interpolation, relative to the sum of peak amplitudes."""

    degree: int
    error: float
    phase: float
    gain: float
    flat: float
    bent: float


@PLAIN
def _on_ellipse(rho, moves, sizes):
    """Return bounds of complex vectors on the ellipse rho: of the reference's change and its imaginary part, and of a
    point's offset and its imaginary part. moves, sizes: norms of the series' orders."""
    stray, imaginary, reach, depth = 0.0, 0.0, sizes[0], 0.0
    up = 1.0
    for k in range(1, len(moves)):
        up *= rho
        wide, high = 0.5 * (up + 1.0 / up), 0.5 * (up - 1.0 / up)
        stray += moves[k] * wide
        imaginary += moves[k] * high
        reach += sizes[k] * wide
        depth += sizes[k] * high
    return stray, imaginary, reach, depth


@PLAIN
def _tilt(imaginary, range_m):
    """Return a bound of the imaginary part of V / sqrt(V.V) from |Im V| and Re sqrt(V.V)."""
    y = imaginary / range_m
    return y * math.sqrt(1.0 + y**4)


@PLAIN
def _growth(rho, moves, sizes, turns, cells_half, phases, rates):
    """Return logarithms of bounds of a point's factor on the ellipse, with its phase and without, and a bound of |v|.

    All are infinite where the ellipse is too wide for a bound. The range difference is e.m with
    m = (2 ref + e) / (|ref + e| + |ref|) = (a + b) / 2 + (a - b) (|ref + e| - |ref|) / (2 (|ref + e| + |ref|)), a and b
    the unit vectors along ref + e and ref. As |Im sqrt(V.V)| <= |Im V|, the poses bound every imaginary part.
    """
    stray, imaginary, reach, depth = _on_ellipse(rho, moves, sizes)
    low, side = moves[0] - stray - reach, imaginary + depth
    if low <= side:
        return np.inf, np.inf, np.inf
    near = math.sqrt((low - side) * (low + side))
    far = moves[0] + stray
    mean = (far + 0.5 * reach) / near
    more = reach * mean
    apart = reach / near + far * more / (near * near)
    tilt = _tilt(side, near)
    slant = tilt + more / (4.0 * near) * apart
    bare = rates * tilt + 2.0 * math.log(far / near)
    phase = 2.0 * np.pi * turns * (depth * mean + reach * slant) + 2.0 * np.pi * phases * tilt
    return bare + phase, bare, cells_half * more


@PLAIN
def choose(moves, sizes, turns, cells_half, slack, phases, rates, orders, kernel, target, top, ellipses):
    """Return the smallest degree that keeps `target` (0: none), its error, and `flat` and `bent` of `Nodes`.

    kernel: three sizes of the cell kernels' coefficients (`CellPolynomials.sizes`); slack: by how much, in v, their
    place may differ from the reference's.
    """
    best, error, flat, bent = 0, np.inf, np.inf, np.inf
    for rho in ellipses:
        whole, bare, v = _growth(rho, moves, sizes, turns, cells_half, phases, rates)
        if not whole < np.inf:
            continue
        wide = max(1.0, v + slack)
        whole += math.log(kernel[0] + kernel[1] * wide + kernel[2] * wide ** (orders - 1))
        degree = math.ceil((whole + math.log(4.0 / (rho - 1.0) / target)) / math.log(rho))
        degree = max(degree, 4)
        # Cauchy's estimate of the second derivative, from circles of this radius within the ellipse.
        radius = 0.5 * (rho + 1.0 / rho) - 1.0
        curve = 2.0 * math.exp(bare) / (radius * radius)
        if degree <= top and (best == 0 or degree < best):
            best, error = degree, 4.0 / (rho - 1.0) * math.exp(whole - degree * math.log(rho))
        flat, bent = min(flat, curve), min(bent, curve * wide * wide)
    if best == 0:
        return 0, np.inf, np.inf, np.inf
    spacing = math.sin(np.pi / (2 * best)) * 2.0
    return best, error, flat * spacing * spacing / 8.0, bent * spacing * spacing / 8.0


def nodes(radar: Radar, sizes: tuple, stray_ref: float, table, target: float, room: float, top: int) -> Nodes | None:
    """Return how to interpolate a block so that the error keeps `target`, relative to the sum of peak amplitudes.

    sizes: of `series_sizes`; stray_ref: largest error of the reference's series (m); table: `CellPolynomials`; room:
    largest phase error allowed of the poses' series (rad); top: highest degree that saves time. None where no bound
    allows interpolation.
    """
    moves, offsets, stray = sizes
    elements = radar.transmit_h + radar.receive_h + radar.transmit_v + radar.receive_v - 4
    phases, rates = radar.kappa / 4.0 * elements, math.pi * radar.kappa / 2.0 * elements
    reach, whole = float(offsets.sum()), float(moves.sum())
    least = 2.0 * float(moves[0]) - whole - reach
    if least <= 0.0:
        return None
    # Evaluating the series rounds every order once or twice.
    rounding = 2.0 * (len(moves) + 2) * ROUND
    stray += rounding * reach
    turned = (stray_ref + rounding * whole + stray) / least
    phase = 2.2 * math.pi * (radar.turns * (stray + 2.0 * reach * turned) + phases * turned)
    if not phase <= room:
        return None
    degree, error, flat, bent = choose(
        moves, offsets, radar.turns, radar.cells / table.half, 0.5 / PLACES / table.half, phases, rates,
        table.kernels.shape[2], table.sizes, target, top, RHO,
    )  # fmt: skip
    return Nodes(degree, error, phase, 1.1 * (rates + 2.0) * turned, flat, bent) if degree else None
