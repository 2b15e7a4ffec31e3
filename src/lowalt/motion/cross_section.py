"""The mean radar cross section of a moving target, whose points add with their phases.

The amplitudes of points closer than a quarter of a wavelength add coherently, and a smooth surface
that does not face the station reflects little. The mean therefore differs from the sum of the
points' cross sections by up to 5 dB.
"""

import numpy as np

from lowalt.config.classes import AIRBORNE
from lowalt.motion.poses import Perturbation, poses
from lowalt.motion.table import NUMBERS
from lowalt.numerics import portable
from lowalt.targets.cloud import Cloud

LOOKS = 2048
TILT_DEG = 20.0
"""Largest pitch and roll of a target in the air, as in config/default.yaml."""
SEEN_FROM_DEG = {True: (-20.0, 0.0), False: (3.0, 10.0)}
"""Elevations of a station seen from a target in the air (True) and on the ground.

They are most of those of config/default.yaml, masts of 25 m.
"""
_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71, 73)


def mean_cross_section(cloud: Cloud, wavelength_m: float) -> float:
    """Return the mean (m2) over aspects and motion of |sum of sqrt(rcs) exp(-j 4 pi r / lambda)|^2.

    For plane waves of one frequency, without the losses of beams and range cells. Aspects are those
    of config/default.yaml: every yaw, `TILT_DEG`, `SEEN_FROM_DEG`; motion is every phase of rotors,
    wheels and wings, and every moment of a recording. They follow a low-discrepancy sequence, which
    gives the mean to about 0.2 dB.
    Source: Knott et al., Radar Cross Section, 1993, 3.3; multiples of roots of primes: Niederreiter
    1992, ch. 3.
    """
    turning = [*cloud.parts_of("rotor"), *cloud.parts_of("wheel")]
    # Columns: pitch, roll, yaw, elevation, time, and the angle of each part that turns.
    even = np.arange(1, LOOKS + 1)[:, None] * np.sqrt(_PRIMES[: 5 + len(turning)]) % 1.0
    of_yaw, of_elevation, of_time = even[:, 2:5].T
    flies = cloud.like in AIRBORNE
    tilt = np.radians(TILT_DEG) * flies * (2.0 * even[:, :2] - 1.0)
    attitude = np.column_stack([2 * np.pi * of_yaw, tilt])
    low, high = SEEN_FROM_DEG[flies]
    sine, cosine = portable.sine_cosine(np.radians(low + (high - low) * of_elevation))
    toward = np.column_stack([np.zeros(LOOKS), cosine, sine])
    lasts_s = 1.0
    if len(cloud.track):
        lasts_s = len(cloud.track) / cloud.record["track_rate_hz"]
    row = {"model": 0, **dict.fromkeys(NUMBERS, 0.0), "rate_hz": 1.0, "playback": 1.0}
    turns = {part: 2 * np.pi * even[:, 5 + order] for order, part in enumerate(turning)}
    changes = Perturbation(turns, None, attitude)
    rotation, translation = poses(cloud, row, lasts_s * of_time, changes)
    nearer = portable.dot(translation, toward[:, None])[:, cloud.part]
    axes = portable.applied(rotation.swapaxes(2, 3), toward[:, None])
    for axis in range(3):
        nearer += axes[:, cloud.part, axis] * cloud.points[:, axis]
    two_way_turns = 2.0 / wavelength_m * nearer
    sines, cosines = portable.sine_cosine_turns(two_way_turns)
    amplitude = np.sqrt(np.asarray(cloud.rcs_m2, float))
    imaginary = portable.total(amplitude * sines)
    real = portable.total(amplitude * cosines)
    return float(portable.mean(imaginary * imaginary + real * real))
