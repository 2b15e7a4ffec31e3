"""Tracks: motion models that are looked at again and again, on a drawn path or a flight log's.

The path of a look is the cubic with the positions and velocities of both its ends, and its heading
turns at a constant rate. Position, velocity, heading, rotors, wheels, wings and gait therefore
continue from look to look without a jump.
"""

import math
from typing import NamedTuple

import numpy as np

from lowalt.config.classes import AIRBORNE
from lowalt.files.errors import InputError
from lowalt.motion.drawing import draw, follow_speed, heights, position_in
from lowalt.motion.rotations import turns
from lowalt.motion.table import PATH, SCALE
from lowalt.numerics import portable
from lowalt.numerics.streams import stream
from lowalt.targets.cloud import Cloud

TURN_RADPS = math.radians(20.0)
"""Largest heading rate of a drawn path, to either side."""
DRAWS = 20
"""A look whose heading rate was drawn this often in vain turns back."""
MOST_BEGINNINGS = 1000
"""How often the beginning of a track is drawn before the region is found to be too small."""


class LookStarts(NamedTuple):
    """A path at the starts of its looks and at the end of the last one.

    position_m: (L + 1, 3) m; velocity_mps: (L + 1, 3) m/s; heading_rad: (L + 1,) rad, the yaw.
    """

    position_m: np.ndarray
    velocity_mps: np.ndarray
    heading_rad: np.ndarray


class Cell(NamedTuple):
    """Where targets may be: inside a convex region and away from masts.

    corners: (K, 2) m of the region, counter-clockwise; clearance_m: least distance from each of
    masts_m, (S, 2) m.
    """

    corners: np.ndarray
    masts_m: np.ndarray
    clearance_m: float

    def room_m(self, positions_m: np.ndarray) -> np.ndarray:
        """Return how far positions (N, 2) m are from leaving the cell: (N,) m, negative outside."""
        side = np.roll(self.corners, -1, axis=0) - self.corners
        turned = np.stack([-side[:, 1], side[:, 0]], axis=1)
        inward = turned / portable.norm(side)[:, None]
        to_sides = portable.dot(positions_m[:, None] - self.corners, inward)
        to_masts = portable.norm(positions_m[:, None] - self.masts_m.reshape(-1, 2))
        return np.concatenate([to_sides, to_masts - self.clearance_m], axis=1).min(axis=1)


