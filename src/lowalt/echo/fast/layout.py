"""Memory layout of the points for the fast kernel.

They are sorted by part, one array per coordinate, padded to full vectors.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.echo.echo_input import EchoInput
from lowalt.echo.fast.strip import MULTIPLE, strip_size
from lowalt.echo.radar import Radar
from lowalt.machine.jit import LEAN


class Groups(NamedTuple):
    """Groups (G,) of successive points of one part within one strip; none without rotations.

    parts: part of each; starts: (G + 1,) first point of each, and the number of points; centres:
    (G, 3) m, the middle of each group's bounding box, in its part's frame; radii: largest distance
    of the group's points from it (m).
    weights, strays: the points' share of the sum of amplitudes, and that share times their mean
    distance from the centre (m); without rotations the weights (L,) are those of all points.
    """

    parts: np.ndarray
    starts: np.ndarray
    centres: np.ndarray
    radii: np.ndarray
    weights: np.ndarray
    strays: np.ndarray


class Layout(NamedTuple):
    """Points sorted by part.

    Without rotations every point is its own part, and its translation is its position.

    coordinates: x, y, z (L + MULTIPLE,) m in the frame of the point's part, zero beyond the last
    point; amplitude: (padded L,) sqrt(rcs) times the radar's scale and the arrays' peak gain, zero
    in the padding; total: the sum of all amplitudes; root, rcs: (padded L,) square roots of the
    points' cross sections, and these (m2), zero in the padding.
    """

    coordinates: tuple[np.ndarray, np.ndarray, np.ndarray]
    groups: Groups
    amplitude: np.ndarray
    total: float
    root: np.ndarray
    rcs: np.ndarray


class EchoSample(NamedTuple):
    """One target in motion as the kernels see it from one station.

    first: part (or point, without rotations) whose translation is the reference; aims: the beams'
    direction cosines.
    """

    scene: EchoInput
    lay: Layout
    radar: Radar
    first: int
    aims: tuple[float, float]


@LEAN
def _group(points, part, share, strip, coordinates, groups):
    """Copy the points by coordinate, split them into groups within one part.

    Returns the number of groups.
    """
    x, y, z = coordinates
    starts = groups.starts
    centres = groups.centres
    weights = groups.weights
    strays = groups.strays
    count = len(points)
    number = 0
    for i in range(count):
        x[i] = points[i, 0]
        y[i] = points[i, 1]
        z[i] = points[i, 2]
        if i == 0 or part[i] != part[i - 1] or i % strip == 0:
            starts[number] = i
            groups.parts[number] = part[i]
            number += 1
    starts[number] = count
    for group in range(number):
        for j in range(3):
            low = high = points[starts[group], j]
            for i in range(starts[group], starts[group + 1]):
                low = min(low, points[i, j])
                high = max(high, points[i, j])
            centres[group, j] = 0.5 * (low + high)
        widest = weights[group] = strays[group] = 0.0
        for i in range(starts[group], starts[group + 1]):
            a = x[i] - centres[group, 0]
            b = y[i] - centres[group, 1]
            c = z[i] - centres[group, 2]
            square = a * a + b * b + c * c
            widest = max(widest, square)
            weights[group] += share[i]
            strays[group] += share[i] * math.sqrt(square)
        groups.radii[group] = math.sqrt(widest)
    return number


def layout(scene: EchoInput, peak: float) -> Layout:
    """Return the points' layout; `peak` multiplies the square roots of their cross sections."""
    rigid = scene.rotation.shape[0] > 0
    count = len(scene.points) if rigid else scene.translation.shape[1]
    points = scene.points
    part = scene.part
    root = scene.root_rcs
    rcs = scene.rcs_m2
    if rigid and (part[1:] < part[:-1]).any():
        order = np.argsort(part, kind="stable")
        points = points[order]
        part = part[order]
        root = root[order]
        rcs = rcs[order]
    padded = max(-(-count // MULTIPLE), 1) * MULTIPLE
    amplitude, padded_root, padded_rcs = np.zeros((3, padded))
    amplitude[:count] = root * peak
    padded_root[:count] = root
    padded_rcs[:count] = rcs
    total = float(amplitude.sum())
    share = amplitude
    if total > 0:
        share = amplitude / total
    # Without rotations there are no groups, and the weights are those of all points.
    room = 0
    if rigid:
        room = count
    groups = Groups(
        parts=np.zeros(room, np.int64),
        starts=np.zeros(room + 1, np.int64),
        centres=np.empty((room, 3)),
        radii=np.empty(room),
        weights=np.empty(room),
        strays=np.empty(room),
    )
    # Loops process MULTIPLE points at a time, so the arrays extend beyond the last point.
    x, y, z = np.zeros((3, room + MULTIPLE))
    if rigid:
        number = _group(points, part, share, strip_size(padded), (x, y, z), groups)
        groups = Groups(
            parts=groups.parts[:number],
            starts=groups.starts[: number + 1],
            centres=groups.centres[:number],
            radii=groups.radii[:number],
            weights=groups.weights[:number],
            strays=groups.strays[:number],
        )
    else:
        groups = groups._replace(weights=share[:count])
    return Layout((x, y, z), groups, amplitude, total, padded_root, padded_rcs)
