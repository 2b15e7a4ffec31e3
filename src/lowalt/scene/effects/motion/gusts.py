"""Gusts: Dryden turbulence pushes a flying target.

The target leans against the push to keep its position and course.

Turbulence is a frozen field that moves with the mean wind, and the target flies through it at its
airspeed. Drag accelerates the target along with the air. Its controller commands a thrust against
the velocity and the displacement, and the attitude follows with a lag: a multirotor tilts by atan(a
/ g), where a is the acceleration by its thrust; a bird banks. Turbulence, velocity, displacement
and thrust form one linear process, which is discretised exactly. `wind_mps` is the mean wind 20 ft
(6 m) above ground.
"""

from functools import lru_cache

import numpy as np

from lowalt.motion.poses import Perturbation
from lowalt.motion.rotations import attitude
from lowalt.numerics import portable
from lowalt.scene.laws import flight
from lowalt.scene.laws.markov import Steps, root_of, stationary, step_s, steps, walk
from lowalt.targets.cloud import Cloud

SOURCE = (
    "Dryden spectra, scale lengths, intensities and wind profile below 1000 ft: MIL-F-8785C, 1980, "
    "section 3.7 (the same spectra as MIL-HDBK-1797 with its half scale lengths); tilt: balance of "
    "thrust and weight; control: gains 0.95/s on place and 1.8/s on speed of PX4 (MPC_XY_P, "
    "MPC_XY_VEL_P_ACC) at a lag of 0.1 s, scaled with it; " + flight.SOURCE
)
DEFAULTS = {"wind_mps": 7.7}
IDLE = [{"wind_mps": 0}]
JUMPS = True

SPEED_GAIN = 0.18
DISPLACEMENT_GAIN = 0.0171
"""Thrust against speed times the attitude's lag, and against displacement times its square.

They are stable at any drag.
"""

FOOT_M = 0.3048
HEIGHTS_FT = (10.0, 1000.0)
"""Range of the low-altitude model; outside it the nearer end is used."""
ROUGHNESS_FT = 2.0
"""Roughness length of the mean wind's profile, all flight phases but landing."""
SLOWEST_MPS = 0.1
"""Least airspeed, below which turbulence would stand still around the target."""
GRAVITY_MPS2 = flight.GRAVITY_MPS2


def turbulence(height_m: float, wind_mps: float) -> tuple[np.ndarray, np.ndarray]:
    """Return scale lengths (3,) m and intensities (3,) m/s along the wind, across it and upwards.

    wind_mps: speed 20 ft (6 m) above ground. Source: MIL-F-8785C, section 3.7, low altitude.
    """
    feet = float(np.clip(height_m / FOOT_M, *HEIGHTS_FT))
    ratio = 0.177 + 0.000823 * feet
    up = 0.1 * wind_mps
    along_m = feet * FOOT_M / portable.power(ratio, 1.2)
    along_mps = up / portable.power(ratio, 0.4)
    scales = np.array([along_m, along_m, feet * FOOT_M])
    return scales, np.array([along_mps, along_mps, up])


def mean_wind_mps(height_m: float, wind_mps: float) -> float:
    """Return the mean wind's speed (m/s) at a height.

    It follows from that at 20 ft. Source: MIL-F-8785C, section 3.7.
    """
    feet = float(np.clip(height_m / FOOT_M, *HEIGHTS_FT))
    return float(wind_mps * portable.log(feet / ROUGHNESS_FT) / portable.log(20.0 / ROUGHNESS_FT))


