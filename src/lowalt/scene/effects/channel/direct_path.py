"""The direct path of a link between two stations.

The sent signal reaches the receiving station without the target.

It has the delay of the distance between the masts and no Doppler shift, and it enters through the
side lobes of both arrays, whose beams point at the target.
"""

import numpy as np

from lowalt.numerics.portable import norm
from lowalt.scene.checks import CheckedScene, between_stations
from lowalt.scene.crossing import crossing
from lowalt.scene.view import Still, View

SOURCE = (
    "H. T. Friis, A note on a simple transmission formula, Proc. IRE 34, 1946; N. J. Willis, "
    "Bistatic Radar, 2nd ed. 1995, ch. 3 (range sum, direct path) and ch. 6 (Doppler of the "
    "bisector)"
)
DEFAULTS = {"loss_db": 0.0}
IDLE = [{"loss_db": None}]
STILL = True


def check(settings: dict, scene: CheckedScene) -> None:
    """Raise InputError for a network without links."""
    between_stations("direct_path", scene.network)


def levels(settings: dict, view: View) -> list[tuple[str, float, str]]:
    """Return the power (W) of the direct path, nothing for a station that hears itself."""
    if view.station.transmitter is None:
        return []
    response = from_sender(settings, view).response
    return [(f"direct path, {view.network.bin_name}", float(np.mean(abs(response) ** 2)), "W")]


def from_sender(settings: dict, view: View) -> Still:
    """Return the direct path, zero for a station that receives its own signal.

    Both array sums toward the other mast, in the units of the echo: the amplitude is sqrt(P /
    elements) lambda / (4 pi d) times both sums. Source: Friis 1946.
    """
    network = view.network
    hears = view.station
    sends = view.station.transmitter
    shape = len(view.times_s), network.subcarriers
    if sends is None:
        return Still(np.zeros(shape, np.complex128))
    turned = crossing(view, sends, hears)[0] * 10 ** (-settings["loss_db"] / 20)
    cells = float(norm(np.subtract(*view.masts_m))) / (2 * network.cell_m)
    return Still(np.broadcast_to(turned, shape).copy(), cells - round(cells))
