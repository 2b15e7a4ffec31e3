"""The facts of one look that an effect needs to add signals which the receiver does not know."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from lowalt.scene.view import View


class Listening(NamedTuple):
    """One sample at one station."""

    view: View
    names: frozenset[str]
    """The scene's effects beyond motion."""
    draws: Callable[[str], np.random.Generator]
    """The stream of an effect, or of a name of the effect's own, for this sample and station, from its start."""
    aired: Callable[[str], np.ndarray]
    """Subcarriers (N, M) on the air whose data come of the stream of this name: another station's or symbol's."""
    echo: Callable[[View], np.ndarray]
    """Subcarriers (N, M) of the target on the direct path, as the station of a view hears it."""
