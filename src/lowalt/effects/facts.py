"""What a scene's configuration says that effects may contradict, and the checks that belong to no single effect."""

from typing import NamedTuple

from lowalt.common.errors import InputError
from lowalt.common.network import Network
from lowalt.effects.catalogue import called


class Facts(NamedTuple):
    """What an effect's `check` may look at.

    effects: every named effect's complete parameters, by name; snr_db: the set SNRs.
    """

    network: Network
    effects: dict[str, dict]
    snr_db: tuple[float, ...]


def check(config: dict) -> Facts:
    """Return the facts of a configuration whose effects fit together.

    Raises: InputError naming the effect, the value and what was expected, before any job starts.
    """
    effects = called(config["effects"])
    facts = Facts(
        Network.from_settings(config["network"]),
        {effect.name: effect.settings for effect in effects},
        tuple(float(snr) for snr in config["noise"]["snr_db"]),
    )
    noisy = [snr for snr in facts.snr_db if snr != float("inf")]
    if "receiver_noise" in facts.effects and noisy:
        raise InputError(
            f"effects.receiver_noise: noise.snr_db is {list(facts.snr_db)}, expected [.inf]: a scene has a link budget "
            "or set SNRs, not both"
        )
    if "canceller" in facts.effects and "clutter" not in facts.effects:
        raise InputError("effects.canceller: there is no clutter to cancel, expected effects.clutter beside it")
    for effect in effects:
        if hasattr(effect.module, "check"):
            effect.module.check(effect.settings, facts)
    return facts


def above_ground(effect: str, network: Network) -> None:
    """Raise InputError naming `effect` for a station in or below the ground z = 0."""
    for station in network.stations:
        if station.position_m[2] <= 0:
            raise InputError(
                f"effects.{effect}: station {station.name} stands at z = {station.position_m[2]} m, expected above the "
                "ground z = 0"
            )
