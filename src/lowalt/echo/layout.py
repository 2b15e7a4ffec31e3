"""How the points lie in memory for the fast kernel: by part, coordinate by coordinate, padded to whole vectors."""

from typing import NamedTuple

import numpy as np

from lowalt.echo.lanes import LANES, chunk_of
from lowalt.echo.motion import Scene


class Layout(NamedTuple):
    """Points sorted by part. Where there are no rotations every point is a part of its own at its translation."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    """(L,) m in the frame of the point's part."""
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


def layout(scene: Scene, peak: float) -> Layout:
    """Return the points' layout; `peak` multiplies the square roots of their cross sections."""
    rigid = scene.rotation.shape[0] > 0
    count = len(scene.points) if rigid else scene.translation.shape[1]
    if rigid and (scene.part[1:] < scene.part[:-1]).any():
        order = np.argsort(scene.part, kind="stable")
        points, part, root = scene.points[order], scene.part[order], scene.root_rcs[order]
    else:
        points, part, root = scene.points, scene.part, scene.root_rcs
    amplitude = np.zeros(-(-count // LANES) * LANES)
    amplitude[:count] = root * peak
    empty = np.zeros(0)
    if not rigid:
        nothing = np.zeros(0, np.int64)
        return Layout(
            empty, empty, empty, amplitude, nothing, nothing, np.zeros((0, 3)), empty, float(amplitude.sum())
        )  # fmt: skip
    fresh = np.ones(count, np.bool_)
    np.not_equal(part[1:], part[:-1], out=fresh[1:])
    fresh[:: chunk_of(len(amplitude))] = True
    starts = np.flatnonzero(fresh)
    centres = (np.maximum.reduceat(points, starts) + np.minimum.reduceat(points, starts)) / 2
    away = points - centres[np.cumsum(fresh) - 1]
    radii = np.sqrt(np.maximum.reduceat(np.einsum("li,li->l", away, away), starts))
    x, y, z = np.ascontiguousarray(points.T)
    bounds = np.append(starts, count)
    return Layout(x, y, z, amplitude, part[starts], bounds, centres, radii, float(amplitude.sum()))
