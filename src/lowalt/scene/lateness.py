"""How late the symbols of a sample are, drawn again from its name: for spectra that know the instants."""

import importlib
from collections.abc import Mapping
from typing import Any

import numpy as np

from lowalt.config.network import Network
from lowalt.numerics.streams import stream


def timed(config: Mapping[str, Any]) -> bool:
    """Return whether the spectra of a configuration know instants that late symbols move."""
    late = (config["effects"].get("slow_time") or {}).get("jitter_s")
    return bool(config["spectra"].get("times") == "known" and late)


def lateness(
    spectra: Mapping[str, Any], effects: Mapping[str, Any], network: Network, seed: int, row: dict
) -> np.ndarray | None:
    """Return how many symbol intervals each symbol came after its nominal instant, (stations, N); None for on time.

    spectra, effects: blocks of the configuration; row: motion table (subtype and model). None too where the spectra do
    not ask for instants. The draws are those of the effect `slow_time`, so nothing has to be stored with the signals.
    """
    if not timed({"spectra": spectra, "effects": effects}):
        return None
    # Named by a text, so that stages of runs without late symbols do not depend on the effect's code.
    slow_time = importlib.import_module("lowalt.scene.effects.transmitter.slow_time")
    settings = {**slow_time.DEFAULTS, **effects["slow_time"]}
    return np.stack([
        slow_time.sampling(
            settings, network, stream(seed, "effect", "slow_time", row["subtype"], row["model"], station.name)
        ).times_s - network.times_s
        for station in network.stations
    ]) / network.symbol_interval_s  # fmt: skip
