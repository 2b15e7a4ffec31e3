"""Whether rays by some facets pass all buildings.

Rays that end near each other are traced in blocks. A block that no ray can reach is dropped, and
one with a triangle that may be in the way is halved until single rays decide.
"""

from typing import NamedTuple

import numpy as np

from lowalt.extensions.town.bundle_loops import (
    Bundle,
    RaySpan,
    between,
    bundle_of,
    can_cross,
    clear_span,
    dark,
    empty_bundle,
    empty_span,
    span_of,
    widen,
)
from lowalt.extensions.town.candidate_loops import BoxCorners, empty_corners, misses
from lowalt.extensions.town.facets import Facets, Occluders
from lowalt.extensions.town.image_loops import (
    ALLOCATING,
    MOST_POINTS,
    OUTSIDE,
    REACHED,
    WRONG_SIDE,
    RayPoints,
    crosses,
    trace_ray,
)
from lowalt.machine.jit import INLINED, INNER, PLAIN

MOST_LEGS = 3
"""Legs of a ray with two reflections."""
MOST_WAITING = 64
"""Groups of blocks that wait at most: one for each time that a group is halved, and one more."""

NO_RAY = 0
BOUNDED = 1
UNBOUNDED = 2
"""What `_bounds` returns.

No ray reaches the box; the rays to its corners bound all others; they do not.
"""
DARK = -1
"""What `_shadow_lists` returns where no ray passes."""
NO_PARENT = -1
"""Depth of the lists that hold a group's triangles, where there are none yet."""


class RayPath(NamedTuple):
    """A path to look for.

    facets, occluders: of the town; route: (0 to 2,), the facets from the station on; station: (3,)
    m.
    """

    facets: Facets
    occluders: Occluders
    route: np.ndarray
    station: np.ndarray


class ShadowLists(NamedTuple):
    """The triangles that can be in the way of a group of blocks.

    Triangles are held by the depth of halving and by leg. rows: (D, 3, F), of the occluders'
    triangles, of which the first counts (D, 3) are valid.
    """

    rows: np.ndarray
    counts: np.ndarray


class Waiting(NamedTuple):
    """The stack of groups of blocks that are not traced yet, each (64,).

    begin, end: blocks; depth: how often they were halved; parent: depth of the lists that hold all
    their triangles.
    """

    begin: np.ndarray
    end: np.ndarray
    depth: np.ndarray
    parent: np.ndarray


class Box(NamedTuple):
    """A box: its low and high corner, and any one of its corners, (3,) m each."""

    low: np.ndarray
    high: np.ndarray
    corner: np.ndarray


class RayWorkspace(NamedTuple):
    """Work space of `_trace_blocks`; points (8, 4, 3) m: those of the rays to a box's corners."""

    lists: ShadowLists
    waiting: Waiting
    ray: RayPoints
    points: np.ndarray
    box: Box
    corners: BoxCorners
    bundle: Bundle
    span: RaySpan


@ALLOCATING
def _workspace(triangles, blocks):
    """Return the work space for a number of triangles and of blocks."""
    depths = 3
    while blocks > 0:
        depths += 1
        blocks //= 2
    lists = ShadowLists(
        np.empty((depths, MOST_LEGS, triangles), np.int64),
        np.zeros((depths, MOST_LEGS), np.int64),
    )
    columns = np.empty((4, MOST_WAITING), np.int64)
    waiting = Waiting(columns[0], columns[1], columns[2], columns[3])
    ray = RayPoints(np.empty((MOST_POINTS, 3)), np.empty(3), np.empty(3))
    points = np.empty((8, MOST_POINTS, 3))
    box = Box(np.empty(3), np.empty(3), np.empty(3))
    return RayWorkspace(
        lists, waiting, ray, points, box, empty_corners(), empty_bundle(), empty_span()
    )


@INNER
def _own(occluders, row, route, leg):
    """Whether a triangle belongs to a facet at which a leg of the route begins or ends."""
    facet = occluders.facet[row]
    return (leg > 0 and facet == route[leg - 1]) or (leg < len(route) and facet == route[leg])


@INNER
def _shadowed(occluders, points, rows, counts):
    """Whether a triangle of the lists rows (legs, F) blocks a leg of a ray by its points.

    That triangle is tried first next.
    """
    for leg in range(len(counts)):
        for f in range(counts[leg]):
            row = rows[leg, f]
            if crosses(occluders.triangles[row], points[leg], points[leg + 1]):
                rows[leg, f] = rows[leg, 0]
                rows[leg, 0] = row
                return True
    return False


