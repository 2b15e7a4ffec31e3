"""Moments of a block's slow points: computed at nodes in time, interpolated to every symbol, their error bounded."""

from typing import NamedTuple

import numpy as np

from lowalt.echo.fast import driver
from lowalt.echo.fast.layout import Layout, layout
from lowalt.echo.fast.range_bounds import SIZE, SPREAD, cut_segments, fill_extents
from lowalt.echo.fast.strip import MULTIPLE
from lowalt.echo.fast.workspace import Approximation, SlowMoments, Symbols, workspace
from lowalt.echo.pointwise.reference_range import RANGE
from lowalt.echo.radar import Radar
from lowalt.echo.scene import EchoScene
from lowalt.echo.slow_time import node_count, pose_series

LEBESGUE = 6.0
"""Bound of the interpolation's norm, 1 + (2 / pi) log(degree + 1), for degrees below 2500."""
NO_SLOW_POINTS = SlowMoments(np.empty((0, 2, 1)), np.empty((0, 2)), np.empty(0))
"""The moments of a target all of whose points are computed at every symbol."""


class SlowParts(NamedTuple):
    """The slow parts (K,) of a target, which points are on them (L,) bool, and the groups of these points: the row of
    their part, centre (m) and radius (m), in its frame."""

    parts: np.ndarray
    mask: np.ndarray
    rows: np.ndarray
    centres: np.ndarray
    radii: np.ndarray


def slow_parts(scene: EchoScene, radar: Radar, lay: Layout) -> SlowParts | None:
    """Return which parts may be interpolated in time; None where they have too few points to save time."""
    steps = min(len(scene.translation), pose_series.BLOCK)
    if not len(scene.rotation) or len(scene.points) * steps < pose_series.INTERPOLATION_COST:
        return None
    chosen = pose_series.candidates(scene.rotation, lay, steps, radar.turns, 2 * MULTIPLE)
    if not chosen.any():
        return None
    mask, groups = chosen[scene.part], chosen[lay.parts]
    if np.count_nonzero(mask) * steps < pose_series.INTERPOLATION_COST:
        return None
    rows = np.cumsum(chosen) - 1
    return SlowParts(np.flatnonzero(chosen), mask, rows[lay.parts[groups]], lay.centres[groups], lay.radii[groups])


def subset(scene: EchoScene, mask: np.ndarray) -> EchoScene:
    """Return the scene with only the points of `mask` (L,) bool."""
    return scene._replace(
        points=scene.points[mask], part=scene.part[mask], root_rcs=scene.root_rcs[mask], rcs_m2=scene.rcs_m2[mask]
    )


def interpolated(
    scene: EchoScene, radar: Radar, refs: np.ndarray, aims: tuple[float, float], slow: SlowParts, exact: Approximation,
    size: tuple[float, float], allowed: float, peak: float,
) -> tuple[SlowMoments, int] | None:  # fmt: skip
    """Return the moments of the slow points at the symbols of `refs` (B, 7), and the number of nodes used.

    None where no bound allows interpolation, or where it would save no time. scene: poses at these symbols; exact: the
    exact plan with the cell kernels to use; size: largest radius over range and radius (m) that the plan was made for;
    allowed: error relative to the sum of the slow points' peak amplitudes, and phase error of fitted poses (rad); peak:
    amplitude of a point of 1 m2 at 1 m at the arrays' peak gain.
    """
    table = exact.cells
    count, points = len(refs), int(np.count_nonzero(slow.mask))
    top = count - -(-pose_series.INTERPOLATION_COST // points)
    if top < 4:
        return None
    poses = pose_series.series(
        scene.rotation, scene.translation, refs, int(scene.part[0]), slow.parts, pose_series.fit(count)
    )
    sizes = pose_series.series_sizes(*poses, slow.rows, slow.centres, slow.radii)
    nodes = node_count.nodes(radar, sizes, float(poses[3][0]), table, allowed, allowed, top)
    if nodes is None:
        return None
    polynomial, linear, values = pose_series.weights(count, nodes.degree)
    there, lay, node_refs, extents = _at_nodes(scene, radar, slow, poses, values, peak)
    spread = float(extents[:, SPREAD].max())
    # Between symbols a target may be a little nearer than at any symbol; the plan's bounds leave half a percent.
    if not (spread <= 1.004 * size[0] and extents[:, SIZE].max() <= 1.004 * size[1]):
        return None
    segments = np.empty((len(extents), 6))
    segments = segments[
        : cut_segments(extents, exact.gains.rates_h[0], exact.gains.rates_v[0], len(extents), segments)
    ]  # fmt: skip
    orders = table.kernels.shape[2]
    at_nodes = SlowMoments(np.empty((len(extents), 2, orders)), np.empty((len(extents), 2)), np.empty(len(extents)))
    symbols = Symbols(np.arange(len(extents)), node_refs, extents, segments)
    work = workspace(exact, lay.amplitude)
    if not driver.moments_at(there, lay, radar, 0, symbols, aims, exact, work, at_nodes):
        return None
    sums = linear @ at_nodes.sums
    sums += lay.total * np.array([nodes.flat, nodes.bent])
    moments = (polynomial @ at_nodes.moments.reshape(len(extents), -1)).reshape(count, 2, orders)
    # Products, sums and the shift by part of a cell round; a kernel's coefficients weight these roundings.
    rounding = node_count.ROUND * LEBESGUE * (len(extents) + 3 * orders + 8) * sum(table.sizes)
    rounding *= at_nodes.sums[:, 0].max()
    fixed = LEBESGUE * at_nodes.errors.max() + (nodes.error + nodes.gain / (1.0 - spread) ** 2) * lay.total + rounding
    return SlowMoments(moments, sums, fixed + nodes.phase * sums[:, 0]), len(extents)


def _at_nodes(scene: EchoScene, radar: Radar, slow: SlowParts, poses: tuple, values: np.ndarray, peak: float):
    """Return the slow points at the nodes: (scene, layout, reference ranges, extents).

    Part 0 of the scene is the reference, at the origin. values: the Chebyshev polynomials at the nodes.
    """
    reference, offset, turned, _ = poses
    count, parts = len(values), len(slow.parts)
    rotation, translation = np.zeros((count, parts + 1, 3, 3)), np.zeros((count, parts + 1, 3))
    rotation[:, 1:] = (values @ turned.reshape(len(turned), -1)).reshape(count, parts, 3, 3)
    translation[:, 1:] = (values @ offset.reshape(len(turned), -1)).reshape(count, parts, 3)
    refs = np.zeros((count, 7))
    refs[:, :RANGE] = values @ reference
    refs[:, RANGE] = np.sqrt((refs[:, :RANGE] ** 2).sum(axis=1))
    mine = subset(scene, slow.mask)
    part = np.searchsorted(slow.parts, mine.part) + 1
    there = mine._replace(rotation=rotation, translation=translation, part=part)
    lay = layout(there, peak)
    extents = np.empty((count, 5))
    fill_extents(there, 0, lay, refs, radar, extents)
    return there, lay, refs, extents
