"""Rain between a station and its target weakens each wave by gamma = k R^alpha decibels a kilometre, out and back."""

import numpy as np

from lowalt.scene.view import View

SOURCE = (
    "ITU-R P.838-3, 2005, Eqs. 1 to 3, Tables 2 and 4 (vertical polarisation); the whole way lies"
    " in the rain"
)
DEFAULTS = {"mm_per_h": 20.0}
IDLE = [{"mm_per_h": 0}]

K = (
    [
        (-3.80595, 0.56934, 0.81061),
        (-3.44965, -0.22911, 0.51059),
        (-0.39902, 0.73042, 0.11899),
        (0.50167, 1.07319, 0.27195),
    ],
    -0.16398,
    0.63297,
)
ALPHA = (
    [
        (-0.07771, 2.33840, -0.76284),
        (0.56727, 0.95545, 0.54039),
        (-0.20238, 1.14520, 0.26809),
        (-48.2991, 0.791669, 0.116226),
        (48.5833, 0.791459, 0.116479),
    ],
    -0.053739,
    0.83433,
)
"""a, b and c of each term, m and c of the straight line."""


def fitted(coefficients: tuple, frequency_hz: float) -> float:
    """Return log10 k or alpha at a frequency of 1 to 1000 GHz."""
    (terms, slope, offset), x = coefficients, np.log10(frequency_hz / 1e9)
    return sum(a * np.exp(-(((x - b) / c) ** 2)) for a, b, c in terms) + slope * x + offset


def attenuation(frequency_hz: float, mm_per_h: float) -> float:
    """Return the specific attenuation of rain (dB/km)."""
    return 10 ** fitted(K, frequency_hz) * mm_per_h ** fitted(ALPHA, frequency_hz)


def kept(settings: dict, view: View, ways_m: np.ndarray | float) -> np.ndarray | float:
    """Return the share of its amplitude that a wave keeps on a way of `ways_m` (m), out and back."""
    decibels_per_km = attenuation(view.network.effective_hz(view.station), settings["mm_per_h"])
    return 10 ** (-decibels_per_km * ways_m / 1000 / 20)


def visible(settings: dict, view: View, rng: np.random.Generator) -> np.ndarray:
    """Return the factor (N, L) on the two-way amplitude of each point."""
    return kept(settings, view, view.ways_m(view.places))


def levels(settings: dict, view: View) -> list[tuple[str, float, str]]:
    """Return the line of the link budget: a ratio of powers, unit "1"."""
    return [
        ("rain, out and back", kept(settings, view, float(view.ways_m(view.origin_m))) ** 2, "1")
    ]
