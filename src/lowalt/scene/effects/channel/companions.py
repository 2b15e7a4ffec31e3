"""Other targets in the beam, such as a flock, or a bird next to a drone.

The label is that of the primary target.

At the first symbol, companions stand around the target with a standard deviation of `spread_m` on
each axis. Members of a flock have the target's velocity plus a normal error of standard deviation
`speed_mps`. Each companion is a complete target with its own points, moving parts, cross sections,
motion effects and paths. Its complex echo adds to the target's before a range cell is chosen, so
the chosen cell may be that of a companion. Beams point at the primary target, and the SNRs of the
configuration refer to its echo alone. The record of a sample lists the companions.
"""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.motion.drawing import AIRBORNE, draw_rates
from lowalt.motion.table import NUMBERS
from lowalt.numerics.portable import norm
from lowalt.scene.checks import CheckedScene
from lowalt.targets.cloud import Cloud

SOURCE = (
    "several scatterers add as their echoes: M. I. Skolnik, Introduction to Radar Systems, 3rd ed. "
    "2001, 2.7 (complex targets); the spread of a flock: estimate"
)
DEFAULTS = {"subtypes": [], "count": [1, 3], "spread_m": 4.0, "speed_mps": 1.0}
IDLE = [{"count": [0, 0]}]
JUMPS = True

TRIES = 200
"""Draws of a position clear of the other targets, before the spread counts as too small."""


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a range of counts that falls, or companions that need surfaces.

    The surfaces of companions are not known.
    """
    low, high = settings["count"]
    if low > high:
        raise InputError(
            f"effects.companions.count: {settings['count']}, expected the smaller number first"
        )
    asking = scene.offering("SURFACES")
    if asking and settings["subtypes"]:
        raise InputError(
            "effects.companions.subtypes: surfaces are known for the target's own subtype only, "
            f"expected [] in a scene with effects.{asking[0]}"
        )


def named(settings: dict, subtype: str, rng: np.random.Generator) -> list[str]:
    """Return the companions' subtypes of one motion model: the first draws of its stream."""
    low, high = settings["count"]
    count = int(rng.integers(low, high + 1))
    choice = settings["subtypes"] or [subtype]
    return [choice[int(rng.integers(0, len(choice)))] for _ in range(count)]


def subtypes(settings: dict) -> list[str]:
    """Return the subtypes whose clouds companions may need."""
    return settings["subtypes"]


def record(
    settings: dict, network: Network, row: dict, rng: np.random.Generator
) -> dict[str, list[str]]:
    """Return the field `companions`: the companions' subtypes of the motion model `row`."""
    return {"companions": named(settings, row["subtype"], rng)}


def companions(
    settings: dict, cloud: Cloud, row: dict, clouds: Mapping[str, Cloud], rng: np.random.Generator
) -> list[tuple[Cloud, dict]]:
    """Return the companions of the motion model `row`.

    They are their clouds, and their rows as in the motion table.

    clouds: the clouds of the other subtypes, by name. Raises: InputError naming a subtype without a
    cloud, or a spread that leaves no room for the targets.
    """
    taken = [(_position(row), _reach(cloud))]
    result = []
    for number, name in enumerate(named(settings, row["subtype"], rng)):
        if name != row["subtype"] and name not in clouds:
            raise InputError(
                f"effects.companions.subtypes: no cloud of {name!r} among {sorted(clouds)}, "
                "expected one of each"
            )
        other = cloud if name == row["subtype"] else clouds[name]
        reach = _reach(other)
        mine = _moving(settings, other, row, rng)
        for _ in range(TRIES):
            offset = settings["spread_m"] * rng.standard_normal(3)
            for axis, shift in zip("xyz", offset, strict=True):
                mine[f"{axis}_m"] = row[f"{axis}_m"] + float(shift)
            lowest = reach
            if other.like not in AIRBORNE:
                mine["z_m"] = other.record["origin_height_m"]
                lowest = 0.0
            position = _position(mine)
            clear = all(norm(position - away) > reach + size for away, size in taken)
            if clear and position[2] > lowest:
                break
        else:
            raise InputError(
                f"effects.companions.spread_m: {settings['spread_m']} m leaves no room for "
                f"{number + 1} companions of {row['subtype']}, model {row['model']}, expected more"
            )
        taken.append((position, reach))
        # Random streams are keyed by this name, so each companion has its own.
        mine["model"] = f"{row['subtype']} {row['model']} companion {number}"
        result.append((other, mine))
    return result


def _position(row: dict) -> np.ndarray:
    """Position (3,) of a row's target at the first symbol (m)."""
    return np.array([row["x_m"], row["y_m"], row["z_m"]])


def _reach(cloud: Cloud) -> float:
    """Distance of the farthest point from a target's origin (m)."""
    points = cloud.track if "node" in cloud.kinds else cloud.points
    return float(norm(points).max())


def _moving(settings: dict, other: Cloud, row: dict, rng: np.random.Generator) -> dict:
    """A companion's row without its position.

    In a flock the motion is nearly the target's, otherwise its subtype's own.
    """
    mine: dict[str, Any] = {
        **dict.fromkeys(NUMBERS, math.nan),
        "subtype": other.subtype,
        "category": other.category,
    }
    published = other.record["published"]
    flying = other.like in AIRBORNE
    flock = other.category == row["category"]
    for angle in ("yaw_rad", "pitch_rad", "roll_rad"):
        mine[angle] = 0.0
        if flock:
            mine[angle] = row[angle]
    speed = 0.0
    if flying:
        for axis in "xyz":
            alone = rng.uniform(-1.0, 1.0) * published[f"v{axis}_abs_max"]
            shared = row[f"v{axis}_mps"] + settings["speed_mps"] * float(rng.standard_normal())
            mine[f"v{axis}_mps"] = shared if flock else alone
    else:
        alone = rng.uniform(published["speed_lo"], published["speed_hi"])
        error = settings["speed_mps"] * float(rng.standard_normal())
        shared = math.hypot(row["vx_mps"], row["vy_mps"]) + error
        speed = max(shared, 0.0) if flock else alone
    if not flock:
        mine["yaw_rad"] = rng.uniform(0.0, 2 * math.pi)
    if not flying:
        yaw = mine["yaw_rad"]
        mine |= {"vx_mps": -speed * math.sin(yaw), "vy_mps": speed * math.cos(yaw), "vz_mps": 0.0}
    draw_rates(rng, other, published, mine, speed, "free")
    return mine
