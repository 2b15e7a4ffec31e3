"""How the points lie in memory for the fast kernel: by part, coordinate by coordinate, padded to whole vectors."""

import math
from typing import NamedTuple

import numpy as np

from lowalt.common.jit import LEAN
from lowalt.echo.fast.vector_loops import LANES, chunk_of
from lowalt.echo.scene import Scene


class Layout(NamedTuple):
    """Points sorted by part. Where there are no rotations every point is a part of its own at its translation."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    """(L + LANES,) m in the frame of the point's part; zero beyond the last point."""
    amplitude: np.ndarray
    """(padded L,) sqrt(rcs) times the radar's scale and the arrays' peak gain; zero in the padding."""
    parts: np.ndarray
    """(runs,) part of each run of points."""
    starts: np.ndarray
    """(runs + 1,) first point of each run; no run crosses a tile's end."""
    centres: np.ndarray
    """(runs, 3) m, the middle of each run's bounding box, in its part's frame."""
    radii: np.ndarray
    """(runs,) largest distance of the run's points from its centre (m)."""
    total: float
    """Sum of all amplitudes."""


@LEAN
def _runs(points, part, chunk, x, y, z, starts, parts, centres, radii):
    """Copy the points by coordinate and cut them into runs of one part; returns how many runs there are."""
    count, runs = len(points), 0
    for i in range(count):
        x[i], y[i], z[i] = points[i, 0], points[i, 1], points[i, 2]
        if i == 0 or part[i] != part[i - 1] or i % chunk == 0:
            starts[runs], parts[runs] = i, part[i]
            runs += 1
    starts[runs] = count
    for run in range(runs):
        for j in range(3):
            low = high = points[starts[run], j]
            for i in range(starts[run], starts[run + 1]):
                low, high = min(low, points[i, j]), max(high, points[i, j])
            centres[run, j] = 0.5 * (low + high)
        widest = 0.0
        for i in range(starts[run], starts[run + 1]):
            a, b, c = points[i, 0] - centres[run, 0], points[i, 1] - centres[run, 1], points[i, 2] - centres[run, 2]
            widest = max(widest, a * a + b * b + c * c)
        radii[run] = math.sqrt(widest)
    return runs


def layout(scene: Scene, peak: float) -> Layout:
    """Return the points' layout; `peak` multiplies the square roots of their cross sections."""
    rigid = scene.rotation.shape[0] > 0
    count = len(scene.points) if rigid else scene.translation.shape[1]
    if rigid and (scene.part[1:] < scene.part[:-1]).any():
        order = np.argsort(scene.part, kind="stable")
        points, part, root = scene.points[order], scene.part[order], scene.root_rcs[order]
    else:
        points, part, root = scene.points, scene.part, scene.root_rcs
    amplitude = np.zeros(max(-(-count // LANES), 1) * LANES)
    amplitude[:count] = root * peak
    empty = np.zeros(0)
    if not rigid:
        nothing = np.zeros(0, np.int64)
        return Layout(
            empty, empty, empty, amplitude, nothing, nothing, np.zeros((0, 3)), empty, float(amplitude.sum())
        )  # fmt: skip
    # Runs are placed in whole vectors: what is read beyond the last point must be there.
    x, y, z = np.zeros((3, count + LANES))
    starts, parts = np.empty(count + 1, np.int64), np.empty(count, np.int64)
    centres, radii = np.empty((count, 3)), np.empty(count)
    runs = _runs(points, part, chunk_of(len(amplitude)), x, y, z, starts, parts, centres, radii)
    total = float(amplitude.sum())
    return Layout(x, y, z, amplitude, parts[:runs], starts[: runs + 1], centres[:runs], radii[:runs], total)