def turned(
    position_m: np.ndarray, velocity_mps: np.ndarray, rate: float, times_s: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity (N, 2) in a coordinated turn at the `times_s` (N,).

    Speed and heading rate `rate` (rad/s, not 0) are constant.
    Source: Li and Jilkov, Survey of maneuvering target tracking, part I, IEEE Trans. AES 39, 2003,
    section V-A.
    """
    sine, cosine = portable.sine_cosine(rate * times_s)
    sine = sine[:, None]
    cosine = cosine[:, None]
    left = np.array([-velocity_mps[1], velocity_mps[0]])
    moved_m = position_m + sine / rate * velocity_mps + (1.0 - cosine) / rate * left
    return moved_m, cosine * velocity_mps + sine * left


def _way_back(cell: Cell, position_m: np.ndarray, velocity_mps: np.ndarray) -> float:
    """The heading rate, TURN_RADPS to a side, whose full circle stays in the cell, or else 0."""
    left = np.array([-velocity_mps[1], velocity_mps[0]]) / TURN_RADPS
    centres = position_m + np.stack([left, -left])
    left_fits, right_fits = cell.room_m(centres) >= portable.norm(left)
    if left_fits:
        return TURN_RADPS
    if right_fits:
        return -TURN_RADPS
    return 0.0


def _begun(rng: np.random.Generator, row: dict, cell: Cell) -> None:
    """Draw the row's position and course anew until its target can turn inside the cell.

    Raises: InputError where MOST_BEGINNINGS draws find none.
    """
    for _ in range(MOST_BEGINNINGS):
        velocity = np.array([row["vx_mps"], row["vy_mps"]])
        if _way_back(cell, np.array([row["x_m"], row["y_m"]]), velocity):
            return
        row["x_m"], row["y_m"] = map(float, position_in(rng, *cell))
        angle = rng.uniform(0.0, 2 * math.pi)
        sine, cosine = map(float, portable.sine_cosine(angle))
        row["vx_mps"] = cosine * velocity[0] - sine * velocity[1]
        row["vy_mps"] = sine * velocity[0] + cosine * velocity[1]
        row["yaw_rad"] = (row["yaw_rad"] + angle) % (2 * math.pi)
    raise InputError(
        f"motion of {row['subtype']}: the region is too small for a turn of "
        f"{math.degrees(TURN_RADPS):.0f} degrees a second at {float(portable.norm(velocity)):.1f} "
        "m/s, expected a larger one in motion.region.polygon_m"
    )


def drawn_path(
    rng: np.random.Generator,
    row: dict,
    cell: Cell,
    heights_m: tuple[float, float],
    looks: int,
    look_s: float,
) -> LookStarts:
    """Return a path of `looks` looks of `look_s` seconds from the position and velocity of `row`.

    The heading rate of each look is uniform within TURN_RADPS, drawn again where the target would
    leave the cell or could not turn back; after DRAWS draws it turns back. It climbs the other way
    at the ends of `heights_m` (lowest and highest, m). The speed over ground is constant.
    """
    # A look is tested at eight instants, the last of them its end.
    step = look_s / 8 * np.arange(1, 9)
    here = np.array([row["x_m"], row["y_m"]])
    velocity = np.array([row["vx_mps"], row["vy_mps"]])
    height = row["z_m"]
    heading = row["yaw_rad"]
    climb = _climb(height, row["vz_mps"], row["vz_mps"], heights_m, 0.0, look_s)
    starts = [(*here, height, *velocity, climb, heading)]
    for _ in range(looks):
        for attempt in range(DRAWS + 1):
            if attempt < DRAWS:
                rate = rng.uniform(-TURN_RADPS, TURN_RADPS)
            else:
                rate = _way_back(cell, here, velocity)
            positions, velocities = turned(here, velocity, rate, step)
            inside = (cell.room_m(positions) > 0).all()
            if inside and _way_back(cell, positions[-1], velocities[-1]):
                break
        here = positions[-1]
        velocity = velocities[-1]
        heading = heading + rate * look_s
        later = _climb(height, climb, climb, heights_m, look_s, look_s)
        height = height + look_s * (climb + later) / 2
        climb = later
        starts.append((*here, height, *velocity, climb, heading))
    nodes = np.array(starts)
    return LookStarts(position_m=nodes[:, :3], velocity_mps=nodes[:, 3:6], heading_rad=nodes[:, 6])


def _climb(
    height: float,
    before: float,
    wanted: float,
    heights_m: tuple[float, float],
    ago_s: float,
    look_s: float,
) -> float:
    """Return the climb (m/s) after a look that began at `height` (m) and climbed `before`.

    It is as wanted, the other way, or none.

    ago_s: length of that look, 0 at the first one. At the climb returned, the next look ends within
    the heights.
    """
    lowest, highest = heights_m
    for climb in (wanted, -wanted):
        end_of_next = height + ago_s * (before + climb) / 2 + look_s * climb
        if lowest <= end_of_next <= highest:
            return climb
    return 0.0


def rows_along(
    cloud: Cloud, row: dict, path: LookStarts, look_s: float, cadence: str | None
) -> list[dict]:
    """Return the rows of a track's looks: `row` moved along `path`.

    The target's own motion goes on.

    cadence: as of `follow_speed`, for a path of changing speed; None where the row's speed is the
    path's.
    """
    rows = []
    row = dict(row)
    bent, bending = _cubic(path, look_s)
    turn = (np.diff(path.heading_rad) + math.pi) % (2 * math.pi) - math.pi
    for look in range(len(turn)):
        row["x_m"], row["y_m"], row["z_m"] = path.position_m[look].tolist()
        row["vx_mps"], row["vy_mps"], row["vz_mps"] = path.velocity_mps[look].tolist()
        row["yaw_rad"] = float(path.heading_rad[look] % (2 * math.pi))
        if cadence is not None:
            way = (path.position_m[look + 1] - path.position_m[look])[:2]
            follow_speed(cloud, row, float(portable.norm(way)) / look_s, cadence)
            if cloud.parts_of("wheel"):
                row["rate_hz"] /= row.get(SCALE, 1.0)
        turn_radps = float(turn[look]) / look_s
        numbers = (*bent[look].tolist(), *bending[look].tolist(), turn_radps)
        rows.append({**row, "look": look, **dict(zip(PATH, numbers, strict=True))})
        _go_on(cloud, row, look_s)
    return rows


def _cubic(path: LookStarts, look_s: float) -> tuple[np.ndarray, np.ndarray]:
    """Acceleration at the start of each look, and its rate of change, (L, 3) both.

    They are those of the cubic between its ends.
    """
    way = np.diff(path.position_m, axis=0)
    first = path.velocity_mps[:-1]
    last = path.velocity_mps[1:]
    acceleration = (6 * way / look_s - 4 * first - 2 * last) / look_s
    jerk = (6 * (first + last) - 12 * way / look_s) / look_s**2
    return acceleration, jerk


def _go_on(cloud: Cloud, row: dict, look_s: float) -> None:
    """Move the phases of a row's parts and its time in a recording on by one look."""
    # The wings beat together at the rate of the row, with one phase.
    wings = cloud.parts_of("wing")[:1]
    for kind in (cloud.parts_of("rotor"), cloud.parts_of("wheel"), wings):
        for order, part in enumerate(kind):
            rate_hz = row["rate_hz"]
            if kind is not wings:
                rate_hz *= float(cloud.rate_factors[part])
            name = f"phase_{order}_rad"
            turn = float(turns(rate_hz, np.array(look_s)))
            row[name] = (row[name] + 2 * math.pi * turn) % (2 * math.pi)
    if "node" in cloud.kinds:
        duration = len(cloud.track) / cloud.record["track_rate_hz"]
        row["start_s"] = (row["start_s"] + row["playback"] * look_s) % duration


def model_rows(
    seed: int,
    cloud: Cloud,
    published: dict,
    masts_m: np.ndarray,
    corners: np.ndarray,
    settings: dict,
    track: int,
    path: LookStarts | None = None,
) -> list[dict]:
    """Return the rows (without group and model) of one motion model.

    It has one look, or all looks of a track.

    settings: the configuration's block `motion`, and look_s (s), the length of a look, where it has
    `looks`; track: number of the motion model; path: that of a flight log. Everything else is as of
    `draw`. Each motion model has a stream of its own. Raises: InputError as `draw`, and where the
    region is too small to turn in.
    """
    rng = stream(seed, "motion", cloud.subtype, track)
    row = draw(rng, cloud, published, masts_m, corners, settings)
    if "looks" not in settings:
        return [row]
    look_s = settings["look_s"]
    looks = settings["looks"]
    height_m = row["z_m"]
    airborne = cloud.like in AIRBORNE
    if path is None:
        cell = Cell(corners, masts_m, settings["region"]["mast_clearance_m"])
        _begun(rng, row, cell)
        lowest = height_m
        highest = height_m
        if airborne:
            lowest, highest = heights(settings, cloud.subtype, cloud.category, cloud.like)
        path = drawn_path(rng, row, cell, (lowest, highest), looks, look_s)
        cadence = None
    else:
        cadence = settings["cadence"]
        if not airborne:
            path = path._replace(
                position_m=path.position_m * [1, 1, 0] + [0, 0, height_m],
                velocity_mps=path.velocity_mps * [1, 1, 0],
            )
    return [{**row, "track": track} for row in rows_along(cloud, row, path, look_s, cadence)]
