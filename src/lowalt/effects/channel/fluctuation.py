"""Fluctuation of a target's cross section: an angular pattern (B1) and a log-normal factor (B2) on its mean (A).

Both act on all points alike. The log-normal factor is drawn once a look and station. The pattern follows the direction
of the station in the body's frame; TR 38.901 gives none to small UAVs, people and birds.
"""

from typing import NamedTuple

import numpy as np

from lowalt.common.errors import InputError
from lowalt.effects.channel.target_classes import (
    LARGE_UAV_DBSM,
    LARGE_UAV_M,
    SMALL_UAV_M,
    VEHICLE_DBSM,
    size_m,
)
from lowalt.effects.checks import CheckedScene
from lowalt.effects.view import View
from lowalt.targets.cloud import Cloud

SOURCE = (
    "3GPP TR 38.901 V19.4.0, Eqs. 7.9.2-1 and 7.9.2-3, Tables 7.9.2.1-1, -2 and -4 (A, B1, B2 are sigma_M, sigma_D, "
    "sigma_S there); birds take the small UAV's spread: estimate"
)
DEFAULTS = {"pattern": True, "spread_db": None}

CUT = 3.0
"""Standard deviations above its mean at which the log-normal factor is cut (TR 38.901, Eq. 7.9.4-1)."""


class Lobe(NamedTuple):
    """One face of a target: centres and 3 dB widths (degrees), largest value (dBsm) and depth (dB)."""

    azimuth: float | None
    azimuth_width: float
    zenith: float
    zenith_width: float
    peak_dbsm: float
    depth_db: float


LARGE_UAV = (
    Lobe(0, 14.19, 90, 16.53, 1.02, 7.89), Lobe(90, 7.13, 90, 8.68, 7.43, 14.30),
    Lobe(180, 10.09, 90, 11.43, 3.99, 10.86), Lobe(270, 7.13, 90, 8.68, 7.43, 14.30),
    Lobe(None, 1.0, 0, 4.93, 13.55, 20.42), Lobe(None, 1.0, 180, 4.93, 13.55, 20.42),
)  # fmt: skip
"""Front, left, back, right, roof, bottom: Table 7.9.2.1-2."""
VEHICLE = (
    Lobe(0, 40.54, 71.75, 29.13, 15.52, 8.45), Lobe(90, 26.90, 79.70, 44.42, 20.75, 13.68),
    Lobe(180, 36.32, 79.65, 36.73, 14.56, 7.50), Lobe(270, 26.90, 79.70, 44.42, 20.75, 13.68),
    Lobe(None, 1.0, 0, 18.13, 21.26, 14.19),
)  # fmt: skip
"""Front, left, back, right, roof: Table 7.9.2.1-4."""


def idle(settings: dict) -> bool:
    """Return whether the cross section keeps its mean."""
    return not settings["pattern"] and settings["spread_db"] == 0


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for two patterns at once."""
    if settings["pattern"] and "cross_sections" in scene.effects:
        raise InputError(
            "effects.fluctuation: pattern is true and effects.cross_sections gives every point a pattern of its own, "
            "expected pattern: false in a scene with both"
        )


def large(cloud: Cloud) -> bool:
    """Return whether a UAV counts as large: its body is longer than the geometric mean of the two sizes."""
    return size_m(cloud) > np.sqrt(SMALL_UAV_M * LARGE_UAV_M)


def spread_db(cloud: Cloud) -> float:
    """Return the standard deviation of B2 in dB, by class and size."""
    if cloud.like == "UAV" and large(cloud):
        return 2.50
    return {"UAV": 3.74, "Bird": 3.74, "Pedestrian": 3.94, "Vehicle": 3.41}[cloud.like]


def pattern_dbsm(faces: tuple[Lobe, ...], azimuth_deg: np.ndarray, zenith_deg: np.ndarray) -> np.ndarray:
    """Return 10 lg(sigma_M sigma_D) of a target's face in a direction (any shape); azimuth 0 front, 90 left.

    Faces share the directions as the tables say: the roof above 45 degrees (30 for vehicles), then quarters of azimuth.
    """
    roof, floor = (45.0, 135.0) if len(faces) == len(LARGE_UAV) else (30.0, 181.0)
    face = (np.floor((azimuth_deg + 45.0) / 90.0) % 4).astype(int)
    face = np.where(zenith_deg < roof, 4, np.where(zenith_deg >= floor, 5, face))
    centre, width, high, tall, peak, depth = (
        np.array([0.0 if one[k] is None else one[k] for one in faces])[np.minimum(face, len(faces) - 1)]
        for k in range(6)
    )
    off = (azimuth_deg - centre + 180.0) % 360.0 - 180.0
    across = np.where(face >= 4, 0.0, np.minimum(12.0 * (off / width) ** 2, depth))
    along = np.minimum(12.0 * ((zenith_deg - high) / tall) ** 2, depth)
    return peak - np.minimum(across + along, depth)


def pattern(view: View) -> np.ndarray:
    """Return B1 (N, 1), relative to the mean cross section, in the station's direction."""
    cloud = view.cloud
    faces = None
    if cloud.like == "Vehicle":
        faces, mean = VEHICLE, VEHICLE_DBSM
    elif cloud.like == "UAV" and large(cloud):
        faces, mean = LARGE_UAV, LARGE_UAV_DBSM
    if faces is None or "body" not in cloud.kinds:
        return np.ones((len(view.times_s), 1))
    body = cloud.kinds.index("body")
    away = np.asarray(view.station.position_m) - view.motion.translation[:, body]
    right, front, up = np.einsum("nij,ni->jn", view.motion.rotation[:, body], away)
    azimuth = np.degrees(np.arctan2(-right, front)) % 360.0
    zenith = np.degrees(np.arctan2(np.hypot(right, front), up))
    return 10 ** ((pattern_dbsm(faces, azimuth, zenith) - mean) / 10)[:, None]


def visible(settings: dict, view: View, rng: np.random.Generator) -> np.ndarray:
    """Return the factor (N, 1) on all amplitudes: the root of B1 B2; one draw a sample and station.

    B2 is log-normal with mean one: its mean in dB is -ln(10) / 20 times its variance (Eq. 7.9.2-1).
    """
    spread = spread_db(view.cloud) if settings["spread_db"] is None else settings["spread_db"]
    gained_db = -np.log(10) / 20 * spread**2 + spread * min(float(rng.standard_normal()), CUT)
    factor = pattern(view) if settings["pattern"] else np.ones((len(view.times_s), 1))
    return np.sqrt(factor * 10 ** (gained_db / 10))
