"""A small craft with one rotor, its motion rows and a network of two stations: inputs of many
tests.
"""

import math

import numpy as np

from lowalt.motion.table import NUMBERS
from lowalt.targets.cloud import Cloud

NETWORK = {
    "carrier_hz": 4.9e9,
    "subcarrier_spacing_hz": 120e3,
    "subcarriers": 256,
    "guard_subcarriers": 10,
    "symbol_interval_s": 2.5e-3,
    "symbols": 30,
    "transmit_array": [16, 4],
    "receive_array": [16, 4],
    "power_w": 1.0,
    "stations": {
        "A": {"position_m": [0, 0, 25], "normal_deg": 30},
        "B": {"position_m": [500, 0, 25], "normal_deg": 150},
    },
}


def craft() -> Cloud:
    """The craft: ten points of the body and ten of a rotor."""
    rng = np.random.default_rng(0)
    count = 20
    return Cloud(
        points=rng.normal(scale=0.2, size=(count, 3)),
        part=np.repeat([0, 1], 10),
        kinds=("body", "rotor"),
        names=("body", "rotor 1"),
        parents=np.array([-1, -1]),
        hinges=np.array([[np.nan] * 3, [0.2, 0.1, 0.05]]),
        axes=np.array([[np.nan] * 3, [0.0, 0.0, 1.0]]),
        normals=np.full((count, 3), np.nan),
        rcs_m2=np.ones(count),
        record={"subtype": "DJI Mini 2", "category": "UAV", "source": "test", "checksum": "0"},
    )


def row(model: int) -> dict:
    """The row of a motion model."""
    rng = np.random.default_rng(model)
    values = dict.fromkeys(NUMBERS, math.nan) | dict.fromkeys(
        ("yaw_rad", "pitch_rad", "roll_rad"), 0.1
    )
    place = dict(zip(("x_m", "y_m", "z_m"), (200.0, 100.0 + model, 60.0), strict=True))
    speed = dict(zip(("vx_mps", "vy_mps", "vz_mps"), rng.normal(size=3), strict=True))
    rotor = {"rate_hz": 80.0, "phase_0_rad": 0.3, "phase_1_rad": 0.3}
    return {
        "subtype": "DJI Mini 2",
        "category": "UAV",
        "group": "seen",
        "model": model,
        **values,
        **place,
        **speed,
        **rotor,
    }
