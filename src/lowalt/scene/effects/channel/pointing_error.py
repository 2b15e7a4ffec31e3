"""Beams that miss the target: their direction has an error, and the target flies on.

The error is drawn anew at every update, and between updates the beams stand still. Both beams point
where the tracker last saw the target, off by the error. Without updates they keep pointing at the
target's position at the first symbol, as the paper's do. An update turns the beams about the
arrays' middles, so a target in mid-beam keeps its phase. The land keeps the first beam. Every
station has one error, in its own look and as either end of its links.
"""

import numpy as np

from lowalt.files.errors import InputError
from lowalt.numerics import portable
from lowalt.scene.checks import CheckedScene
from lowalt.scene.view import Beams, View

SOURCE = (
    "R. J. Mailloux, Phased Array Antenna Handbook, 3rd ed. 2018, ch. 1 and 7 (pattern and "
    "pointing error of a steered array); standard deviation of a tenth of the default array's 6.4 "
    "degrees beam: estimate"
)
DEFAULTS = {"sigma_deg": 0.64, "update_s": None}
IDLE = [{"sigma_deg": 0, "update_s": None}]


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for updates more frequent than symbols."""
    step = scene.network.symbol_interval_s
    if settings["update_s"] is not None and settings["update_s"] < step:
        raise InputError(
            f"effects.pointing_error.update_s: {settings['update_s']}, expected null or at least "
            f"the symbol interval {step}"
        )


def turned(aim_m: np.ndarray, station_m: np.ndarray, angles_rad: np.ndarray) -> np.ndarray:
    """Return aims (K, 3) m turned about the station by angles (K, 2) rad, azimuth and elevation.

    Their range from the station stays the same.
    """
    way = aim_m - station_m
    range_m = portable.norm(way)[:, None]
    level_m = portable.norm(way[:, :2])
    azimuth = portable.arctan2(way[:, 1], way[:, 0]) + angles_rad[:, 0]
    elevation = portable.arctan2(way[:, 2], level_m) + angles_rad[:, 1]
    up, level = portable.sine_cosine(elevation)
    along_y, along_x = portable.sine_cosine(azimuth)
    return station_m + range_m * np.stack([level * along_x, level * along_y, up], axis=1)


def beams(settings: dict, view: View, rng: np.random.Generator) -> Beams:
    """Return the beams of the look: one beam, or one for each update.

    Two numbers are drawn for each beam: its errors in azimuth and in elevation.
    """
    starts_s = np.zeros(1)
    update_s = settings["update_s"]
    if update_s is not None:
        # The nanosecond lets an update at the last symbol count whatever its rounding.
        end_s = float(view.network.times_s[-1]) + 1e-9
        starts_s = np.arange(0.0, end_s, update_s)
    velocity = np.array([view.row[f"v{axis}_mps"] for axis in "xyz"])
    errors_rad = np.radians(settings["sigma_deg"] * rng.standard_normal((len(starts_s), 2)))
    tracked_m = view.aim_m + starts_s[:, None] * velocity
    return Beams(starts_s, turned(tracked_m, np.asarray(view.station.position_m), errors_rad))
