"""Absolute mean cross sections: a target has that of its class and size.

Its points share the mean cross section.

The paper gives every point 1 m2, so a sparrow of 158 points has 158 m2. With this effect, the
points share the target's mean cross section: all blades together are `blades_db` below the rest,
and the points of each group keep their ratios. A common factor makes the power of their coherent
sum, averaged over aspects and motion, equal to the stated mean.
"""

import hashlib
import math
from dataclasses import replace

import numpy as np

from lowalt.files.errors import InputError
from lowalt.motion.cross_section import mean_cross_section
from lowalt.scene.target_classes import (
    HUMAN_DBSM,
    LARGE_UAV_DBSM,
    LARGE_UAV_M,
    SMALL_UAV_DBSM,
    SMALL_UAV_M,
    VEHICLE_DBSM,
    size_m,
)
from lowalt.targets.cloud import Cloud

SOURCE = (
    "3GPP TR 38.901 V19.4.0, Tables 7.9.2.1-1 to 7.9.2.1-4, 10 lg sigma_M: UAV of small size (0.4 "
    "m) -12.81 dBsm, of large size (1.6 m) -5.85, human -1.37, vehicle 11.25; other UAV sizes "
    "straight in dB over log size: estimate; birds: pigeon at 4.9 GHz between its S- and X-band "
    "values of Konrad, Hicks & Dobson, Science 159, 1968, with the square of the length: estimate"
)
DEFAULTS = {"dbsm": {}, "blades_db": -15.0}

PIGEON_M = 0.22
PIGEON_DBSM = -24.6
_KEPT: dict[bytes, np.ndarray] = {}
"""Cross sections of clouds by their content.

The mean over thousands of looks takes longer than a sample.
"""


def mean_dbsm(category: str, size: float) -> float:
    """Return a target's mean cross section (dBsm) by its class and size.

    size: the largest dimension of its body (m).
    """
    if category == "UAV":
        slope = (LARGE_UAV_DBSM - SMALL_UAV_DBSM) / math.log10(LARGE_UAV_M / SMALL_UAV_M)
        return float(SMALL_UAV_DBSM + slope * math.log10(size / SMALL_UAV_M))
    if category == "Bird":
        return float(PIGEON_DBSM + 20.0 * math.log10(size / PIGEON_M))
    return {"Pedestrian": HUMAN_DBSM, "Vehicle": VEHICLE_DBSM}[category]


def cross_sections(settings: dict, cloud: Cloud, wavelength_m: float) -> np.ndarray:
    """Return each point's cross section (L,) m2.

    `motion.cross_section.mean_cross_section` of them is the target's.

    Raises: InputError for a flying target whose size is not known.
    settings: dbsm: {subtype: dBsm} replaces the class's value; blades_db: all blades together
    against the rest.
    """
    size = size_m(cloud)
    dbsm = settings["dbsm"].get(cloud.subtype)
    if dbsm is None and size == 0 and cloud.like in ("UAV", "Bird"):
        raise InputError(
            f"effects.mean_cross_section: the body of {cloud.subtype} is one point, which has no "
            "size, expected its mean in dbsm"
        )
    if dbsm is None:
        dbsm = mean_dbsm(cloud.like, size)
    total = 10 ** (dbsm / 10)
    text = repr((cloud.like, cloud.kinds, total, settings["blades_db"], wavelength_m))
    digest = hashlib.sha256(text.encode())
    arrays = (cloud.points, cloud.part, cloud.hinges, cloud.axes, cloud.track, cloud.rcs_m2)
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    key = digest.digest()
    if key not in _KEPT:
        _KEPT[key] = shared(cloud, total, settings["blades_db"], wavelength_m)
    return _KEPT[key]


def shared(cloud: Cloud, total_m2: float, blades_db: float, wavelength_m: float) -> np.ndarray:
    """Return cross sections (L,) m2 whose mean is `total_m2`.

    They are in the ratios of the cloud's and of `blades_db`.
    """
    blades = np.isin(cloud.part, cloud.parts_of("rotor"))
    weight = np.asarray(cloud.rcs_m2, float)
    shares = np.zeros(len(cloud.rcs_m2))
    for mine, share in ((~blades, 1.0), (blades, 10 ** (blades_db / 10))):
        if weight[mine].sum() > 0:
            shares[mine] = share * weight[mine] / weight[mine].sum()
    mean = mean_cross_section(replace(cloud, rcs_m2=shares), wavelength_m)
    return total_m2 / mean * shares if mean > 0 else shares
