"""What the names of a table's columns say: time, in-phase, quadrature, magnitude or phase."""

import re

import numpy as np

ROLES = {
    "time": {"t", "time", "times", "timestamp", "seconds", "sec", "elapsed"},
    "i": {"i", "inphase", "re", "real"},
    "q": {"q", "quadrature", "quad", "im", "imag", "imaginary"},
    "magnitude": {"mag", "magnitude", "abs", "amplitude", "amp"},
    "phase": {"phase", "phi", "arg", "angle"},
}
UNITS = {"ms": 1e-3, "us": 1e-6, "µs": 1e-6, "ns": 1e-9, "deg": np.pi / 180, "degrees": np.pi / 180, "°": np.pi / 180}
"""Units in a name, in seconds or radians; others count as these."""
EVEN = 1e-3
"""Largest relative difference between the steps of a column of sample times."""


def _words(name: str) -> list[str]:
    """The words of a name in lower case."""
    return [word for word in re.split(r"[^a-zµ°]+", name.lower().replace("in-phase", "inphase")) if word]


def role(name: str) -> str:
    """Return what a name says, a key of `ROLES`, or "" where it says none or several."""
    found = [key for key, known in ROLES.items() if known & set(_words(name))]
    return found[0] if len(found) == 1 else ""


def unit(name: str) -> float:
    """Return the unit in a name of sample times or phases, in seconds or radians; 1 where it names none."""
    return next((UNITS[word] for word in _words(name) if word in UNITS), 1.0)


def rises_evenly(column: np.ndarray) -> bool:
    """Whether a column (samples,) rises by equal steps, as sample times and numbers of samples do."""
    if np.iscomplexobj(column) or len(column) < 8:
        return False
    steps = np.diff(column.astype(np.float64))
    return bool(steps.min() > 0 and np.ptp(steps) <= max(EVEN * steps.mean(), 8e-6 * abs(column).max()))
