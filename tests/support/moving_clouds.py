"""A cloud with one moving part, and rows of the motion table, made for tests of motion."""

import math

import numpy as np

from lowalt.motion.table import NUMBERS
from lowalt.targets.cloud import Cloud
from lowalt.targets.skeleton import node_cloud

SETTINGS = {
    "region": {"polygon_m": None, "mast_clearance_m": 10.0},
    "height_m": {"UAV": [30.0, 150.0], "Bird": [20.0, 120.0]},
    "tilt_deg": 20.0,
    "cadence": "free",
}
"""Settings of the draws of motion models."""


def rigid_cloud(kind: str, category: str, extra: dict | None = None) -> Cloud:
    """A body point and one moving part of three points, hinged off the origin about a slanted axis."""
    axis = np.array([1.0, 2.0, 2.0]) / 3
    nothing = np.full(3, np.nan)
    return Cloud(
        points=np.array([[0.0, 0, 0], [0.3, 0, 0], [0.3, 0.2, 0], [0.4, 0.1, 0.1]]),
        part=np.array([0, 1, 1, 1]),
        kinds=("body", kind),
        names=("body", f"{kind} 0"),
        parents=np.array([-1, -1]),
        hinges=np.array([nothing, [0.3, 0.1, 0.0]]),
        axes=np.array([nothing, axis]),
        normals=np.full((4, 3), np.nan),
        rcs_m2=np.ones(4),
        record={
            "subtype": "test",
            "category": category,
            "source": "test",
            "checksum": "",
            **(extra or {}),
        },
    )


def recorded_cloud(**extra: float) -> Cloud:
    """A recording of twelve frames of 31 nodes at 120 Hz, every node anywhere; `extra` facts of its
    record.
    """
    track = np.random.default_rng(3).normal(size=(12, 31, 3))
    record = {
        "subtype": "t",
        "category": "Pedestrian",
        "source": "",
        "checksum": "",
        "track_rate_hz": 120.0,
        **extra,
    }
    return node_cloud(track, {"rcs_m2_per_point": 1.0, **record}, tuple(map(str, range(31))))


def row(**values: float) -> dict:
    """A motion row at rest at the origin, with the given values changed."""
    rest = dict.fromkeys(NUMBERS, math.nan)
    rest.update(dict.fromkeys(("x_m", "y_m", "z_m", "vx_mps", "vy_mps", "vz_mps"), 0.0))
    rest.update(yaw_rad=0.0, pitch_rad=0.0, roll_rad=0.0)
    return {"subtype": "test", "category": "UAV", "group": "seen", "model": 0, **rest, **values}
