"""Offsets between two stations' oscillators and clocks, in the links between them and nowhere else.

Every station's oscillator and clock have one error each in a look. A link from A to B has A's less B's, and the link
from B to A the opposite. A station that receives its own signal has no offset.
"""

import numpy as np

from lowalt.common.errors import InputError
from lowalt.effects import transforms
from lowalt.effects.checks import CheckedScene
from lowalt.effects.clocks import errors
from lowalt.effects.waveform import Frame, turned

SOURCE = (
    "P. H. Moose, IEEE Trans. Commun. 42(10), 1994 (carrier); M. Speth et al., IEEE Trans. Commun. 47(11), 1999 "
    "(time); defaults: 3 sigma at the 0.05 ppm of 3GPP TS 38.104, 6.5.1, and clocks disciplined to 20 ns by "
    "satellites: estimate"
)
DEFAULTS = {"sigma_ppm": 0.017, "sigma_s": 2e-8}
NEEDS_NO_DATA = True


def idle(settings: dict) -> bool:
    """Return whether all stations agree on frequency and time."""
    return settings["sigma_ppm"] == 0 and settings["sigma_s"] == 0


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a network without links."""
    if all(station.transmitter is None for station in scene.network.stations):
        raise InputError("effects.link_offset: no station of the network is a link, expected {transmit, receive}")


def receive(settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
    """Return samples (N, M) of a link, turned by the carriers' difference and moved by the clocks'; others as they are.

    A sender whose frequency is higher by F raises all lines by F; a sender whose clock is late makes echoes late.
    rng: the look's stream, the same for all stations.
    """
    sends, hears = frame.station.transmitter, frame.station.receiver
    if sends is None:
        return samples
    found = errors(settings, frame.network, rng)
    ppm, late = (theirs - ours for theirs, ours in zip(found[sends.name], found[hears.name], strict=True))
    ramp = turned(-2 * np.pi * np.fft.ifftshift(frame.baseband_hz) * late)
    moved = transforms.inverse(transforms.forward(samples) * ramp)
    return moved * turned(2e-6 * np.pi * ppm * frame.oscillator_hz * frame.times_s)


def respond(settings: dict, response: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray | None:
    """Return the response (N, M) of a station that hears itself, as it is; None for a link, whose carriers differ."""
    return response if frame.station.transmitter is None else None
