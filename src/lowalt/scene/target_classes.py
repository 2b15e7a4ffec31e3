"""Sizes and mean cross sections of the sensing targets of 3GPP TR 38.901 V19.4.0, section 7.9."""

from typing import NamedTuple

import numpy as np

from lowalt.targets.cloud import Cloud

SMALL_UAV_M = 0.4
LARGE_UAV_M = 1.6
"""Largest dimensions of TR 38.901's two UAVs (Table 7.9.1-1)."""
SMALL_UAV_DBSM = -12.81
LARGE_UAV_DBSM = -5.85
HUMAN_DBSM = -1.37
VEHICLE_DBSM = 11.25
"""10 lg sigma_M of Tables 7.9.2.1-1, -2 and -4 (dBsm)."""


class Lobe(NamedTuple):
    """One face of a target.

    azimuth, zenith: its centre (degrees), with 3 dB widths; peak_dbsm: largest value; depth_db:
    depth.
    """

    azimuth: float | None
    azimuth_width: float
    zenith: float
    zenith_width: float
    peak_dbsm: float
    depth_db: float


LARGE_UAV = (
    Lobe(0, 14.19, 90, 16.53, 1.02, 7.89),
    Lobe(90, 7.13, 90, 8.68, 7.43, 14.30),
    Lobe(180, 10.09, 90, 11.43, 3.99, 10.86),
    Lobe(270, 7.13, 90, 8.68, 7.43, 14.30),
    Lobe(None, 1.0, 0, 4.93, 13.55, 20.42),
    Lobe(None, 1.0, 180, 4.93, 13.55, 20.42),
)
"""Front, left, back, right, roof, bottom: Table 7.9.2.1-2."""
VEHICLE = (
    Lobe(0, 40.54, 71.75, 29.13, 15.52, 8.45),
    Lobe(90, 26.90, 79.70, 44.42, 20.75, 13.68),
    Lobe(180, 36.32, 79.65, 36.73, 14.56, 7.50),
    Lobe(270, 26.90, 79.70, 44.42, 20.75, 13.68),
    Lobe(None, 1.0, 0, 18.13, 21.26, 14.19),
)
"""Front, left, back, right, roof: Table 7.9.2.1-4."""


def size_m(cloud: Cloud) -> float:
    """Return the largest dimension of a target's body, blades and wings left out (m)."""
    points = cloud.points
    of_body = np.isin(cloud.part, cloud.parts_of("body"))
    if of_body.any():
        points = points[of_body]
    return float(np.ptp(points, axis=0).max())


def large(cloud: Cloud) -> bool:
    """Return whether a UAV counts as large.

    A large one's body is longer than the geometric mean of the two sizes.
    """
    return size_m(cloud) > np.sqrt(SMALL_UAV_M * LARGE_UAV_M)