@INNER
def _gather_leg(occluders, route, leg, bundle, older, found):
    """Fill found (F,) with the triangles that may block a bundle on one leg; return their number.

    older: a list that holds them all, empty to look for them in the tree.
    """
    kept = 0
    if len(older) == 0:
        older = found[: between(occluders, bundle, found)]
    for f in range(len(older)):
        row = older[f]
        if _own(occluders, row, route, leg):
            continue
        if can_cross(bundle.boxes, occluders.triangles[row], bundle.box):
            found[kept] = row
            kept += 1
    return kept


@INLINED
def _trace_rays(path, targets, work, depth, known, present, first_only):
    """Do the work of `_trace_blocks` for one block of targets (n, 1, 3), ray by ray.

    known: whether the work space holds, at this depth, lists of the triangles that can be in the
    way.
    """
    facets = path.facets
    occluders = path.occluders
    points = work.ray.points
    span = work.span
    legs = len(path.route) + 1
    for leg in range(legs):
        clear_span(span, leg)
    any_ray = False
    for n in range(len(targets)):
        if trace_ray(facets, path.route, path.station, targets[n, 0], work.ray, True) == REACHED:
            any_ray = True
            for leg in range(legs):
                widen(span, leg, points[leg], points[leg + 1])
    if not any_ray:
        return False
    rows = work.lists.rows[depth + 1]
    counts = work.lists.counts[depth + 1, :legs]
    for leg in range(legs):
        bundle_of(span, leg, work.bundle)
        size = work.lists.counts[depth, leg] if known else 0
        older = work.lists.rows[depth, leg, :size]
        if known and size == 0:
            counts[leg] = 0
        else:
            counts[leg] = _gather_leg(occluders, path.route, leg, work.bundle, older, rows[leg])
    met = False
    for n in range(len(targets)):
        if trace_ray(facets, path.route, path.station, targets[n, 0], work.ray, True) != REACHED:
            continue
        if not _shadowed(occluders, points, rows, counts):
            present[n, 0] = True
            met = True
            if first_only:
                return True
    return met


@INNER
def _cut(facets, k, low, high):
    """Cut a box between two corners (3,) to that around facet k; return whether they meet."""
    for i in range(3):
        reach = (
            abs(facets.across[k, i]) * facets.half[k, 0]
            + abs(facets.up[k, i]) * facets.half[k, 1]
            + 1e-6
        )
        low[i] = max(low[i], facets.centre[k, i] - reach)
        high[i] = min(high[i], facets.centre[k, i] + reach)
    return low[0] <= high[0] and low[1] <= high[1] and low[2] <= high[2]


@INNER
def _bounded_facet(facets, route, k):
    """Whether the route has a facet at index k, and it is not the endless ground."""
    if k < 0 or k == len(route):
        return False
    return facets.first[route[k]] != facets.first[route[k] + 1]


@INLINED
def _leg_bundled(facets, route, leg, work):
    """Fill the bundle with the rays of one leg of a block, as far as they meet the facets.

    Near the plane of a facet the rays to the block's corners meet it far outside of its rim.
    Returns whether any ray is left.
    """
    span = work.span
    low = work.box.low
    high = work.box.high
    starts = work.points[:, leg]
    ends = work.points[:, leg + 1]
    span_of(starts, ends, span, leg)
    for i in range(3):
        low[i] = np.inf
        high[i] = -np.inf
        for k in range(8):
            low[i] = min(low[i], ends[k, i])
            high[i] = max(high[i], ends[k, i])
    if _bounded_facet(facets, route, leg - 1) and not _cut(
        facets, route[leg - 1], span.low_start[leg], span.high_start[leg]
    ):
        return False
    if _bounded_facet(facets, route, leg) and not _cut(facets, route[leg], low, high):
        return False
    for i in range(3):
        span.low_way[leg, i] = max(span.low_way[leg, i], low[i] - span.high_start[leg, i])
        span.high_way[leg, i] = min(span.high_way[leg, i], high[i] - span.low_start[leg, i])
    bundle_of(span, leg, work.bundle)
    return True


