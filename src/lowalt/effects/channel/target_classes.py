"""Sizes and mean cross sections of the sensing targets of 3GPP TR 38.901 V19.4.0, section 7.9."""

import numpy as np

from lowalt.targets.cloud import Cloud

SMALL_UAV_M, LARGE_UAV_M = 0.4, 1.6
"""Largest dimensions of TR 38.901's two UAVs (Table 7.9.1-1)."""
SMALL_UAV_DBSM, LARGE_UAV_DBSM, HUMAN_DBSM, VEHICLE_DBSM = -12.81, -5.85, -1.37, 11.25
"""10 lg sigma_M of Tables 7.9.2.1-1, -2 and -4 (dBsm)."""


def size_m(cloud: Cloud) -> float:
    """Return the largest dimension of a target's body, blades and wings left out (m)."""
    mine = np.isin(cloud.part, cloud.parts_of("body"))
    return float(np.ptp(cloud.points[mine] if mine.any() else cloud.points, axis=0).max())
