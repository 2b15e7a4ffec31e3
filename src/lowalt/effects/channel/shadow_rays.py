"""Which points of a target a station cannot see: exact ray casting in the frames of the target's own parts.

In a part's frame its triangles stand still, and the ray from a point to the station turns slowly, or along the same
circle turn by turn. The rays of all points that meet the body, whose frame turns slowly, find their few triangles in a
grid (`ray_grid`), and its own points are judged for many symbols at once (`still_rays`). Points of parts that turn,
swing or roll are held against their own part in the order of its azimuths (`turning_rays`). Where neither can be done,
directions are sorted into cells: the triangles of its own part that any ray of a cell can meet are found once for a
point, by a tree of balls (`surface_tree`), and kept. Rotors turn too far from symbol to symbol for that. All other
triangles are found by the tree ray by ray. A point is compared first with the triangle that hid it a symbol ago.
"""

import numpy as np

from lowalt.common.jit import INLINED, INNER, LEAN
from lowalt.echo import Rigid
from lowalt.effects.channel import ray_grid, turning_rays
from lowalt.effects.channel.ray_grid import RayGrid, cell_of
from lowalt.effects.channel.ray_lists import Lists, kept
from lowalt.effects.channel.ray_tests import crosses, first_hit, hit
from lowalt.effects.channel.still_rays import FREE, HIDDEN, SYMBOLS, judged
from lowalt.effects.channel.surface_tree import Tree

STEPS, FINEST, COARSEST = 3.0, 0.02, 0.15
"""Cells of direction along a part's way through them, and their least and largest size (rad)."""
SLOW = 8e-3
"""Largest mean turn of the direction to the station, from symbol to symbol (rad), at which a part gets a grid."""


@INLINED
def _through(tree, p, x, y, z, u, v, w):
    """A triangle of part p that the ray from x, y, z along u, v, w meets, -1 without one."""
    node, end = tree.root[p], tree.skip[tree.root[p]]
    while node < end:
        if not crosses(tree, node, x, y, z, u, v, w):
            node = tree.skip[node]
            continue
        f = tree.face[node]
        if f >= 0 and hit(tree, f, x, y, z, u, v, w):
            return f
        node += 1
    return -1


@INLINED
def _ball_ahead(centre, radius, x, y, z, a, b, c, square):
    """Whether the ray from x, y, z along a, b, c, `square` the square of its length, can meet a ball."""
    u, v, w = centre[0] - x, centre[1] - y, centre[2] - z
    along, rest = u * a + v * b + w * c, u * u + v * v + w * w - radius * radius
    return rest <= 0.0 or (along >= 0.0 and rest * square <= along * along * (1.0 + 1e-9))


@INLINED
def _placed(rotation, translation, x, y, z):
    """A place of a part's frame in the global frame."""
    return (
        rotation[0, 0] * x + rotation[0, 1] * y + rotation[0, 2] * z + translation[0],
        rotation[1, 0] * x + rotation[1, 1] * y + rotation[1, 2] * z + translation[1],
        rotation[2, 0] * x + rotation[2, 1] * y + rotation[2, 2] * z + translation[2],
    )


@INLINED
def _in_part(rotation, translation, x, y, z):
    """A place of the global frame in a part's frame."""
    a, b, c = x - translation[0], y - translation[1], z - translation[2]
    return (
        rotation[0, 0] * a + rotation[1, 0] * b + rotation[2, 0] * c,
        rotation[0, 1] * a + rotation[1, 1] * b + rotation[2, 1] * c,
        rotation[0, 2] * a + rotation[1, 2] * b + rotation[2, 2] * c,
    )


@INNER
def _balls(rotation, translation, tree, order, balls):
    """Fill balls (P, 3) with the places of the balls around all triangles of the parts `order`, in the global frame."""
    for turn in range(len(order)):
        p = order[turn]
        at = tree.centre[tree.root[p]]
        balls[p, 0], balls[p, 1], balls[p, 2] = _placed(rotation[p], translation[p], at[0], at[1], at[2])


