"""Gusts: Dryden turbulence at low altitude carries a flying target along and tilts it.

Turbulence is a field frozen into the mean wind; the target meets it at its airspeed. It follows the air with a
first-order lag; a multirotor tilts by atan(a / g) towards its horizontal acceleration a, a bird banks, both with the
lag of the body's attitude. Turbulence, velocity, place and tilt are one linear process, discretised exactly.
"""

import numpy as np

from lowalt.effects.motion.markov import Steps, root_of, stationary, step_s, steps, walk
from lowalt.motion.poses import Perturbation, attitude
from lowalt.targets.cloud import Cloud

SOURCE = (
    "Dryden spectra, scale lengths, intensities and wind profile below 1000 ft: MIL-F-8785C, 1980, section 3.7 "
    "(the same spectra as MIL-HDBK-1797 with its half scale lengths); tilt: balance of thrust and weight"
)
DEFAULTS = {"wind_mps": 7.7, "response_s": 1.0, "attitude_s": 0.1}

FOOT_M = 0.3048
HEIGHTS_FT = (10.0, 1000.0)
"""Range of the low-altitude model; outside it the nearer end is used."""
ROUGHNESS_FT = 2.0
"""Roughness length of the mean wind's profile, all flight phases but landing."""
SLOWEST_MPS = 0.1
"""Least airspeed, below which turbulence would stand still around the target."""
GRAVITY_MPS2 = 9.80665


def idle(settings: dict) -> bool:
    """Return whether the air stands still."""
    return settings["wind_mps"] == 0


def turbulence(height_m: float, wind_mps: float) -> tuple[np.ndarray, np.ndarray]:
    """Return scale lengths (3,) m and intensities (3,) m/s along the wind, across it and upwards.

    wind_mps: speed 20 ft (6 m) above ground. Source: MIL-F-8785C, section 3.7, low altitude.
    """
    feet = float(np.clip(height_m / FOOT_M, *HEIGHTS_FT))
    ratio = 0.177 + 0.000823 * feet
    up = 0.1 * wind_mps
    along = feet * FOOT_M / ratio**1.2
    return np.array([along, along, feet * FOOT_M]), np.array([up / ratio**0.4, up / ratio**0.4, up])


def mean_wind_mps(height_m: float, wind_mps: float) -> float:
    """Return the mean wind's speed (m/s) at a height, from that at 20 ft. Source: MIL-F-8785C, section 3.7."""
    feet = float(np.clip(height_m / FOOT_M, *HEIGHTS_FT))
    return wind_mps * np.log(feet / ROUGHNESS_FT) / np.log(20.0 / ROUGHNESS_FT)


def process(scale: float, longitudinal: bool, response: float, attitude_lag: float) -> tuple[np.ndarray, ...]:
    """Return drift (5, 5), noise (5,) and outputs (4, 5) of unit turbulence and the target's response; times in steps.

    scale: the turbulence's time L / V. Outputs: gust, the target's velocity (both of unit turbulence), the target's
    place (that times a step) and the lagged acceleration (that over a step). Each state is an integral of the one
    before it with unit weight, so their steps' covariances stay well conditioned however short a step is.
    """
    a, b, c = 1.0 / scale, 1.0 / response, 1.0 / attitude_lag
    # The lateral filter (1 + sqrt(3) t s) / (1 + t s)^2 is a mix of a first- and a second-order lag.
    mix = 0.0 if longitudinal else (1.0 / np.sqrt(3.0) - 1.0) * a
    gain = np.sqrt(2.0 * a) if longitudinal else np.sqrt(3.0 * a)
    drift = np.array([
        [-a, 0, 0, 0, 0],
        [1, -a, 0, 0, 0],
        [1, mix, -b, 0, 0],
        [0, 0, 1, 0, 0],
        [1, mix, -b, 0, -c],
    ])  # fmt: skip
    outputs = gain * np.array([
        [1, mix, 0, 0, 0],
        [0, 0, b, 0, 0],
        [0, 0, 0, b, 0],
        [0, 0, 0, 0, b * c],
    ])  # fmt: skip
    return drift, np.array([1.0, 0, 0, 0, 0]), outputs


MOVING = [0, 1, 2, 4]
"""The states that have a stationary spread; the place starts from zero."""


def axis(
    scale: float, longitudinal: bool, response: float, attitude_lag: float
) -> tuple[Steps, np.ndarray, np.ndarray]:
    """Return one axis's steps, the root (5, 5) of its states' stationary covariance, and its outputs (4, 5)."""
    drift, noise, outputs = process(scale, longitudinal, response, attitude_lag)
    start = np.zeros((5, 5))
    start[np.ix_(MOVING, MOVING)] = root_of(stationary(drift[np.ix_(MOVING, MOVING)], noise[MOVING]))
    return steps(drift, noise), start, outputs


def perturb(settings: dict, cloud: Cloud, row: dict, times_s: np.ndarray, rng: np.random.Generator) -> Perturbation:
    """Return a flying target's offset (N, 3) m and tilt (N, 3) rad at `times_s` (N,) s, equally spaced.

    The wind's direction is drawn. Nothing for targets on the ground.
    """
    if cloud.category not in ("UAV", "Bird"):
        return Perturbation({})
    heading = rng.uniform(0.0, 2 * np.pi)
    first = rng.standard_normal((3, 5))
    normal = rng.standard_normal((3, len(times_s) - 1, 5))
    forward = np.array([np.cos(heading), np.sin(heading), 0.0])
    velocity = np.array([row["vx_mps"], row["vy_mps"], row["vz_mps"]])
    scales, intensities = turbulence(row["z_m"], settings["wind_mps"])
    through = velocity - mean_wind_mps(row["z_m"], settings["wind_mps"]) * forward
    airspeed = max(float(np.linalg.norm(through)), SLOWEST_MPS)
    step = step_s(times_s)
    axes = [
        axis(scale / airspeed / step, number == 0, settings["response_s"] / step, settings["attitude_s"] / step)
        for number, scale in enumerate(scales)
    ]
    start = np.stack([root @ one for (_, root, _), one in zip(axes, first, strict=True)])
    states = walk([each for each, _, _ in axes], start, normal)
    found = np.stack([states[i] @ axes[i][2].T for i in range(3)]) * intensities[:, None, None]
    wind = np.stack([forward, [-forward[1], forward[0], 0.0], [0.0, 0.0, 1.0]])
    offset = found[..., 2].T @ wind * step
    acceleration = found[..., 3].T @ wind / step
    ahead = attitude(row["yaw_rad"], 0.0, 0.0)
    return Perturbation({}, offset, tilt(acceleration @ ahead, pitches=cloud.category == "UAV"))


def tilt(acceleration_mps2: np.ndarray, pitches: bool) -> np.ndarray:
    """Return yaw, pitch and roll (N, 3) rad that turn the thrust towards an acceleration (N, 3): right, front, up.

    pitches: whether the body also pitches for its acceleration to the front, as a multirotor does and a bird does not.
    """
    result = np.zeros((len(acceleration_mps2), 3))
    if pitches:
        result[:, 1] = -np.arctan(acceleration_mps2[:, 1] / GRAVITY_MPS2)
    result[:, 2] = np.arctan(acceleration_mps2[:, 0] / GRAVITY_MPS2)
    return result
