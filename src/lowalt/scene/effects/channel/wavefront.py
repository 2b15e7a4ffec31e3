"""Spherical wavefront: every element of an array has its own distance to a point.

Without this effect all elements see a plane wave.

Element e of the array then has the phase 2 pi f |p - e| / c and the amplitude 1 / |p - e|.
`scene.spherical` sums them where a scene names this effect.
"""

SOURCE = (
    "Balanis, Antenna Theory, 4th ed., 2016, section 4.4.1 (phase error of the far-field "
    "approximation)"
)
DEFAULTS: dict[str, float] = {}


def waves(settings: dict) -> dict[str, bool]:
    """Return how arrays are summed."""
    return {"wavefront": True}
