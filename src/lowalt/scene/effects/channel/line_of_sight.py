"""Blocked line of sight: buildings hide a target from a station.

The probability is that of a 3GPP environment.

One draw per sample and station decides for the whole look. A blocked echo loses `blocked_db` on the
way out and again on the way back. A target that is hidden from a station is also hidden on that
station's way of every link. The SNRs of the configuration refer to the echo as it arrives, so
blocking does not change the ratio of echo to noise at a set SNR.
"""

import math

import numpy as np

from lowalt.scene.view import View

SOURCE = (
    "3GPP TR 36.777, Table B-1 (UMa-AV, UMi-AV, RMa-AV), below them TR 38.901, Table 7.4.2-1; 20 "
    "dB one way: estimate, near the 17 dB between TR 36.777's path losses without and with line of "
    "sight at 300 m, height 50 m, 4.9 GHz"
)
DEFAULTS = {"environment": "UMa", "blocked_db": 20.0}
IDLE = [{"blocked_db": 0}]
WAVES = ("blocked by buildings",)


def probability(environment: str, flat_m: float, height_m: float) -> float:
    """Return the probability of line of sight at a horizontal distance and a target's height (m).

    Source: TR 36.777, Table B-1, above 22.5 m (RMa: 10 m); TR 38.901, Table 7.4.2-1, below.
    """
    lg = math.log10(max(height_m, 1.0))
    if environment == "RMa":
        if height_m > 40:
            return 1.0
        if height_m <= 10:
            return math.exp(-max(flat_m - 10, 0.0) / 1000)
        return _falling(flat_m, max(1350.8 * lg - 1602, 18.0), max(15021 * lg - 16053, 1000.0))
    if height_m > 22.5:
        if environment == "UMi":
            return _falling(flat_m, max(294.05 * lg - 432.94, 18.0), 233.98 * lg - 0.95)
        if height_m > 100:
            return 1.0
        return _falling(flat_m, max(460 * lg - 700, 18.0), 4300 * lg - 3800)
    if environment == "UMi":
        return _falling(flat_m, 18.0, 36.0)
    plain = _falling(flat_m, 18.0, 63.0)
    if height_m <= 13 or flat_m <= 18:
        return plain
    taller = ((height_m - 13) / 10) ** 1.5
    return min(plain * (1 + taller * 1.25 * (flat_m / 100) ** 3 * math.exp(-flat_m / 150)), 1.0)


def _falling(flat_m: float, near_m: float, decay_m: float) -> float:
    """Return 1 up to the distance `near_m`, and a falling probability beyond it.

    With d = `near_m`, D = `flat_m` and p = `decay_m` it is d / D + exp(-D / p) (1 - d / D).
    """
    if flat_m <= near_m:
        return 1.0
    return near_m / flat_m + math.exp(-flat_m / decay_m) * (1 - near_m / flat_m)


def visible_one_way(settings: dict, view: View, rng: np.random.Generator) -> np.ndarray:
    """Return the factor (N, 1) on all amplitudes: 1, or that of two blocked ways.

    The latter is 10^(-`blocked_db` / 10); one number is drawn.
    """
    station_x, station_y, _ = view.station.position_m
    flat = math.hypot(view.row["x_m"] - station_x, view.row["y_m"] - station_y)
    clear = probability(settings["environment"], flat, view.row["z_m"])
    factor = 1.0
    if float(rng.random()) >= clear:
        factor = 10 ** (-2 * settings["blocked_db"] / 20)
    return np.full((len(view.times_s), 1), factor)
