"""Drawing motion models from the published ranges, or our defaults where the paper gives none.

Each motion model has its own stream (seed, "motion", subtype, model) and a fixed order of draws, so
it does not depend on the rest of the configuration.
"""

import math

import numpy as np

from lowalt.config.classes import AIRBORNE
from lowalt.files.errors import InputError
from lowalt.motion.table import NUMBERS, PHASES, SCALE
from lowalt.numerics import portable
from lowalt.targets.cloud import Cloud, extent

MOST_DRAWS = 10_000
"""How often a position is drawn before the region is found to have none."""


def region_polygon(masts_m: np.ndarray, polygon_m: list | None) -> np.ndarray:
    """Return the region's corners (K, 2) m, counter-clockwise.

    They are those of `polygon_m`, or of the convex hull of `masts_m` (S, 2).
    Raises: InputError where the polygon is degenerate.
    """
    # Imported late: the Snakefile imports this module and rarely needs a hull.
    from scipy.spatial import ConvexHull, QhullError

    corners = np.array(masts_m, dtype=float)
    if polygon_m is not None:
        corners = np.array(polygon_m, dtype=float)
    if corners.ndim != 2 or corners.shape[1:] != (2,) or len(corners) < 3:
        raise InputError(
            f"motion: region polygon has shape {corners.shape}, expected three or more (x, y) "
            "corners in metres; with fewer than three stations give motion.region.polygon_m"
        )
    try:
        hull = ConvexHull(corners).vertices
    except QhullError:
        raise InputError(
            f"motion: region polygon {corners.tolist()} is flat, expected corners around an area"
        ) from None
    if polygon_m is not None and len(hull) < len(corners):
        raise InputError(
            f"motion.region.polygon_m: value {polygon_m} is not convex, expected a convex polygon"
        )
    return corners[hull]


