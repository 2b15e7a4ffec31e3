"""Fluctuation of a target's cross section about its mean (A).

An angular pattern (B1) and a log-normal factor (B2) act on the mean.

Both act on all points alike. The log-normal factor is drawn once per look and station; both
directions of a link share one draw. The pattern depends on the direction of the station in the
frame of the body; TR 38.901 has none for small UAVs, people and birds. On a link, the pattern is
taken at the bisector of both ends. All classes then also have a loss that depends on the bistatic
angle.
"""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.scene.checks import CheckedScene
from lowalt.scene.target_classes import (
    LARGE_UAV,
    LARGE_UAV_DBSM,
    VEHICLE,
    VEHICLE_DBSM,
    Lobe,
    large,
)
from lowalt.scene.view import View
from lowalt.targets.cloud import Cloud

SOURCE = (
    "3GPP TR 38.901 V19.4.0, Eqs. 7.9.2-1 to 7.9.2-3, Tables 7.9.2.1-1, -2 and -4 (A, B1, B2 are "
    "sigma_M, sigma_D, sigma_S there); on links, no forward scattering (sigma_FS of minus "
    "infinity) and one draw for both directions (reciprocity): estimates; birds take the small "
    "UAV's spread and loss: estimate"
)
DEFAULTS = {"pattern": True, "spread_db": None}
DRAWN = "pair"
ONE_SIDED = True
IDLE = [{"pattern": False, "spread_db": 0}]

CUT = 3.0
"""Standard deviations above its mean at which the log-normal factor is cut (TR 38.901, Eq.
7.9.4-1).
"""


ROOF = 4
BOTTOM = 5
"""Numbers of the faces above and below, behind those in front, on the left, back and right."""
BISTATIC = {LARGE_UAV: (6.05, 1.33), VEHICLE: (6.0, 1.65)}
"""k1 (dB) and k2 of Eq. 7.9.2-3."""
BISTATIC_DB = 3.0
"""Loss of a target without a pattern where both ends stand on opposite sides (Eq. 7.9.2-2)."""


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for two patterns at once."""
    if settings["pattern"] and "cross_sections" in scene.effects:
        raise InputError(
            "effects.fluctuation: pattern is true and effects.cross_sections gives every point a "
            "pattern of its own, expected pattern: false in a scene with both"
        )


def spread_db(cloud: Cloud) -> float:
    """Return the standard deviation of B2 in dB, by class and size."""
    if cloud.like == "UAV" and large(cloud):
        return 2.50
    return {"UAV": 3.74, "Bird": 3.74, "Pedestrian": 3.94, "Vehicle": 3.41}[cloud.like]


def pattern_dbsm(
    faces: tuple[Lobe, ...], azimuth_deg: np.ndarray, zenith_deg: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return 10 lg(sigma_M sigma_D) of a target's face in a direction (any shape).

    The least value (dBsm) comes second.

    azimuth: 0 front, 90 left.

    Faces share the directions as the tables say: the roof above 45 degrees (30 for vehicles), then
    quarters of azimuth.
    """
    # A vehicle has no face below.
    roof_deg = 30.0
    bottom_deg = 181.0
    if len(faces) == len(LARGE_UAV):
        roof_deg = 45.0
        bottom_deg = 135.0
    face = (np.floor((azimuth_deg + 45.0) / 90.0) % 4).astype(int)
    face = np.where(zenith_deg >= bottom_deg, BOTTOM, face)
    face = np.where(zenith_deg < roof_deg, ROOF, face)
    # Rows: centre and width in azimuth, centre and width in zenith angle, peak, depth.
    table = np.array([lobe._replace(azimuth=lobe.azimuth or 0.0) for lobe in faces], float).T
    centre, width, high, tall, peak, depth = table[:, np.minimum(face, len(faces) - 1)]
    off = (azimuth_deg - centre + 180.0) % 360.0 - 180.0
    across = np.where(face >= ROOF, 0.0, np.minimum(12.0 * (off / width) ** 2, depth))
    along = np.minimum(12.0 * ((zenith_deg - high) / tall) ** 2, depth)
    return peak - np.minimum(across + along, depth), peak - depth


def bistatic_loss_db(faces: tuple[Lobe, ...] | None, angle_rad: np.ndarray) -> np.ndarray:
    """Return the loss (dB) at bistatic angles of 0 to pi (any shape).

    faces: None for a target without a pattern.

    Source: TR 38.901, Eq. 7.9.2-3, without its floor, and Eq. 7.9.2-2.
    """
    if faces is None:
        return BISTATIC_DB * portable.sin(0.5 * angle_rad)
    k1, k2 = BISTATIC[faces]
    cosine = portable.cos(0.5 * angle_rad)
    narrowed_db = 5.0 / portable.LN_10 * portable.log(np.where(cosine > 0, cosine, 1.0))
    loss_db = k1 * portable.sin(0.5 * k2 * angle_rad) - narrowed_db
    return np.where(cosine > 0, loss_db, np.inf)


def pattern(view: View) -> np.ndarray:
    """Return B1 (N, 1), relative to the mean cross section.

    It is taken in the station's direction or at a link's bisector.
    """
    cloud = view.cloud
    faces: tuple[Lobe, ...] | None = None
    mean = 0.0
    if "body" in cloud.kinds and cloud.like == "Vehicle":
        faces = VEHICLE
        mean = VEHICLE_DBSM
    elif "body" in cloud.kinds and cloud.like == "UAV" and large(cloud):
        faces = LARGE_UAV
        mean = LARGE_UAV_DBSM
    ends = view.ends()
    if faces is None and len(ends) == 1:
        return np.ones((len(view.times_s), 1))
    body = cloud.kinds.index("body") if "body" in cloud.kinds else 0
    ways = [np.asarray(end.station.position_m) - view.motion.translation[:, body] for end in ends]
    away = ways[0]
    angle = np.zeros(len(view.times_s))
    if len(ends) == 2:
        units = [way / portable.norm(way)[:, None] for way in ways]
        away = units[0] + units[1]
        # The half angle by its tangent keeps small and large angles exact.
        angle = 2.0 * portable.arctan2(portable.norm(units[0] - units[1]), portable.norm(away))
    loss = bistatic_loss_db(faces, angle)
    if faces is None:
        return portable.from_decibels(-loss)[:, None]
    right, front, up = portable.applied(view.motion.rotation[:, body].swapaxes(1, 2), away).T
    flat = np.sqrt(right * right + front * front)
    azimuth = np.degrees(portable.arctan2(-right, front)) % 360.0
    zenith = np.degrees(portable.arctan2(flat, up))
    shone, floor = pattern_dbsm(faces, azimuth, zenith)
    return portable.from_decibels(np.maximum(shone - loss, floor) - mean)[:, None]


def visible(settings: dict, view: View, rng: np.random.Generator) -> np.ndarray:
    """Return the factor (N, 1) on all amplitudes: the root of B1 B2.

    There is one draw per look and station or pair.

    B2 is log-normal with mean one: its mean in dB is -ln(10) / 20 times its variance (Eq. 7.9.2-1).
    """
    spread = settings["spread_db"]
    if spread is None:
        spread = spread_db(view.cloud)
    gained_db = -portable.LN_10 / 20 * spread**2 + spread * min(float(rng.standard_normal()), CUT)
    factor = np.ones((len(view.times_s), 1))
    if settings["pattern"]:
        factor = pattern(view)
    return np.sqrt(factor * 10 ** (gained_db / 10))
