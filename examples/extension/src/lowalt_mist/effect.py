"""Mist weakens each wave by the same number of decibels a kilometre, out and back."""

import numpy as np

from lowalt.scene.view import View

SOURCE = "an example; for real figures ITU-R P.840"
DEFAULTS = {"db_per_km": 0.4}
IDLE = [{"db_per_km": 0}]


def share(db_per_km: float, ways_m: np.ndarray | float) -> np.ndarray | float:
    """Return the share of its amplitude that a wave keeps on ways (m)."""
    return 10 ** (-db_per_km * ways_m / 1000 / 20)


def visible(settings: dict, view: View, rng: np.random.Generator) -> np.ndarray:
    """Return the factor (N, L) on the two-way amplitude of each point."""
    return share(settings["db_per_km"], view.ways_m(view.places))
