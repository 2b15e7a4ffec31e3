"""Distances between subtypes of a category: is an easy unseen subtype nearly a trained one?

A subtype is represented by the points that its cloud sweeps over one cycle (a turn, a beat, a
recording) in its own frame: shape and own motion, which together cause the micro-Doppler. Each set
of points is centred and divided by its root mean square radius; the energy distance of two sets
then compares their form, and the ratio of their radii is given as the ratio of size. The energy
distance is a metric, is zero for equal distributions only, needs no correspondence and no grid, and
changes little by one stray point, unlike the Hausdorff distance (Szekely and Rizzo, J. Stat. Plan.
Inference 143, 2013).

distances.csv, one row per subtype:
    category, subtype, group
    nearest, distance, size_ratio
        the nearest other subtype of the category
    nearest_trained, trained_distance, trained_size_ratio
        the same among the subtypes of the group seen, on which the unseen protocol trains; of a
        trained subtype, another one
"""

from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.spatial.distance import cdist

from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.motion import positions
from lowalt.motion.table import PATH
from lowalt.targets.cloud import Cloud

COLUMNS = (
    "category",
    "subtype",
    "group",
    "nearest",
    "distance",
    "size_ratio",
    "nearest_trained",
    "trained_distance",
    "trained_size_ratio",
)
INSTANTS = 16
POINTS = 1200


def still_row(row: dict) -> dict:
    """Return the motion row with the parts' own motion only: no position, velocity or attitude."""
    names = ("x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps", "yaw_rad", "pitch_rad", "roll_rad")
    result = dict(row)
    for name in (*names, *PATH):
        if name in result:
            result[name] = 0.0
    return result


def cycle_s(cloud: Cloud, row: dict) -> float:
    """Return the time of one cycle (s): a turn, a beat, or the whole recording.

    It is a second where nothing turns.
    """
    if len(cloud.track):
        return len(cloud.track) / cloud.record["track_rate_hz"] / row["playback"]
    if row["rate_hz"] > 0:
        return 1.0 / row["rate_hz"]
    return 1.0


def swept(cloud: Cloud, row: dict) -> np.ndarray:
    """Points (at most 1200, 3) m that a cloud sweeps over one cycle in its own frame.

    They are taken evenly from all points.
    """
    times = np.arange(INSTANTS) / INSTANTS * cycle_s(cloud, row)
    points = positions(cloud, still_row(row), times).reshape(-1, 3)
    return points[np.linspace(0, len(points) - 1, min(POINTS, len(points))).round().astype(int)]


def energy_distance(first: np.ndarray, second: np.ndarray) -> float:
    """Return the energy distance of two point sets (n, 3) and (m, 3), in their unit.

    sqrt(2 E|X - Y| - E|X - X'| - E|Y - Y'|), over all pairs. Source: Szekely and Rizzo 2013, Eq. 6.
    """
    square = (
        2 * cdist(first, second).mean() - cdist(first, first).mean() - cdist(second, second).mean()
    )
    return float(np.sqrt(max(square, 0.0)))


def form(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return points (n, 3) centred and divided by their root mean square radius, and that (m).

    Raises: InputError where all points coincide.
    """
    centred = points - points.mean(0)
    radius = float(np.sqrt((centred**2).sum(1).mean()))
    if not radius > 0:
        raise InputError(f"distances: {len(points)} points that are all one have no form")
    return centred / radius, radius


def rows(clouds: list[Cloud], motion: list[dict]) -> list[list]:
    """Return the rows of distances.csv by category and subtype.

    motion: at least one row of every subtype.
    Raises: InputError for a cloud without a motion row.
    """
    first: dict[str, dict] = {}
    for row in motion:
        first.setdefault(row["subtype"], row)
    lacking = [cloud.subtype for cloud in clouds if cloud.subtype not in first]
    if lacking:
        raise InputError(f"distances: no motion row of {lacking}")
    forms = {cloud.subtype: form(swept(cloud, first[cloud.subtype])) for cloud in clouds}
    lines = []
    for category in dict.fromkeys(cloud.category for cloud in clouds):
        names = sorted(cloud.subtype for cloud in clouds if cloud.category == category)
        apart = {}
        for a, b in combinations(names, 2):  # Names are sorted, so that a < b.
            apart[a, b] = energy_distance(forms[a][0], forms[b][0])
        for name in names:
            line = [category, name, first[name]["group"]]
            for trained in (False, True):
                others = [other for other in names if other != name]
                if trained:
                    others = [other for other in others if first[other]["group"] == "seen"]
                near = min(
                    others,
                    key=lambda other: (apart[min(name, other), max(name, other)], other),
                    default=None,
                )
                if near is None:
                    line += ["", "", ""]
                    continue
                sizes = sorted((forms[name][1], forms[near][1]))
                line += [
                    near,
                    f"{apart[min(name, near), max(name, near)]:.4f}",
                    f"{sizes[1] / sizes[0]:.3f}",
                ]
            lines.append(line)
    return lines


def write(out: str | Path, lines: list[list]) -> None:
    """Write distances.csv."""
    write_csv(out, COLUMNS, lines)
