"""The errors of all stations' oscillators and clocks in one look, which links and other stations' signals see."""

import numpy as np

from lowalt.config.network import Network

STREAM = "link_offset"
"""The random stream of these errors, one for all stations of a look."""


def errors(settings: dict, network: Network, rng: np.random.Generator) -> dict[str, tuple[float, float]]:
    """Return each station's frequency error (ppm) and clock error (s) in a look, by name; two draws a station."""
    names = [station.name for station in network.stations if station.transmitter is None]
    drawn = rng.standard_normal((len(names), 2)) * [settings["sigma_ppm"], settings["sigma_s"]]
    return dict(zip(names, map(tuple, drawn.tolist()), strict=True))
