"""How late the symbols of a sample are, for spectra that use the instants of the symbols.

The delays are drawn again from the name of the sample.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from lowalt.config.network import Network
from lowalt.scene.effects import called, look_stream, offering, only


def late_effects(config: Mapping[str, Any]) -> dict[str, dict]:
    """Return those of a configuration's `effects` that set the instants of symbols.

    There are none unless its spectra know the instants.
    """
    if config["spectra"].get("times") != "known":
        return {}
    return offering(config["effects"], "transmitter", "sampling")


def lateness(
    spectra: Mapping[str, Any], effects: Mapping[str, Any], network: Network, seed: int, row: dict
) -> np.ndarray | None:
    """Return how many symbol intervals each symbol came after its nominal instant.

    The result is (stations, N), or None for on time.

    spectra, effects: blocks of the configuration; row: motion table (subtype and model). None too
    where the spectra do not ask for instants. The draws are those of the effect, so nothing has to
    be stored with the signals.
    """
    named = called(late_effects({"spectra": spectra, "effects": effects}))
    sampling = only(named, "sampling")
    if sampling is None:
        return None
    (effect,) = named
    times_s = []
    for station in network.stations:
        rng = look_stream(seed, effect.name, row, station.name)
        times_s.append(sampling(network, rng).times_s)
    late = (np.stack(times_s) - network.times_s) / network.symbol_interval_s
    if not late.any():
        return None
    return late
