"""The echo of a target in front of a measured radar, by the same engine, and what a scene changes about the target."""

from dataclasses import replace

import numpy as np

from lowalt.echo import Rigid, echo_signals
from lowalt.extensions.recordings.twin import Twin
from lowalt.extensions.recordings.twin_courses import Course
from lowalt.files.errors import InputError
from lowalt.motion import Perturbation, poses
from lowalt.motion.table import NUMBERS, PHASES
from lowalt.scene.effects.motion import rotor_spread
from lowalt.targets.cloud import Cloud
from lowalt.targets.skeleton import NODES

TOLERANCE = 1e-4
"""Allowed error of the echo over its largest value: -80 dB, less than the noise of any of these receivers."""
TORSO = ("root", "hipjoint", "back", "thorax", "neck", "head", "clavicle")
LEGS = ("femur", "tibia", "foot", "toes")


def strengthened(cloud: Cloud, strength_db: dict[str, float], foil: str = "") -> Cloud:
    """Return the cloud with the cross sections of some of its parts raised by decibels.

    strength_db: kind of part ("body", "rotor", "wing", "wheel"; of nodes "torso", "arms", "legs") -> dB; foil: a digit
    for each blade, rotor by rotor, "1" for a blade with foil, raised by strength_db["foil"].
    Raises: InputError for an unknown kind, or a foil that does not fit the blades.
    """
    gain = np.zeros(len(cloud.points))
    kinds = {kind: np.isin(cloud.part, cloud.parts_of(kind)) for kind in ("body", "rotor", "wing", "wheel")}
    if "node" in cloud.kinds:
        torso = np.array([any(word in name for word in TORSO) for name in NODES])
        legs = np.array([any(word in name for word in LEGS) for name in NODES])
        kinds |= {"torso": torso, "legs": legs, "arms": ~torso & ~legs}
    for kind, decibels in strength_db.items():
        if kind == "foil":
            continue
        if kind not in kinds:
            raise InputError(f"strength of {kind!r}, expected some of {sorted(kinds)} and foil")
        gain += np.where(kinds[kind], decibels, 0.0)
    if foil:
        blades = blade_points(cloud)
        if len(foil) != len(blades) or set(foil) - set("01"):
            raise InputError(f"foil {foil!r}, expected one digit 0 or 1 for each of {len(blades)} blades")
        for digit, points in zip(foil, blades, strict=True):
            gain[points] += strength_db["foil"] * (digit == "1")
    return replace(cloud, rcs_m2=cloud.rcs_m2 * 10 ** (gain / 10))


def radii(cloud: Cloud, points: np.ndarray) -> np.ndarray:
    """Return the distances (n,) m of some points of one turning part from its axis."""
    part = cloud.part[points[0]]
    return np.linalg.norm(np.cross(cloud.points[points] - cloud.hinges[part], cloud.axes[part]), axis=1)


def textured(cloud: Cloud, texture_db: float, tip: float, rng: np.random.Generator) -> Cloud:
    """Return the cloud with unequal points: cross sections spread by `texture_db` rms, blades weighted to their tips.

    Equal points smear a car over its whole length; measured cars are a few strong centres (Schuler, Becker and Wiesbeck
    2008, IEEE Trans. Antennas Propag. 56(11), at 24 GHz). On a rotor the cross section grows as (r / R)^tip from the
    hub. The mean over the points of a part stays the same.
    """
    gain = (
        10 ** (texture_db / 10 * rng.standard_normal(len(cloud.points))) if texture_db else np.ones(len(cloud.points))
    )
    for rotor in cloud.parts_of("rotor") if tip else ():
        of_part = cloud.part == rotor
        reach = radii(cloud, np.flatnonzero(of_part))
        gain[of_part] *= (reach / reach.max()) ** tip
    for part in range(len(cloud.kinds)) if "node" not in cloud.kinds else ():
        of_part = cloud.part == part
        gain[of_part] /= gain[of_part].mean()
    return replace(cloud, rcs_m2=cloud.rcs_m2 * gain)


def sized(cloud: Cloud, factors: list[float]) -> Cloud:
    """Return the cloud with its body's places multiplied by three factors: across, along and upwards.

    Parts that turn keep their own size and move with their hinges, so wheels stay round.
    """
    hinges = cloud.hinges * factors
    turning = np.isin(cloud.part, [part for part, kind in enumerate(cloud.kinds) if kind != "body"])
    moved = cloud.points + (hinges - cloud.hinges)[cloud.part]
    return replace(cloud, points=np.where(turning[:, None], moved, cloud.points * factors), hinges=hinges)


def beam_gain(place_m: np.ndarray, width_deg: float, floor_db: float) -> np.ndarray:
    """Return the two-way amplitude gain (N,) of an antenna that looks along +y, towards places (N, 3) m.

    A Gaussian main lobe of `width_deg` between its half-power points, never below `floor_db` one way. Width 0 stands
    for an antenna that hears all directions alike.
    """
    if not width_deg:
        return np.ones(len(place_m))
    angle = np.degrees(np.arccos(np.clip(place_m[:, 1] / np.linalg.norm(place_m, axis=1), -1, 1)))
    one_way_db = np.maximum(-12.0 * (angle / width_deg) ** 2, floor_db)
    return 10 ** (2 * one_way_db / 20)


def blade_points(cloud: Cloud) -> list[np.ndarray]:
    """Return the point numbers of every blade, rotor by rotor, in the order in which built-in craft store them."""
    blades = int(cloud.record["figures"]["blade_count"]["si"])
    return [part for rotor in cloud.parts_of("rotor") for part in np.split(np.flatnonzero(cloud.part == rotor), blades)]


def still_row(cloud: Cloud, rate_hz: float, rng: np.random.Generator) -> dict:
    """Return a motion row at the origin without speed, its parts' phases drawn; the course carries it elsewhere."""
    row = dict.fromkeys(NUMBERS, 0.0) | {"subtype": cloud.subtype, "category": cloud.category, "model": 0}
    row |= {"rate_hz": rate_hz, "playback": 1.0}
    row |= {f"phase_{index}_rad": float(phase) for index, phase in enumerate(rng.uniform(0, 2 * np.pi, PHASES))}
    return row


def echo(
    twin: Twin, cloud: Cloud, row: dict, course: Course, times_s: np.ndarray, spread: float, wander: float,
    rng: np.random.Generator,
) -> np.ndarray:  # fmt: skip
    """Return the complex echo (N,) at the receiver's rate of a target on its course.

    times_s: (N,) s at 1 / rate_hz, the course's times; spread, wander: of the rotors' rates, as the effect
    `rotor_spread` has them. Every pose is taken at the course's clock, so limbs slow down where the walker does.
    Source: paper Eqs. 7 and 22 to 25 with one subcarrier; the poses as in `lowalt.motion`.
    """
    rotor_angles = rotor_spread.perturb(
        {"spread": spread, "wander": wander, "correlation_s": 1.5}, cloud, row, course.clock_s, rng
    ).angle_rad
    start = course.clock_s + row["start_s"]
    placed = poses(cloud, row | {"start_s": 0.0}, start, Perturbation(rotor_angles, course.place_m, course.tilt_rad))
    network = twin.network(len(times_s), 1 / twin.rate_hz)
    motion = Rigid(placed.rotation, placed.translation, cloud.points, cloud.part)
    return echo_signals(network, motion, cloud.rcs_m2, course.place_m[0], TOLERANCE, cloud.subtype)[0]
