"""Checks of a scene before any job starts: whether its effects fit its network, its noise and each other."""

from collections.abc import Collection
from typing import NamedTuple

from lowalt.config.network import Network
from lowalt.config.plan import snrs_of
from lowalt.files.errors import InputError
from lowalt.scene.effects import called

STILL = ("clutter", "background_channel", "transmit_leakage", "direct_path")
"""Effects that add something that stands still."""
UNKNOWN_ON_LINKS = ("background_channel", "interference", "transmit_leakage")
"""Effects that are not modelled between two stations."""

OF_OFDM = (
    "data_symbols", "power_amplifier", "comb_pilots", "cyclic_prefix", "interference", "link_offset", "timing_offset",
    "clock_offset", "carrier_offset",
)  # fmt: skip
"""Effects on OFDM's data, its prefix, or a receiver that does not mix with what is sent."""
UNKNOWN_OF = {"ofdm": (), "fmcw": OF_OFDM, "cw": (*OF_OFDM, "symbol_motion", "clutter")}
"""Effects that are not modelled with a waveform; a continuous wave has one sample and no range cells."""


class CheckedScene(NamedTuple):
    """The part of a scene's configuration that an effect's `check` may look at.

    effects: the complete settings of every effect that is not idle, by name; snr_db: the set SNRs.
    """

    network: Network
    effects: dict[str, dict]
    snr_db: tuple[float, ...]


def check(config: dict) -> CheckedScene:
    """Return the scene of a configuration whose effects fit together.

    Raises: InputError naming the effect, the value and what was expected, before any job starts.
    """
    effects = called(config["effects"])
    scene = CheckedScene(
        Network.from_settings(config["network"]),
        {effect.name: effect.settings for effect in effects},
        snrs_of(config),
    )
    links = [station.name for station in scene.network.stations if station.transmitter is not None]
    unknown_on_links = [name for name in UNKNOWN_ON_LINKS if name in scene.effects]
    noisy = [snr for snr in scene.snr_db if snr != float("inf")]
    recipe = config.get("shards", {}).get("kind") == "recipe"
    regrid = scene.effects.get("slow_time", {"regrid": "zero"})["regrid"]
    guard = scene.network.guard_subcarriers
    refuse_unknown_of(scene.network, scene.effects)
    for wrong, message in (
        (links and "direct_path" not in config["effects"],
         f"network.stations: {links} are links between two stations, expected effects.direct_path in the same scene"),
        (links and unknown_on_links,
         f"effects: {unknown_on_links} are not modelled between two stations, expected none of them in a network with "
         f"the links {links}"),
        (guard < 0 and "interference" not in scene.effects,
         f"network.guard_subcarriers: {guard}, sub-bands overlap, expected effects.interference in the same scene"),
        ("receiver_noise" in scene.effects and noisy,
         f"effects.receiver_noise: noise.snr_db is {list(scene.snr_db)}, expected [.inf]: a scene has a link budget or "
         "set SNRs, not both"),
        (noisy and recipe and {"cell_noise", "canceller"} & set(scene.effects),
         "shards.kind: 'recipe' draws white noise as samples are read, expected 'image' or 'signal' in a scene with "
         "effects.cell_noise or effects.canceller"),
        (config.get("spectra", {}).get("times") == "known" and regrid != "zero",
         f"effects.slow_time.regrid: {regrid!r} makes an even signal, and spectra.times is 'known', expected 'zero'"),
        ("canceller" in scene.effects and not set(STILL) & set(scene.effects),
         f"effects.canceller: there is no clutter to cancel, expected one of {list(STILL)} in the same scene"),
    ):  # fmt: skip
        if wrong:
            raise InputError(message)
    for effect in effects:
        if hasattr(effect.module, "check"):
            effect.module.check(effect.settings, scene)
    return scene


def refuse_unknown_of(network: Network, names: Collection[str]) -> None:
    """Raise InputError for effects of these names that are not modelled with the network's waveform."""
    refused = [name for name in UNKNOWN_OF[network.waveform] if name in names]
    if refused:
        raise InputError(
            f"effects: {refused} are not modelled with network.waveform of kind {network.waveform!r}, expected none of "
            "them"
        )


def above_ground(effect: str, network: Network) -> None:
    """Raise InputError naming `effect` for a station in or below the ground z = 0."""
    for station in network.stations:
        if station.position_m[2] <= 0:
            raise InputError(
                f"effects.{effect}: station {station.name} stands at z = {station.position_m[2]} m, expected above the "
                "ground z = 0"
            )
