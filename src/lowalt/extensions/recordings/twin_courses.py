"""Courses: where a target is, how it is turned and how far its own motion has come, at any time.

The motion table's targets fly straight at one speed. In front of a measured radar they hover, drive
past, or walk to and fro and turn back; these courses are functions of time in closed form, so a
window can start at any moment. Axes as everywhere: x right, y front, z up, metres; yaw 0 looks
along +y.
"""

from typing import NamedTuple

import numpy as np

from lowalt.files.errors import InputError


class Course(NamedTuple):
    """place_m: (N, 3) m; tilt_rad: (N, 3) yaw, pitch and roll; clock_s: (N,) s, the time of the
    target's own parts.
    """

    place_m: np.ndarray
    tilt_rad: np.ndarray
    clock_s: np.ndarray


def straight(times_s: np.ndarray, start_m: np.ndarray, speed_mps: float, yaw_rad: float) -> Course:
    """Return a course from `start_m` (3,) along the target's front at `speed_mps`; a car that
    drives past is one.
    """
    front = np.array([-np.sin(yaw_rad), np.cos(yaw_rad), 0.0])
    velocity = speed_mps * front
    tilt = np.zeros((len(times_s), 3))
    tilt[:, 0] = yaw_rad
    return Course(np.asarray(start_m) + times_s[:, None] * velocity, tilt, times_s)


def drive(
    times_s: np.ndarray,
    start_m: np.ndarray,
    speed_mps: float,
    yaw_rad: float,
    acceleration_mps2: float,
    curve_per_m: float,
    own_speed_mps: float,
) -> Course:
    """Return a course from `start_m` (3,) that speeds up or brakes to a stop and follows a bend of
    constant curvature.

    speed_mps: at time 0, not negative; curve_per_m: one over the bend's radius, positive to the
    left. The clock is the way covered over `own_speed_mps`, so that wheels roll and limbs stop
    where the target does.
    """
    moving = (
        times_s if acceleration_mps2 >= 0 else np.minimum(times_s, speed_mps / -acceleration_mps2)
    )
    covered = speed_mps * moving + 0.5 * acceleration_mps2 * moving**2
    yaw = yaw_rad + curve_per_m * covered
    # The front is (-sin yaw, cos yaw); its integral over a bend is a chord, whose middle has the
    # mean yaw.
    half_turn = 0.5 * curve_per_m * covered
    chord = covered * np.sinc(half_turn / np.pi)
    middle = yaw_rad + half_turn
    tilt = np.zeros((len(times_s), 3))
    tilt[:, 0] = yaw
    way = np.stack(
        [-chord * np.sin(middle), chord * np.cos(middle), np.zeros(len(times_s))], axis=1
    )
    return Course(np.asarray(start_m) + way, tilt, covered / own_speed_mps)


SWAYS = 3
"""Sinusoids on every axis of a sway."""


def hover(
    times_s: np.ndarray,
    place_m: np.ndarray,
    yaw_rad: float,
    sway_m: float,
    sway_hz: float,
    rock_rad: float,
    rng: np.random.Generator,
) -> Course:
    """Return a course about `place_m` (3,): each axis sways by `sway_m` rms, pitch and roll rock,
    at up to `sway_hz`.

    rock_rad: rms of pitch and roll. Each of the five motions is a sum of `SWAYS` sinusoids of
    random rate and phase. In each sum all have the same peak speed, so the fast ones are small. The
    magnitudes are settings, since they differ between craft and with the wind.
    """
    rates = rng.uniform(0.1, 1.0, (5, SWAYS)) * sway_hz
    phases = rng.uniform(0, 2 * np.pi, (5, SWAYS))
    sizes = 1 / rates
    sizes *= np.sqrt(2 / (sizes**2).sum(axis=1, keepdims=True))
    waves = sizes * np.sin(2 * np.pi * rates * times_s[:, None, None] + phases)
    moved = waves.sum(axis=2)
    tilt = np.zeros((len(times_s), 3))
    tilt[:, 0] = yaw_rad
    tilt[:, 1:] = rock_rad * moved[:, 3:]
    return Course(np.asarray(place_m) + sway_m * moved[:, :3], tilt, times_s)


def to_and_fro(
    times_s: np.ndarray,
    near_m: float,
    far_m: float,
    speed_mps: float,
    turn_s: float,
    own_speed_mps: float,
    bearing_rad: float,
    height_m: float,
) -> Course:
    """Return a walk between two distances on one bearing, away first: at `speed_mps`, turning back
    within `turn_s`.

    Around an end the speed follows a cosine through zero while the body turns by half a circle. The
    feet do not slide: the limbs' clock runs at speed / `own_speed_mps`, where `own_speed_mps` is
    the speed at which the gait was recorded.
    bearing_rad: direction of the walk, 0 along +y; height_m: of the body's origin.
    Raises: InputError where the ends are too near for the turns.
    """
    # While turning, speed is v cos(pi u) over u in 0..1: half a turn covers v turn_s / pi each way.
    if speed_mps <= 0:
        raise InputError(
            f"walk at {speed_mps} m/s, expected more than 0: a target that stays has the course"
            " hover"
        )
    leg = far_m - near_m - 2 * speed_mps * turn_s / np.pi
    if leg <= 0:
        raise InputError(
            f"walk from {near_m} to {far_m} m at {speed_mps} m/s: no room to turn within {turn_s} s"
        )
    out_s = leg / speed_mps
    period = 2 * (out_s + turn_s)
    at = np.mod(times_s, period)
    back = at >= out_s + turn_s
    within = at - np.where(back, out_s + turn_s, 0.0)
    turn = np.clip((within - out_s) / turn_s, 0.0, 1.0)
    gone = speed_mps * np.minimum(within, out_s) + speed_mps * turn_s / np.pi * np.sin(np.pi * turn)
    low = near_m + speed_mps * turn_s / np.pi
    high = far_m - speed_mps * turn_s / np.pi
    distance = np.where(back, high - gone, low + gone)
    # Distance walked so far: the integral of |speed| over time. It sets the limbs' clock.
    covered_a_leg = speed_mps * (out_s + 2 * turn_s / np.pi)
    in_turn = (
        speed_mps
        * turn_s
        / np.pi
        * np.where(turn < 0.5, np.sin(np.pi * turn), 2 - np.sin(np.pi * turn))
    )
    legs = 2 * np.floor(times_s / period) + back
    covered = legs * covered_a_leg + speed_mps * np.minimum(within, out_s) + in_turn
    eased = np.pi * (turn - np.sin(2 * np.pi * turn) / (2 * np.pi))
    tilt = np.zeros((len(times_s), 3))
    tilt[:, 0] = bearing_rad + eased + np.pi * back
    along = np.array([-np.sin(bearing_rad), np.cos(bearing_rad), 0.0])
    return Course(distance[:, None] * along + [0.0, 0.0, height_m], tilt, covered / own_speed_mps)
