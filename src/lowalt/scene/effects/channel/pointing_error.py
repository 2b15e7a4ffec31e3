"""Beams that miss the target.

Their direction has an error, drawn at every update, and the target flies on between.

Both beams point where the tracker last saw the target, off by the error. Without updates they keep
pointing at the target's place at the first symbol, as the paper's do. An update turns the beams
about the arrays' middles, so a target in mid-beam keeps its phase. The land keeps the first beam.
Every station has one error, in its own look and as either end of its links.
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

    Their range stays.
    """
    d = aim_m - station_m
    azimuth = portable.arctan2(d[:, 1], d[:, 0]) + angles_rad[:, 0]
    elevation = portable.arctan2(d[:, 2], portable.norm(d[:, :2])) + angles_rad[:, 1]
    r = portable.norm(d)[:, None]
    up, level = portable.sine_cosine(elevation)
    across, ahead = portable.sine_cosine(azimuth)
    return station_m + r * np.stack([level * ahead, level * across, up], axis=1)


def beams(settings: dict, view: View, rng: np.random.Generator) -> Beams:
    """Return the beams of the look: one, or one an update.

    Two numbers are drawn for each.
    """
    last = float(view.network.times_s[-1])
    update = settings["update_s"]
    starts = np.zeros(1) if update is None else np.arange(0.0, last + 1e-9, update)
    course = np.array([view.row[f"v{axis}_mps"] for axis in "xyz"])
    errors = np.radians(settings["sigma_deg"] * rng.standard_normal((len(starts), 2)))
    places = view.aim_m + starts[:, None] * course
    return Beams(starts, turned(places, np.asarray(view.station.position_m), errors))
