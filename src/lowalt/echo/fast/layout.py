"""How the points lie in memory for the fast kernel: by part, coordinate by coordinate, padded to whole vectors."""

import math
from typing import NamedTuple

import numpy as np

from lowalt.echo.fast.strip import MULTIPLE, strip_size
from lowalt.echo.scene import EchoScene
from lowalt.machine.jit import LEAN


class Layout(NamedTuple):
    """Points sorted by part. Without rotations every point is a part of its own, and stands at its translation."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray
    """(L + MULTIPLE,) m in the frame of the point's part; zero beyond the last point."""
    amplitude: np.ndarray
    """(padded L,) sqrt(rcs) times the radar's scale and the arrays' peak gain; zero in the padding."""
    parts: np.ndarray
    """(groups,) part of each group: successive points of one part within one strip."""
    starts: np.ndarray
    """(groups + 1,) first point of each group, and the number of points."""
    centres: np.ndarray
    """(groups, 3) m, the middle of each group's bounding box, in its part's frame."""
    radii: np.ndarray
    """(groups,) largest distance of the group's points from its centre (m)."""
    weights: np.ndarray
    strays: np.ndarray
    """(groups,) the points' share of the sum of amplitudes, and that share times their mean distance from the centre
    (m); without rotations the weights (L,) are those of all points."""
    total: float
    """Sum of all amplitudes."""
    root: np.ndarray
    rcs: np.ndarray
    """(padded L,) square roots of the points' cross sections, and these (m2); zero in the padding."""


@LEAN
def _group(points, part, share, strip, x, y, z, starts, parts, centres, radii, weights, strays):
    """Copy the points by coordinate and cut them into groups of one part; returns how many groups there are."""
    count, groups = len(points), 0
    for i in range(count):
        x[i], y[i], z[i] = points[i, 0], points[i, 1], points[i, 2]
        if i == 0 or part[i] != part[i - 1] or i % strip == 0:
            starts[groups], parts[groups] = i, part[i]
            groups += 1
    starts[groups] = count
    for group in range(groups):
        for j in range(3):
            low = high = points[starts[group], j]
            for i in range(starts[group], starts[group + 1]):
                low, high = min(low, points[i, j]), max(high, points[i, j])
            centres[group, j] = 0.5 * (low + high)
        widest = weights[group] = strays[group] = 0.0
        for i in range(starts[group], starts[group + 1]):
            a, b, c = (
                points[i, 0] - centres[group, 0],
                points[i, 1] - centres[group, 1],
                points[i, 2] - centres[group, 2],
            )
            square = a * a + b * b + c * c
            widest = max(widest, square)
            weights[group] += share[i]
            strays[group] += share[i] * math.sqrt(square)
        radii[group] = math.sqrt(widest)
    return groups


def layout(scene: EchoScene, peak: float) -> Layout:
    """Return the points' layout; `peak` multiplies the square roots of their cross sections."""
    rigid = scene.rotation.shape[0] > 0
    count = len(scene.points) if rigid else scene.translation.shape[1]
    if rigid and (scene.part[1:] < scene.part[:-1]).any():
        order = np.argsort(scene.part, kind="stable")
        points, part = scene.points[order], scene.part[order]
        root, rcs = scene.root_rcs[order], scene.rcs_m2[order]
    else:
        points, part, root, rcs = scene.points, scene.part, scene.root_rcs, scene.rcs_m2
    amplitude, padded_root, padded_rcs = np.zeros((3, max(-(-count // MULTIPLE), 1) * MULTIPLE))
    amplitude[:count], padded_root[:count], padded_rcs[:count] = root * peak, root, rcs
    total = float(amplitude.sum())
    share = amplitude / total if total > 0 else amplitude
    empty = np.zeros(0)
    if not rigid:
        nothing = np.zeros(0, np.int64)
        return Layout(
            empty, empty, empty, amplitude, nothing, nothing, np.zeros((0, 3)), empty, share[:count], empty,
            total, padded_root, padded_rcs,
        )  # fmt: skip
    # Groups are moved in whole multiples of MULTIPLE points, so the arrays go on beyond the last point.
    x, y, z = np.zeros((3, count + MULTIPLE))
    starts, parts = np.empty(count + 1, np.int64), np.empty(count, np.int64)
    centres, (radii, weights, strays) = np.empty((count, 3)), np.empty((3, count))
    groups = _group(
        points, part, share, strip_size(len(amplitude)), x, y, z, starts, parts, centres, radii, weights, strays
    )
    return Layout(
        x,
        y,
        z,
        amplitude,
        parts[:groups],
        starts[: groups + 1],
        centres[:groups],
        radii[:groups],
        weights[:groups],
        strays[:groups],
        total,
        padded_root,
        padded_rcs,
    )
