"""The facts of one look that an effect needs to add signals which the receiver does not know."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from lowalt.effects.sending import Sending
from lowalt.effects.view import View


class Listening(NamedTuple):
    """One sample at one station."""

    view: View
    sending: Sending
    """Its waveform, of which other stations' are further draws."""
    names: frozenset[str]
    """The scene's effects beyond motion."""
    draws: Callable[[str], np.random.Generator]
    """As in `chain.Chain`."""
    weight: Callable[[View], np.ndarray | float]
    """Factor (N, L) on the amplitudes of the target's points as the station of a view hears them."""