def _edges(corners: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Return cross products (K,) of each edge and the vector to a point, all > 0 inside."""
    step = np.roll(corners, -1, axis=0) - corners
    to_point = point - corners
    return step[:, 0] * to_point[:, 1] - step[:, 1] * to_point[:, 0]


def masts_in_reach(
    masts_m: list[list[float]], polygon_m: list | None, mast_clearance_m: float
) -> list[list[float]]:
    """Return the masts [x, y] (m) on which the positions of targets depend.

    polygon_m: corners of a convex region, or None where the masts themselves span it;
    mast_clearance_m: least distance of a target to a mast. A mast farther than that from a given
    region changes no draw.
    """
    if polygon_m is None:
        return masts_m
    corners = region_polygon(np.zeros((0, 2)), polygon_m)
    # Use twice the clearance, so that rounding cannot change a draw.
    reach_m = 2 * mast_clearance_m
    return [mast for mast in masts_m if _distance_m(np.array(mast, float), corners) < reach_m]


def _distance_m(point: np.ndarray, corners: np.ndarray) -> float:
    """Distance of a point (2,) to a convex polygon (K, 2), 0 inside (m)."""
    if np.all(_edges(corners, point) >= 0):
        return 0.0
    side = np.roll(corners, -1, axis=0) - corners
    away = point - corners
    share = np.clip((away * side).sum(1) / (side * side).sum(1), 0.0, 1.0)
    x, y = (away - share[:, None] * side).T
    return float(np.hypot(x, y).min())


def position_in(
    rng: np.random.Generator, corners: np.ndarray, masts: np.ndarray, clearance_m: float
) -> np.ndarray:
    """Draw a position (2,) m inside the polygon `corners`, at least `clearance_m` from every mast.

    Raises: InputError where MOST_DRAWS draws find none.
    """
    low = corners.min(axis=0)
    high = corners.max(axis=0)
    for _ in range(MOST_DRAWS):
        point = rng.uniform(low, high)
        squares = portable.dot(masts - point, masts - point)
        far = np.all(squares >= clearance_m * clearance_m)
        if far and np.all(_edges(corners, point) > 0):
            return point
    raise InputError(f"motion: no place in the region is {clearance_m} m away from every mast")


def heights(settings: dict, subtype: str, category: str, like: str) -> list[float]:
    """Return the lowest and highest flight (m): of the subtype, or its class, or its `like`."""
    block = settings["height_m"]
    return next(block[name] for name in (subtype, category, like) if name in block)


def follow_speed(cloud: Cloud, row: dict, speed: float, cadence: str) -> None:
    """Set the rate of wheels and the playback rate of a recording, by the ground speed (m/s).

    cadence: "free", or "tied" to the speed.
    """
    if cloud.parts_of("wheel"):
        row["rate_hz"] = speed / (math.pi * cloud.record["wheel_diameter_m"])
    if "node" in cloud.kinds:
        row["playback"] = 1.0
        if "tied" in (cadence, cloud.record.get("cadence")):
            row["playback"] = speed / cloud.record["track_speed_mps"]


def draw_rates(
    rng: np.random.Generator, cloud: Cloud, published: dict, row: dict, speed: float, cadence: str
) -> None:
    """Fill in a row's rate, phases and start in a recording.

    speed: over ground (m/s); cadence: "free", or "tied" to the speed.
    Raises: InputError for more moving parts than the motion table has phases.
    """
    follow_speed(cloud, row, speed, cadence)
    wheels = len(cloud.parts_of("wheel"))
    if cloud.like in AIRBORNE and not wheels and published["freq_lo_hz"] is not None:
        row["rate_hz"] = rng.uniform(published["freq_lo_hz"], published["freq_hi_hz"])
    # The wings beat together, with one phase.
    moving = len(cloud.parts_of("rotor")) + wheels + bool(cloud.parts_of("wing"))
    if moving > PHASES:
        raise InputError(
            f"motion of {cloud.subtype}: {moving} moving parts, expected at most {PHASES}"
        )
    if moving and math.isnan(row["rate_hz"]):
        raise InputError(
            f"motion of {cloud.subtype}: the table of targets has no freq_lo_hz, expected a rate "
            "in hertz"
        )
    for index in range(moving):
        row[f"phase_{index}_rad"] = rng.uniform(0.0, 2 * math.pi)
    if "node" in cloud.kinds:
        duration = len(cloud.track) / cloud.record["track_rate_hz"]
        row["start_s"] = rng.uniform(0.0, duration)


def _resize(rng: np.random.Generator, cloud: Cloud, low_m: float, high_m: float, row: dict) -> None:
    """Draw the target's longest side from `low_m` to `high_m` and scale rate and height.

    It is uniform in its logarithm. A craft or bird `s` times as large turns or beats `s` times as
    slowly, so blade tips and wings keep their speed; a wheel of `s` times the diameter turns `s`
    times as slowly at the same road speed. A recording keeps its cadence.
    """
    low, high = map(float, portable.log(np.array([low_m, high_m])))
    scale = float(portable.exp(rng.uniform(low, high))) / extent(cloud)
    row[SCALE] = scale
    row["rate_hz"] /= scale
    if cloud.like not in AIRBORNE:
        row["z_m"] *= scale


def draw(
    rng: np.random.Generator,
    cloud: Cloud,
    published: dict,
    masts_m: np.ndarray,
    corners: np.ndarray,
    settings: dict,
) -> dict:
    """Return one motion model's row (without group and model) for the target `cloud`.

    published: the subtype's ranges (config/targets.csv); masts_m: (S, 2) m, the stations' masts;
    corners: (K, 2) m from `region_polygon`; settings: the motion block of the configuration. All
    values are drawn uniformly; where `sizes_m` asks for sizes, the logarithm of the size is. Wheels
    turn at F = v / (pi D) (paper Eq. 16).
    Raises: InputError where no position satisfies the region or the target has too many parts.
    """
    row = dict.fromkeys(NUMBERS, math.nan)
    clearance_m = settings["region"]["mast_clearance_m"]
    row["x_m"], row["y_m"] = map(float, position_in(rng, corners, masts_m, clearance_m))
    row["yaw_rad"] = rng.uniform(0.0, 2 * math.pi)
    row["pitch_rad"] = 0.0
    row["roll_rad"] = 0.0
    speed = 0.0
    if cloud.like in AIRBORNE:
        low, high = heights(settings, cloud.subtype, cloud.category, cloud.like)
        row["z_m"] = rng.uniform(low, high)
        tilt = math.radians(settings["tilt_deg"])
        row["pitch_rad"] = rng.uniform(-tilt, tilt)
        row["roll_rad"] = rng.uniform(-tilt, tilt)
        for axis in "xyz":
            bound = published[f"v{axis}_abs_max"]
            row[f"v{axis}_mps"] = rng.uniform(-bound, bound)
    else:
        row["z_m"] = cloud.record["origin_height_m"]
        speed = rng.uniform(published["speed_lo"], published["speed_hi"])
        sine, cosine = map(float, portable.sine_cosine(row["yaw_rad"]))
        row["vx_mps"] = -speed * sine
        row["vy_mps"] = speed * cosine
        row["vz_mps"] = 0.0
    draw_rates(rng, cloud, published, row, speed, settings["cadence"])
    sizes = settings.get("sizes_m", {})
    if cloud.category in sizes:
        low_m, high_m = sizes[cloud.category]
        _resize(rng, cloud, low_m, high_m, row)
    elif sizes:
        row[SCALE] = 1.0  # all rows of a table need the column
    return {"subtype": cloud.subtype, "category": cloud.category, **row}
