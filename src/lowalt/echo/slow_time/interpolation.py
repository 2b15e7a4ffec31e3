"""A block's slow points at nodes in time, and their moments carried to every symbol with a bound of their error."""

from typing import NamedTuple

import numpy as np

from lowalt.echo.fast import driver, vector_loops
from lowalt.echo.fast.cell_kernel import Cells
from lowalt.echo.fast.error_model import Plan, rules
from lowalt.echo.fast.layout import Layout, layout
from lowalt.echo.fast.polynomials import folding
from lowalt.echo.fast.range_bounds import SIZE, SPREAD, segments, spans
from lowalt.echo.radar import Radar
from lowalt.echo.scene import Scene
from lowalt.echo.slow_time import node_count, pose_series

LEBESGUE = 6.0
"""Bound of the interpolation's norm, 1 + (2 / pi) log(degree + 1), for degrees below 2500."""


class Slow(NamedTuple):
    """What slow points add at each symbol of a block, times r^2 and without the reference's phase: moments about the
    reference's range (B, 2, orders), bounds of the sums of |z| and |z| v^2 (B, 2), bounds of the error (B,)."""

    moments: np.ndarray
    sums: np.ndarray
    errors: np.ndarray


NOTHING = Slow(np.empty((0, 2, 1)), np.empty((0, 2)), np.empty(0))
"""No slow points."""


class Split(NamedTuple):
    """A target's points in two: slow parts (K,), which points are on them (L,) bool, and the runs of these points: the
    row of their part, centre (m) and radius (m), in its frame."""

    parts: np.ndarray
    mask: np.ndarray
    rows: np.ndarray
    centres: np.ndarray
    radii: np.ndarray


def split(scene: Scene, radar: Radar, lay: Layout) -> Split | None:
    """Return which parts may be interpolated in time; None where they have too few points to be worth it."""
    steps = min(len(scene.translation), pose_series.BLOCK)
    if not len(scene.rotation) or len(scene.points) * steps < pose_series.WORTH:
        return None
    chosen = pose_series.candidates(
        scene.rotation, lay.parts, lay.starts, lay.centres, lay.radii, steps, radar.turns, 2 * vector_loops.LANES
    )
    if not chosen.any():
        return None
    mask, runs = chosen[scene.part], chosen[lay.parts]
    if np.count_nonzero(mask) * steps < pose_series.WORTH:
        return None
    rows = np.cumsum(chosen) - 1
    return Split(np.flatnonzero(chosen), mask, rows[lay.parts[runs]], lay.centres[runs], lay.radii[runs])


def subset(scene: Scene, mask: np.ndarray) -> Scene:
    """Return the scene with only the points of `mask`."""
    return scene._replace(points=scene.points[mask], part=scene.part[mask], root_rcs=scene.root_rcs[mask])


def interpolated(
    scene: Scene, radar: Radar, refs: np.ndarray, aims, halves: Split, table: Cells, plan: Plan,
    size: tuple[float, float], allowed: float, peak: float,
) -> tuple[Slow, int] | None:  # fmt: skip
    """Return what the slow points add at the symbols of `refs` (B, 7), and how many nodes it took; None where no bound
    allows it, or where it would not be worth it.

    scene: poses at these symbols; plan: of the exact mode; size: largest radius over range and radius (m) that the
    plan was made for; allowed: error relative to the sum of the slow points' peak amplitudes, and radians that fitted
    poses may be off by; peak: what multiplies sqrt(rcs).
    """
    count, points = len(refs), np.count_nonzero(halves.mask)
    top = count - -(-pose_series.WORTH // points)
    if top < 4:
        return None
    poses = pose_series.series(
        scene.rotation, scene.translation, refs, int(scene.part[0]), halves.parts, pose_series.fit(count)
    )
    sizes = pose_series.extent(*poses, halves.rows, halves.centres, halves.radii)
    nodes = node_count.nodes(radar, sizes, float(poses[3][0]), table, allowed, allowed, top)
    if nodes is None:
        return None
    polynomial, linear, values = pose_series.weights(count, nodes.degree)
    still, there, lay, span = _at_nodes(scene, radar, halves, poses, values, peak)
    spread = float(span[:, SPREAD].max())
    # Between symbols a target may come a little nearer than at any; the plan's bounds leave room for half a percent.
    if not (spread <= 1.004 * size[0] and span[:, SIZE].max() <= 1.004 * size[1]):
        return None
    known, orders = rules(radar), table.kernels.shape[2]
    segs = np.empty((len(span), 6))
    runs = segments(span, known[1][0], known[3][0], len(span), segs)
    rooms, work, small = driver.rooms_for(max(map(len, known[1::2])), orders, lay.amplitude, False)
    moments, sums, errors = np.empty((len(span), 2, orders)), np.empty((len(span), 2)), np.empty(len(span))
    if not driver.moments_at(
        still, lay, radar, 0, there, span, segs[:runs], aims, known, tuple(table), plan.fits, folding(),
        (plan.fit, plan.share, plan.peak, node_count.ROUND, vector_loops.TILE, plan.near, 1.0), rooms, work, small,
        (moments, sums, errors),
    ):  # fmt: skip
        return None
    everywhere = linear @ sums
    everywhere += lay.total * np.array([nodes.flat, nodes.bent])
    carried = (polynomial @ moments.reshape(len(span), -1)).reshape(count, 2, orders)
    # Products, sums and the shift by part of a cell round; a kernel's coefficients say by how much that counts.
    rounding = node_count.ROUND * LEBESGUE * (len(span) + 3 * orders + 8) * sum(table.sizes) * sums[:, 0].max()
    fixed = LEBESGUE * errors.max() + (nodes.error + nodes.gain / (1.0 - spread) ** 2) * lay.total + rounding
    return Slow(carried, everywhere, fixed + nodes.phase * everywhere[:, 0]), len(span)


def _at_nodes(scene: Scene, radar: Radar, halves: Split, poses: tuple, values: np.ndarray, peak: float):
    """The slow points at the nodes: (scene whose part 0 is the reference, at the origin; refs; layout; spans).

    values: the Chebyshev polynomials at the nodes.
    """
    reference, offset, turned, _ = poses
    count, parts = len(values), len(halves.parts)
    rotation, translation = np.zeros((count, parts + 1, 3, 3)), np.zeros((count, parts + 1, 3))
    rotation[:, 1:] = (values @ turned.reshape(len(turned), -1)).reshape(count, parts, 3, 3)
    translation[:, 1:] = (values @ offset.reshape(len(turned), -1)).reshape(count, parts, 3)
    there = np.zeros((count, 7))
    there[:, :3] = values @ reference
    there[:, 3] = np.sqrt((there[:, :3] ** 2).sum(axis=1))
    mine = subset(scene, halves.mask)
    part = np.searchsorted(halves.parts, mine.part) + 1
    still = mine._replace(rotation=rotation, translation=translation, part=part)
    lay = layout(still, peak)
    span = np.empty((count, 5))
    spans(rotation, translation, 0, lay.parts, lay.centres, lay.radii, there, radar.sine, radar.cosine, span)
    return still, there, lay, span