@LEAN
def cast(
    place, station, rotation, translation, part, points, toward, vertices, tree, order, gridded, grid, listed, cells,
    lists, work, balls, verdicts, done, found,
):  # fmt: skip
    """Set found (N, L) where one of the parts `order` hides the point; points found already are not asked.

    place (3,) m: the station, and station (N, P, 3) m: the same in each part's frame; rotation (N, P, 3, 3),
    translation (N, P, 3); points (L, 3) m, in their part's frame; toward (L,): share of the way to the station by which
    a point is moved; gridded: the part of `grid`; listed (P,): whether a part's lists are kept for its own points;
    cells (P,): cells of direction along a cube's side; work: (L,) int64, filled with -1; balls: work, (P, 3);
    verdicts (B, L): those of `still_rays`; done (L,): points whose own part has been asked.
    """
    for n in range(rotation.shape[0]):
        _balls(rotation[n], translation[n], tree, order, balls)
        for l in range(len(points)):  # noqa: E741
            verdict = verdicts[n // SYMBOLS, l]
            if found[n, l] or (verdict == FREE and len(order) == 1):
                continue
            own, last = part[l], work[l]
            x, y, z = points[l, 0], points[l, 1], points[l, 2]
            x += toward[l] * (station[n, own, 0] - x)
            y += toward[l] * (station[n, own, 1] - y)
            z += toward[l] * (station[n, own, 2] - z)
            g0, g1, g2 = _placed(rotation[n, own], translation[n, own], x, y, z)
            d0, d1, d2 = place[0] - g0, place[1] - g1, place[2] - g2
            square = d0 * d0 + d1 * d1 + d2 * d2
            for turn in range(-1, len(order)):
                if turn < 0 and last < 0:
                    continue
                p = tree.owner[last] if turn < 0 else order[turn]
                if p == own and (verdict == FREE or done[l]):
                    continue
                i, j, k = x, y, z
                if p != own:
                    radius = tree.radius_m[tree.root[p]]
                    if turn >= 0 and not _ball_ahead(balls[p], radius, g0, g1, g2, d0, d1, d2, square):
                        continue
                    i, j, k = _in_part(rotation[n, p], translation[n, p], g0, g1, g2)
                u, v, w = station[n, p, 0] - i, station[n, p, 1] - j, station[n, p, 2] - k
                if turn < 0:
                    if hit(tree, last, i, j, k, u, v, w):
                        found[n, l] = True
                        break
                    continue
                m = n // grid.symbols
                cell = cell_of(grid, m, i, j, k, u, v, w) if p == gridded else -2
                if cell == -1 or (cell == -2 and not crosses(tree, tree.root[p], i, j, k, u, v, w)):
                    continue
                if cell >= 0:
                    first, past = grid.start[m, cell], grid.start[m, cell + 1]
                    f = first_hit(tree, grid.pool[m], first, past, i, j, k, u, v, w)
                elif p == own and listed[p]:
                    f = kept(vertices, tree, lists, p, l, cells[p], i, j, k, u, v, w)
                else:
                    f = _through(tree, p, i, j, k, u, v, w)
                if f >= 0:
                    found[n, l] = True
                    work[l] = f
                    break


def cast_rays(
    place_m: np.ndarray, motion: Rigid, toward: np.ndarray, vertices: np.ndarray, tree: Tree, rotors: list[int],
    asked: np.ndarray | None = None, known: np.ndarray | None = None, axes: np.ndarray | None = None,
) -> np.ndarray:  # fmt: skip
    """Return whether a triangle hides each point from the station at `place_m` (3,), (N, L) bool.

    motion: poses, and points off their own surface (L, 3), each in its part's frame (m); toward (L,): share of the way
    to the station by which a point is moved instead, where it has no normal; vertices (V, 3) m; rotors: parts that turn
    far from symbol to symbol; asked: parts whose triangles count, None for all; known: points (N, L) bool that are
    hidden already; axes (P, 3): what turning parts turn about, in their frames, NaN for others. Of a closed surface
    with outward normals, the side turned to the station alone hides all.
    """
    rotation, translation, points, part = motion
    rotation, translation = np.ascontiguousarray(rotation), np.ascontiguousarray(translation)
    points, vertices, part = np.ascontiguousarray(points), np.ascontiguousarray(vertices), np.asarray(part, np.int64)
    away = place_m - translation
    # The poses' matrices are rotations: their inverses are their transposes.
    station = sum((rotation[:, :, row, :] * away[:, :, row, None] for row in range(3)), np.zeros(away.shape))
    ahead = station / np.sqrt((station * station).sum(axis=2))[..., None]
    turned = np.sqrt((np.ptp(ahead, axis=0) ** 2).sum(axis=1))
    cells = np.ceil(2.0 / np.clip(turned / STEPS, FINEST, COARSEST)).astype(np.int64)
    order = np.flatnonzero(tree.root >= 0)
    order = order if asked is None else order[np.isin(order, asked)]
    listed = ~np.isin(np.arange(len(tree.root)), rotors)
    gridded, grid = _grid(ahead, station, vertices, tree, order[listed[order]])
    found = np.zeros((len(rotation), len(points)), np.bool_) if known is None else known.copy()
    turning = [int(p) for p in order if p != gridded and axes is not None and np.isfinite(axes[p]).all()]
    done = turning_rays.cast(station, axes, turning, points, part, toward, vertices, tree, found)
    own = np.ascontiguousarray(station[:, gridded])
    verdicts = judged(vertices, tree, gridded, grid, own, points, part, toward)
    found |= np.repeat(verdicts == HIDDEN, SYMBOLS, axis=0)[: len(found)]
    cast(
        np.asarray(place_m, np.float64), station, rotation, translation, part, points, toward, vertices, tree, order,
        gridded, grid, listed, cells, Lists.empty(len(tree.skip)), np.full(len(points), -1), np.empty((len(listed), 3)),
        verdicts, done, found,
    )  # fmt: skip
    return found


def _grid(
    ahead: np.ndarray, station: np.ndarray, vertices: np.ndarray, tree: Tree, parts: np.ndarray
) -> tuple[int, RayGrid]:
    """The part of `parts` that gets a grid, and the grid: the one of most triangles that turns slowly; -1 for none.

    ahead (N, P, 3): directions to the station in each part's frame.
    """
    steps = np.sqrt((np.diff(ahead, axis=0) ** 2).sum(axis=2))
    slow = [int(p) for p in parts if len(steps) and steps[:, p].mean() <= SLOW]
    if not slow:
        return -1, ray_grid.NONE
    p = max(slow, key=lambda one: int(tree.count[one]))
    return p, ray_grid.grids(np.ascontiguousarray(station[:, p]), vertices, tree, p)