def process(
    scale: float, longitudinal: bool, response: float, lag: float
) -> tuple[np.ndarray, ...]:
    """Return drift (5, 5), noise (5,) and outputs (4, 5) of one axis.

    The process is unit turbulence and the target's response; times are in steps.

    scale: the turbulence's time L / V; response: of the velocity to the air; lag: of the attitude.
    Outputs: gust, the target's velocity (both of unit turbulence), its displacement (that times a
    step) and its thrust's acceleration (that over a step). Each state is an integral of those
    before it with weights near one, so that their steps' covariances stay well conditioned however
    short a step is.
    """
    a = 1.0 / scale
    b = 1.0 / response
    c = 1.0 / lag
    # The lateral filter (1 + sqrt(3) t s) / (1 + t s)^2 is a mix of a first- and a second-order
    # lag.
    mix = (1.0 / np.sqrt(3.0) - 1.0) * a
    gain = np.sqrt(3.0 * a)
    if longitudinal:
        mix = 0.0
        gain = np.sqrt(2.0 * a)
    drift = np.array(
        [
            [-a, 0, 0, 0, 0],
            [1, -a, 0, 0, 0],
            [1, mix, -b, 0, 1],
            [0, 0, 1, 0, 0],
            [0, 0, -SPEED_GAIN * c * c, -DISPLACEMENT_GAIN * c * c * c, -c],
        ]
    )
    outputs = gain * np.array(
        [[1, mix, 0, 0, 0], [0, 0, b, 0, 0], [0, 0, 0, b, 0], [0, 0, 0, 0, b]]
    )
    return drift, np.array([1.0, 0, 0, 0, 0]), outputs


@lru_cache(maxsize=4096)
def axis(
    scale: float, longitudinal: bool, response: float, lag: float
) -> tuple[Steps, np.ndarray, np.ndarray]:
    """Return one axis's steps, the root (5, 5) of its stationary covariance, and outputs (4, 5).

    The covariance is that of its states.

    Answers are kept: all stations ask for the same axes of a target.
    """
    drift, noise, outputs = process(scale, longitudinal, response, lag)
    over_step = steps(drift, noise)
    return over_step, root_of(stationary(over_step)), outputs


def perturb(
    settings: dict, cloud: Cloud, row: dict, times_s: np.ndarray, rng: np.random.Generator
) -> Perturbation:
    """Return a flying target's offset (N, 3) m and tilt (N, 3) rad at `times_s` (N,) s.

    The times are equally spaced.

    The motion table's position is the target's at the first of the times. The wind's direction is
    drawn. Nothing is returned for targets on the ground.
    """
    if cloud.like not in ("UAV", "Bird"):
        return Perturbation({})
    heading = rng.uniform(0.0, 2 * np.pi)
    first = rng.standard_normal((3, 5))
    normal = rng.standard_normal((3, len(times_s) - 1, 5))
    forward = np.array([portable.cos(heading), portable.sin(heading), 0.0])
    velocity = np.array([row["vx_mps"], row["vy_mps"], row["vz_mps"]])
    scales, intensities = turbulence(row["z_m"], settings["wind_mps"])
    through = velocity - mean_wind_mps(row["z_m"], settings["wind_mps"]) * forward
    airspeed = max(float(portable.norm(through)), SLOWEST_MPS)
    step = step_s(times_s)
    level, up = flight.response_s(cloud, airspeed)
    lag = flight.attitude_s(cloud)
    processes = []
    starts = []
    outputs = []
    for number, response in enumerate((level, level, up)):
        scale = scales[number] / airspeed / step
        over_step, root, of_axis = axis(scale, number == 0, response / step, lag / step)
        processes.append(over_step)
        starts.append(portable.applied(root, first[number]))
        outputs.append(of_axis)
    states = walk(processes, np.stack(starts), normal)
    unit = [portable.product(states[i], outputs[i].T) for i in range(3)]
    answer = np.stack(unit) * intensities[:, None, None]
    wind = np.stack([forward, [-forward[1], forward[0], 0.0], [0.0, 0.0, 1.0]])
    offset = portable.product((answer[..., 2] - answer[:, :1, 2]).T, wind) * step
    acceleration = portable.product(answer[..., 3].T, wind) / step
    ahead = attitude(row["yaw_rad"], 0.0, 0.0)
    in_body = portable.product(acceleration, ahead)
    return Perturbation({}, offset, tilt(in_body, pitches=cloud.like == "UAV"))


def tilt(acceleration_mps2: np.ndarray, pitches: bool) -> np.ndarray:
    """Return yaw, pitch and roll (N, 3) rad that give the thrust an acceleration (N, 3).

    The acceleration is to the right, to the front and up.

    pitches: whether the body also pitches for its acceleration to the front, as a multirotor does
    and a bird does not.
    """
    result = np.zeros((len(acceleration_mps2), 3))
    if pitches:
        result[:, 1] = -portable.arctan(acceleration_mps2[:, 1] / GRAVITY_MPS2)
    result[:, 2] = portable.arctan(acceleration_mps2[:, 0] / GRAVITY_MPS2)
    return result
