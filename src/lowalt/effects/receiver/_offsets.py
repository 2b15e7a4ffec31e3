"""Offsets of a station's clocks: a fixed part, for all stations or each by its name, and a drawn part.

The drawn part is normal, cut at three standard deviations, so that a scene's largest offset is known beforehand.
"""

from statistics import NormalDist

import numpy as np

from lowalt.common.errors import InputError
from lowalt.common.network import Network
from lowalt.effects.checks import CheckedScene

CUT = 3.0
"""Standard deviations at which draws are cut."""


def fixed(value: float | dict[str, float], station: str) -> float:
    """Return the fixed part of a station's offset: a number for all, or the mapping's entry (0 where it has none)."""
    return float(value.get(station, 0.0)) if isinstance(value, dict) else float(value)


def drawn(rng: np.random.Generator) -> float:
    """Return a standard normal number cut at +-3, by one uniform draw through the inverse distribution."""
    tail = NormalDist().cdf(-CUT)
    return NormalDist().inv_cdf(tail + (1 - 2 * tail) * rng.random())


def largest(value: float | dict[str, float], sigma: float) -> float:
    """Return the largest magnitude that fixed part and drawn part can reach together."""
    parts = value.values() if isinstance(value, dict) else [value]
    return max((abs(part) for part in parts), default=0.0) + CUT * sigma


def idle(value: float | dict[str, float], sigma: float) -> bool:
    """Return True where no station has an offset."""
    return largest(value, sigma) == 0


def check_stations(key: str, value: float | dict[str, float], network: Network) -> None:
    """Raise InputError naming `key` where a mapping names a station that the network does not have."""
    names = [station.name for station in network.stations]
    unknown = sorted(set(value) - set(names)) if isinstance(value, dict) else []
    if unknown:
        raise InputError(f"{key}: station(s) {unknown} are not in the network, expected some of {names}")


def check_oscillator(effect: str, scene: CheckedScene) -> None:
    """Raise InputError naming `effect` where transmitter and receiver share one oscillator, and so have no offset."""
    noise = scene.effects.get("phase_noise")
    if noise and noise["shared"]:
        raise InputError(
            f"effects.{effect}: effects.phase_noise has shared: true, one oscillator for sending and receiving, which "
            "has no offset against itself; expected shared: false (a receiver of its own) or no offset"
        )
