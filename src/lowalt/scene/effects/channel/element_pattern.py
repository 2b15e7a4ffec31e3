"""The gain pattern of the antenna elements.

It weights every echo on the way out and on the way back.

It falls by 12 (angle / width)^2 decibels in each plane, down to the level of the back lobe. Without
this effect elements are isotropic. Reflected paths and the land have the gain in their own
direction.
"""

import numpy as np

from lowalt.scene.antenna import Element, gain
from lowalt.scene.view import View

SOURCE = (
    "3GPP TR 38.901, section 7.3, Table 7.3-1 (element of 8 dBi, 65 degrees wide, 30 dB front to "
    "back)"
)
DEFAULTS = Element()._asdict()
IDLE = [{"gain_dbi": 0, "back_db": 0}]


def element(settings: dict) -> Element:
    """Return the element that settings describe."""
    return Element(**settings)


def visible(settings: dict, view: View, rng: np.random.Generator | None = None) -> np.ndarray:
    """Return the factor (N, L) on every point's two-way amplitude.

    It is the element's power gain in the direction of the point.

    On a link it is the geometric mean of both stations' gains.
    """
    gains = [gain(element(settings), end.station, view.places) for end in view.ends()]
    if len(gains) == 1:
        return gains[0]
    return np.sqrt(gains[0] * gains[1])
