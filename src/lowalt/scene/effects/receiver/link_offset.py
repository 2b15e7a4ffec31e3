"""Offsets between the oscillators and clocks of two stations, on the links between them.

During a look, the oscillator and the clock of each station have one error each. The offsets of the
link from A to B are the errors of A minus those of B, so the link from B to A has the opposite
offsets. A station that receives its own signal has none.
"""

import numpy as np

from lowalt.config.network import Network, Station
from lowalt.scene.checks import CheckedScene, between_stations
from lowalt.scene.laws.offsets import delayed, of_stations, risen
from lowalt.scene.view import Displacement, View
from lowalt.scene.waveform import Look, oscillator_hz

SOURCE = (
    "P. H. Moose, IEEE Trans. Commun. 42(10), 1994 (carrier); M. Speth et al., IEEE Trans. Commun. "
    "47(11), 1999 (time); defaults: 3 sigma at the 0.05 ppm of 3GPP TS 38.104, 6.5.1, and clocks "
    "disciplined to 20 ns by satellites: estimate"
)
DEFAULTS = {"sigma_ppm": 0.017, "sigma_s": 2e-8}
DRAWN = "look"
IDLE = [{"sigma_ppm": 0, "sigma_s": 0}]
UNMODELLED = ("fmcw", "cw")


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a network without links."""
    between_stations("link_offset", scene.network)


def receive(
    settings: dict, samples: np.ndarray, look: Look, rng: np.random.Generator
) -> np.ndarray:
    """Return the samples (N, M) of a link, shifted by both offsets in frequency and in delay.

    A sender whose frequency is higher by F raises all lines by F; a sender whose clock is late
    makes all echoes late. The samples of a station that receives its own signal stay as they are.
    """
    if look.station.transmitter is None:
        return samples
    offsets = _link_offsets(settings, look.network, look.station, rng)
    late = delayed(samples, float(offsets.delay_s), look)
    return risen(late, float(offsets.rise_hz), look)


def displaced(settings: dict, view: View, rng: np.random.Generator) -> Displacement:
    """Return the offsets of a link in delay and frequency, drawn as `receive` draws them."""
    return _link_offsets(settings, view.network, view.station, rng)


def _link_offsets(
    settings: dict, network: Network, station: Station, rng: np.random.Generator
) -> Displacement:
    """Return the errors of the sender minus those of the receiver.

    They are zero for a station that receives its own signal.
    """
    sends = station.transmitter
    hears = station.receiver
    if sends is None or hears is None:
        return Displacement()
    errors = of_stations(settings, network, rng)
    sender_ppm, sender_late_s = errors[sends.name]
    receiver_ppm, receiver_late_s = errors[hears.name]
    ppm = sender_ppm - receiver_ppm
    late_s = sender_late_s - receiver_late_s
    return Displacement(late_s, 1e-6 * ppm * oscillator_hz(network, station))
