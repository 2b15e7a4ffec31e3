"""Checks of a scene before any job starts.

They say whether its effects fit its network, its noise and each other.
"""

from collections.abc import Collection, Mapping
from types import ModuleType
from typing import NamedTuple

from lowalt.config.blocks import snrs_of
from lowalt.config.network import Network
from lowalt.files.errors import InputError
from lowalt.scene.effects import called, complete, module_of, with_offer


class CheckedScene(NamedTuple):
    """The part of a scene's configuration that an effect's `check` may look at.

    effects, modules: the complete settings and the module of every effect that is not idle, by
    name; snr_db: the set SNRs; known_times: whether spectra use the instants of received symbols;
    all_cells: whether range cells of all symbols are stored or shown.
    """

    network: Network
    effects: dict[str, dict]
    modules: dict[str, ModuleType]
    snr_db: tuple[float, ...]
    known_times: bool
    all_cells: bool = False

    @property
    def noisy(self) -> bool:
        """Whether noise is added at set SNRs."""
        return any(snr != float("inf") for snr in self.snr_db)

    def offering(self, name: str) -> list[str]:
        """Return the names of the effects that offer a name of the contract."""
        return [effect for effect, module in self.modules.items() if getattr(module, name, False)]

    def saying(self, function: str) -> list[str]:
        """Return the names of the effects whose function of their settings gives True."""
        return [
            name
            for name in self.offering(function)
            if getattr(self.modules[name], function)(self.effects[name])
        ]


def check(config: dict, all_cells: bool = False) -> CheckedScene:
    """Return the scene of a configuration whose effects fit together.

    all_cells: whether the data set stores or shows range cells of all symbols.
    Raises: InputError naming the effect, the value and what was expected, before any job starts.
    """
    effects = called(config["effects"])
    scene = CheckedScene(
        Network.from_settings(config["network"]),
        {effect.name: effect.settings for effect in effects},
        {effect.name: effect.module for effect in effects},
        snrs_of(config),
        config.get("spectra", {}).get("times") == "known",
        all_cells,
    )
    refuse_same_waves(scene)
    refuse_unmodelled(scene.network, scene.modules)
    refuse_missing(scene.network, [module_of(name) for name in config["effects"]])
    coloured = [*scene.offering("SET_SNR"), *scene.offering("filtered")]
    if scene.noisy and coloured and config.get("shards", {}).get("kind") == "recipe":
        raise InputError(
            "shards.kind: 'recipe' draws white noise as samples are read, expected 'image' or "
            f"'signal' in a scene with effects {coloured}"
        )
    for effect in effects:
        if hasattr(effect.module, "check"):
            effect.module.check(effect.settings, scene)
    return scene


def refuse_same_waves(scene: CheckedScene) -> None:
    """Raise InputError where two effects reflect or block the same waves (WAVES)."""
    owners: dict[str, str] = {}
    for name in scene.offering("WAVES"):
        for wave in scene.modules[name].WAVES:
            other = owners.setdefault(wave, name)
            if other != name:
                raise InputError(
                    f"effects: {other} together with {name}, which both hold the waves {wave}; "
                    "expected one or the other"
                )


def refuse_unknown_subtypes(effects: dict, subtypes: Collection[str]) -> None:
    """Raise InputError where an effect of an `effects` block needs clouds of other subtypes."""
    for effect in complete(effects):
        if unknown := sorted(set(effect.texts("subtypes")) - set(subtypes)):
            raise InputError(
                f"effects.{effect.name}.subtypes: {unknown}, expected subtypes of the run"
            )


def refuse_missing(network: Network, named: Collection[ModuleType]) -> None:
    """Raise InputError where no named effect, idle ones included, offers what the network needs."""
    links = links_of(network)
    guard = network.guard_subcarriers
    needed = {}
    if links:
        needed["from_sender"] = f"network.stations: {links} are links between two stations"
    if guard < 0:
        needed["heard"] = f"network.guard_subcarriers: {guard}, sub-bands overlap"
    for function, said in needed.items():
        if not any(hasattr(module, function) for module in named):
            raise InputError(
                f"{said}, expected {with_offer(function)} in the same scene, or an own effect that "
                f"offers {function}"
            )


def links_of(network: Network) -> list[str]:
    """Return the names of the stations that are links between two others."""
    return [station.name for station in network.stations if station.transmitter is not None]


def refuse_unmodelled(network: Network, modules: Mapping[str, ModuleType]) -> None:
    """Raise InputError for effects, modules by name, that are not modelled.

    They do not go with the network's waveform or links.
    """
    kind = network.waveform
    cases = {kind: f"with network.waveform of kind {kind!r}, expected none of them"}
    if links := links_of(network):
        cases["links"] = (
            f"between two stations, expected none of them in a network with the links {links}"
        )
    for case, said in cases.items():
        refused = [
            name for name, module in modules.items() if case in getattr(module, "UNMODELLED", ())
        ]
        if refused:
            raise InputError(f"effects: {refused} are not modelled {said}")


def above_ground(effect: str, network: Network) -> None:
    """Raise InputError naming `effect` for a station in or below the ground z = 0."""
    for station in network.stations:
        if station.position_m[2] <= 0:
            raise InputError(
                f"effects.{effect}: station {station.name} stands at z = {station.position_m[2]} "
                "m, expected above the ground z = 0"
            )


def between_stations(effect: str, network: Network) -> None:
    """Raise InputError naming `effect` for a network without links."""
    if not links_of(network):
        raise InputError(
            f"effects.{effect}: no station of the network is a link, expected {{transmit, receive}}"
        )