@INLINED
def _shadow_lists(path, work, depth, parent):
    """Fill the lists at a depth with the triangles that can be in the way of a block.

    Returns their number, or DARK where one convex surface is in the way of all rays, or no ray
    meets all facets.

    parent: the depth of lists that hold them all, or NO_PARENT.
    """
    rows = work.lists.rows
    counts = work.lists.counts
    total = 0
    for leg in range(len(path.route) + 1):
        counts[depth, leg] = 0
        if parent == NO_PARENT or counts[parent, leg] > 0:
            if not _leg_bundled(path.facets, path.route, leg, work):
                return DARK
            older = rows[depth, leg, :0]
            if parent != NO_PARENT:
                older = rows[parent, leg, : counts[parent, leg]]
            counts[depth, leg] = _gather_leg(
                path.occluders, path.route, leg, work.bundle, older, rows[depth, leg]
            )
        total += counts[depth, leg]
        starts = work.points[:, leg]
        ends = work.points[:, leg + 1]
        found = rows[depth, leg, : counts[depth, leg]]
        if dark(path.facets, path.occluders, starts, ends, found):
            return DARK
    return total


@INLINED
def _bounds(path, boxes, begin, end, work):
    """Trace the rays to the corners of the box around blocks, and keep their points.

    The blocks are `begin` to `end`.

    Returns NO_RAY, BOUNDED or UNBOUNDED.
    """
    low = work.box.low
    high = work.box.high
    corner = work.box.corner
    for i in range(3):
        low[i] = np.inf
        high[i] = -np.inf
        for block in range(begin, end):
            low[i] = min(low[i], boxes[block, 0, i])
            high[i] = max(high[i], boxes[block, 1, i])
    if misses(path.facets, path.route, path.station, low, high, work.ray.behind, work.corners):
        return NO_RAY
    most = REACHED
    least = OUTSIDE
    whole = True
    for k in range(8):
        for i in range(3):
            corner[i] = high[i] if (k >> i) & 1 else low[i]
        fault = trace_ray(path.facets, path.route, path.station, corner, work.ray, False)
        # Rays that only end on the wrong side of a facet still bound those between them.
        most = max(most, fault)
        least = min(least, fault)
        whole = whole and (fault == REACHED or fault >= WRONG_SIDE)
        for row in range(len(path.route) + 2):
            for i in range(3):
                work.points[k, row, i] = work.ray.points[row, i]
    if most == least and most != REACHED:
        return NO_RAY
    return BOUNDED if whole else UNBOUNDED


@INNER
def _trace_blocks(path, targets, boxes, block, work, present, first_only):
    """Set present (R, 1) to True where a ray reaches a target, as `trace` does.

    Returns whether any ray does. first_only: stop at the first target that is reached.
    """
    waiting = work.waiting
    waiting.begin[0] = 0
    waiting.end[0] = len(boxes)
    waiting.depth[0] = 0
    waiting.parent[0] = NO_PARENT
    top = 1
    met = False
    while top > 0 and not (met and first_only):
        top -= 1
        begin = waiting.begin[top]
        end = waiting.end[top]
        depth = waiting.depth[top]
        bounds = _bounds(path, boxes, begin, end, work)
        if bounds == NO_RAY:
            continue
        found = 1
        if bounds == BOUNDED:
            found = _shadow_lists(path, work, depth, waiting.parent[top])
            if found == DARK:
                continue
        if found > 0 and end - begin > 1:
            middle = (begin + end) // 2
            parent = depth if bounds == BOUNDED else NO_PARENT
            for half in range(2):
                waiting.begin[top] = middle if half else begin
                waiting.end[top] = end if half else middle
                waiting.depth[top] = depth + 1
                waiting.parent[top] = parent
                top += 1
            continue
        some = targets[begin * block : end * block]
        free = present[begin * block : end * block]
        met = _trace_rays(path, some, work, depth, bounds == BOUNDED, free, first_only) or met
    return met


@PLAIN
def trace(path, targets, boxes, block, present):
    """Set present (R, 1) to True where a ray from the station reaches a target.

    It goes by the facets of a path.

    targets: (R, 1, 3) m; boxes (C, 2, 3): low and high corners around `block` targets each.
    """
    work = _workspace(len(path.occluders.triangles), len(boxes))
    _trace_blocks(path, targets, boxes, block, work, present, False)


@PLAIN
def reaching(facets, occluders, routes, station, targets, boxes, block):
    """Return which routes reach any target, (P,) bool; others as in `trace`.

    routes: (P, 1 or 2), facets from the station on.
    """
    work = _workspace(len(occluders.triangles), len(boxes))
    present = np.empty(targets.shape[:2], np.bool_)
    result = np.zeros(len(routes), np.bool_)
    for p in range(len(routes)):
        path = RayPath(facets, occluders, routes[p], station)
        result[p] = _trace_blocks(path, targets, boxes, block, work, present, True)
    return result
