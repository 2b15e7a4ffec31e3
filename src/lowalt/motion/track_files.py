"""The path of a flight log: a CSV table of times and places, resampled at the starts of looks.

Columns time_s, x_m, y_m, z_m; or time_s, lat, lon, alt, in degrees and metres above ground: the
first row lies in the middle of the cell, +x is east, +y north.
"""

import math
from pathlib import Path
from typing import Literal

import numpy as np

from lowalt.files.csv_tables import read_csv
from lowalt.files.errors import InputError
from lowalt.motion.tracks import Cell, LookStarts
from lowalt.numerics import portable

METRES = ("time_s", "x_m", "y_m", "z_m")
DEGREES = ("time_s", "lat", "lon", "alt")
SEMI_MAJOR_M = 6378137.0
ECCENTRICITY_2 = 0.00669437999014
"""The ellipsoid WGS 84: semi-major axis, and square of the first eccentricity."""
SLOWEST_MPS = 0.5
"""Speed over ground below which a course says nothing; the heading stays."""


def path_of(motion: dict, corners: np.ndarray, masts_m: np.ndarray) -> LookStarts | None:
    """Return the path of a flight log at the starts of looks, None where `motion` names no log.

    motion: the block of the configuration, whose key `track` names the log; corners (K, 2), masts_m
    (S, 2): as of `Cell`. Velocities at the log's rows are differences of its positions (second
    order), and cubics join the rows. The heading is the course.
    Raises: InputError naming the file, and the line, column or position that is wrong.
    """
    if "track" not in motion:
        return None
    path = motion["track"]
    looks = motion["looks"]
    look_s = motion["look_s"]
    cell = Cell(corners, masts_m, motion["region"]["mast_clearance_m"])
    times_s, positions_m = _numbers(path, cell)
    long_s = times_s[-1] - times_s[0]
    if long_s < looks * look_s * (1 - 1e-9):
        raise InputError(
            f"{path}: {long_s:g} s long, expected {looks * look_s:g} s for motion.looks {looks}"
        )
    starts_s = times_s[0] + look_s * np.arange(looks + 1)
    start_m, velocity_mps = _resampled(times_s, positions_m, starts_s)
    outside = np.flatnonzero(cell.room_m(start_m[:, :2]) <= 0)
    if len(outside):
        x, y, _ = start_m[outside[0]]
        raise InputError(
            f"{path}: {outside[0] * look_s:g} s after its start at ({x:.1f}, {y:.1f}) m, outside "
            f"the cell; expected a place in motion.region, at least {cell.clearance_m:g} m from "
            "all stations"
        )
    return LookStarts(start_m, velocity_mps, _headings(velocity_mps))


def _numbers(path: str | Path, cell: Cell) -> tuple[np.ndarray, np.ndarray]:
    """Times (R,) s and positions (R, 3) m of a log's rows."""
    rows = read_csv(path, "time_s", what="track")
    columns = list(rows[0]) if rows else []
    named = DEGREES
    if set(METRES) <= set(columns):
        named = METRES
    if len(rows) < 2 or not set(named) <= set(columns):
        raise InputError(
            f"{path}: {len(rows)} rows of the columns {columns}, expected two or more of "
            f"{list(METRES)} or {list(DEGREES)}"
        )
    numbers = []
    for line, row in enumerate(rows, start=2):  # Line 1 is the header.
        numbers.append([_number(path, line, name, row[name]) for name in named])
    values = np.array(numbers)
    back = np.flatnonzero(np.diff(values[:, 0]) <= 0)
    if len(back):
        line = int(back[0])
        raise InputError(
            f"{path}, line {line + 3}, column time_s: {values[line + 1, 0]:g} after "
            f"{values[line, 0]:g}, expected times that increase"
        )
    positions = values[:, 1:]
    if named == DEGREES:
        positions = _flat(positions, cell.corners.mean(axis=0))
    return values[:, 0], positions


def _number(path: str | Path, line: int, column: str, text: str) -> float:
    """The number of a cell."""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise InputError(f"{path}, line {line}, column {column}: {text!r}, expected a number")
    return number


def _flat(degrees: np.ndarray, middle_m: np.ndarray) -> np.ndarray:
    """Positions (R, 3) m of rows (R, 3) of latitude, longitude (degrees) and height (m).

    They lie on the plane that touches WGS 84 at the first row, which is at `middle_m` (2,).
    """
    latitude, longitude, height = degrees.T
    sine, cosine = portable.sine_cosine(math.radians(latitude[0]))
    square = 1.0 - ECCENTRICITY_2 * float(sine) ** 2
    across_m = SEMI_MAJOR_M / math.sqrt(square)
    along_m = across_m * (1.0 - ECCENTRICITY_2) / square
    east = (longitude - longitude[0] + 180.0) % 360.0 - 180.0
    x = np.radians(east) * across_m * cosine
    y = np.radians(latitude - latitude[0]) * along_m
    return np.stack([middle_m[0] + x, middle_m[1] + y, height], axis=1)


def _resampled(
    times_s: np.ndarray, positions_m: np.ndarray, wanted_s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities (N, 3) at the times wanted, on cubics between the rows."""
    order: Literal[1, 2] = 2 if len(times_s) > 2 else 1
    velocities = np.gradient(positions_m, times_s, axis=0, edge_order=order)
    first = np.clip(np.searchsorted(times_s, wanted_s, side="right") - 1, 0, len(times_s) - 2)
    step = (times_s[first + 1] - times_s[first])[:, None]
    u = (wanted_s - times_s[first])[:, None] / step
    a = positions_m[first]
    b = positions_m[first + 1]
    m = step * velocities[first]
    n = step * velocities[first + 1]
    second = 3 * (b - a) - 2 * m - n
    third = m + n - 2 * (b - a)
    wanted_m = a + u * (m + u * (second + u * third))
    wanted_mps = (m + u * (2 * second + 3 * u * third)) / step
    return wanted_m, wanted_mps


def _headings(velocity_mps: np.ndarray) -> np.ndarray:
    """Yaw (N,) rad along the course.

    Where the target is slow, it is that before, at first the next one, and 0 if it is never fast.
    """
    x, y, _ = velocity_mps.T
    heading = portable.arctan2(-x, y)
    fast = np.flatnonzero(portable.norm(velocity_mps[:, :2]) >= SLOWEST_MPS)
    if not len(fast):
        return np.zeros(len(x))
    last = np.searchsorted(fast, np.arange(len(x)), side="right") - 1
    return heading[fast[np.maximum(last, 0)]]
