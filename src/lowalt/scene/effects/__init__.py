"""The effects of a scene, one file each in the folder of its place, and the order of all.

What such a file offers: `lowalt.scene.contract`. An effect is imported when a scene names it, and
never otherwise.
"""

import importlib
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np

from lowalt.config.extensions import AddedEffect, module_offered, offered
from lowalt.config.named_code import own_effects
from lowalt.config.network import Network
from lowalt.files.errors import InputError, instead, shown
from lowalt.numerics.streams import stream
from lowalt.scene.contract import OFFERS, PLACE_ORDER
from lowalt.scene.own_effect import checked, kept_contract, loaded, place_of

LISTED = {
    "motion": "rotor_spread gusts",
    "transmitter": "slow_time data_symbols power_amplifier comb_pilots",
    "channel": (
        "pointing_error element_pattern mean_cross_section fluctuation cross_sections occlusion "
        "line_of_sight ground_reflection walls reflected_aspect squint wavefront symbol_motion "
        "cyclic_prefix companions direct_path interference clutter background_channel"
    ),
    "receiver": (
        "receiver_noise cell_noise link_offset timing_offset clock_offset carrier_offset "
        "phase_noise transmit_leakage iq_imbalance adc"
    ),
    "detection": "canceller detector cell_error",
}
"""Names of the effects whose order within their place matters, in the order of the chain."""


ADDED: dict[str, AddedEffect] = offered("effects")
"""Effects of extensions by name."""


def _places() -> dict[str, str]:
    """The place of every effect.

    Effects come in the order of LISTED, then the others of its folder, and extensions' between.
    """
    folder = Path(__file__).parent
    result: dict[str, str] = {}
    for place in PLACE_ORDER:
        files = sorted(path.stem for path in (folder / place).glob("*.py"))
        names = list(dict.fromkeys((*LISTED[place].split(), *files)))
        names.remove("__init__")
        for name, added in ADDED.items():
            if added.place != place:
                continue
            index = len(names)
            if added.after in names:
                index = names.index(added.after) + 1
            names.insert(index, name)
        result |= dict.fromkeys(names, place)
    return result


PLACES = _places()
"""Place of every effect by its name, in the order of the chain."""


class NamedEffect(NamedTuple):
    """An effect that a scene names: its module, and its settings, defaults filled in."""

    name: str
    place: str
    module: ModuleType
    settings: dict

    @property
    def idle(self) -> bool:
        """Whether the settings hold a set of IDLE (`contract`), with which the effect does nothing."""
        for entry in getattr(self.module, "IDLE", ()):
            if all(self.settings[key] == value for key, value in entry.items()):
                return True
        return False

    @property
    def snr_db(self) -> float | None:
        """The SNR at which the effect adds noise.

        It is None for each of noise.snr_db, and for effects without one.
        """
        return self.settings.get(getattr(self.module, "SET_SNR", None))

    def offers(self, name: str) -> bool:
        """Whether the effect has a function of the contract, or another of its names set.

        A name counts as set where its value is not False.
        """
        return getattr(self.module, name, False) is not False

    @property
    def named_files(self) -> dict[str, str]:
        """The paths that the settings hold (FILES), by the key of the configuration."""
        keys = [key for key in getattr(self.module, "FILES", ()) if self.settings[key] is not None]
        return {f"effects.{self.name}.{key}": self.settings[key] for key in keys}

    def texts(self, function: str) -> list[str]:
        """Return the texts that a function of the settings gives, none without such a function.

        Raises: InputError where it gives anything else.
        """
        if not self.offers(function):
            return []
        found = getattr(self.module, function)(self.settings)
        if not isinstance(found, list) or not all(isinstance(text, str) for text in found):
            raise InputError(
                f"effects: {self.name}: {function} gives {shown(found)}, expected a list of texts"
            )
        return found

    def at_snr(self, snr_db: float) -> "NamedEffect":
        """Return the effect with its noise, if it adds any, at this SNR (dB)."""
        key = getattr(self.module, "SET_SNR", None)
        if not key:
            return self
        return self._replace(settings=self.settings | {key: snr_db})


def dotted(name: str) -> str:
    """Return the module of an effect, such as lowalt.scene.effects.receiver.adc.

    Of the user's own effect it is the path.

    Raises: InputError for a name that belongs to no effect.
    """
    if own_effects([name]):
        return name
    if name not in PLACES:
        known = f"{instead([name], sorted(PLACES))}, or the path of an effect's Python file"
        raise InputError(f"effects: unknown effect {name!r}, expected {known}")
    if name in ADDED:
        return ADDED[name].module
    return f"{__name__}.{PLACES[name]}.{name}"


def module_of(name: str) -> ModuleType:
    """Return the module of an effect, loaded. Raises: InputError where there is none."""
    if own_effects([name]):
        return loaded(name)
    if name in ADDED:
        return kept_contract(name, module_offered("effects", name, ADDED[name].module))
    return importlib.import_module(dotted(name))


def complete(block: Mapping[str, dict | None]) -> list[NamedEffect]:
    """Return all effects of a scene's `effects` block in the chain's order, idle ones included.

    Raises: InputError for an unknown effect or parameter.
    """
    modules = {name: module_of(name) for name in block}
    own = own_effects(block)
    if len({Path(name).name for name in own}) < len(own):
        raise InputError(
            f"effects: {own}, expected files of different names, after which random streams are "
            "called"
        )
    shipped = [name for name in PLACES if name in block]
    result = []
    for name in [*shipped, *own]:
        module = modules[name]
        changed = block[name] or {}
        unknown = sorted(set(changed) - set(module.DEFAULTS))
        if unknown:
            raise InputError(
                f"effects.{name}: unknown parameter(s) {unknown}, expected some of "
                f"{list(module.DEFAULTS)}"
            )
        if name in own or name in ADDED:
            settings = checked(name, module, changed)
        else:
            # The schema of the configuration has checked these.
            settings = {**module.DEFAULTS, **changed}
        place = place_of(name, module) if name in own else PLACES[name]
        result.append(NamedEffect(name, place, module, settings))
    result.sort(key=lambda effect: PLACE_ORDER.index(effect.place))
    return result


def called(block: Mapping[str, dict | None]) -> list[NamedEffect]:
    """Return the effects of a scene's `effects` block in the chain's order.

    Those that are idle are left out.

    Raises: InputError for an unknown effect or parameter, or two effects that offer a function of
    which a scene has one (`contract.OFFERS`).
    """
    acting = [effect for effect in complete(block) if not effect.idle]
    for function in OFFERS:
        only(acting, function)
    return acting


def named_files(block: Mapping[str, dict | None]) -> dict[str, str]:
    """Return the paths of files that the settings of a scene's effects hold.

    They are given by their keys of the configuration.
    """
    result: dict[str, str] = {}
    for effect in complete(block):
        result |= effect.named_files
    return result


def effect_files(block: Mapping[str, dict | None]) -> list[str]:
    """Return the paths of all files that a scene's effects read.

    Files that such files name are included.

    Raises: InputError where a file that names others is not there or cannot be read.
    """
    result: dict[str, None] = {}
    for effect in complete(block):
        paths = list(effect.named_files.values())
        if effect.offers("files"):
            paths = effect.texts("files")
        result |= dict.fromkeys(paths)
    return list(result)


def needed_subtypes(block: Mapping[str, dict | None]) -> list[str]:
    """Return the subtypes whose clouds a scene's effects need besides the target's own."""
    result: dict[str, None] = {}
    for effect in complete(block):
        result |= dict.fromkeys(effect.texts("subtypes"))
    return list(result)


def needs_surfaces(block: Mapping[str, dict | None]) -> bool:
    """Return whether an effect of the scene needs the opaque surfaces of each target."""
    return any(effect.offers("SURFACES") for effect in complete(block))


def breaks_tracks(block: Mapping[str, dict | None]) -> list[str]:
    """Return the names of the effects that draw a motion for each look.

    The looks of a track then do not join.
    """
    return [effect.name for effect in complete(block) if effect.offers("JUMPS")]


def of_record(block: Mapping[str, dict | None]) -> dict[str, dict]:
    """Return the effects of an `effects` block that add to the record of a sample.

    Each has the settings given there.
    """
    return {
        effect.name: block[effect.name] or {}
        for effect in complete(block)
        if effect.offers("record")
    }


def look_stream(seed: int, name: str, row: dict, *more: str | float) -> np.random.Generator:
    """Return the random stream of an effect for the motion model `row`, from its start.

    more: what else the draws depend on: stations, an SNR. The stream of a user's own effect has the
    name of its file, wherever that lies.
    """
    return stream(seed, "effect", name.rpartition("/")[2], row["subtype"], row["model"], *more)


def record_fields(
    effects: Iterable[NamedEffect], network: Network, seed: int, row: dict
) -> dict[str, Any]:
    """Return what effects add to the record of a sample, by field, sorted.

    row: of the motion table. Raises: InputError where an effect gives no dict, or a field that
    another effect gives too.
    """
    result: dict[str, Any] = {}
    for name, record in every(effects, "record").items():
        fields = record(network, row, look_stream(seed, name, row))
        if not isinstance(fields, dict) or not all(isinstance(key, str) for key in fields):
            raise InputError(f"{name}: record gives {shown(fields)}, expected fields by name")
        if twice := sorted(set(fields) & set(result)):
            raise InputError(
                f"{name}: record gives {twice}, which another effect of the scene gives"
            )
        result |= fields
    return dict(sorted(result.items()))


def with_offer(name: str) -> str:
    """Return the shipped effects that offer a name of the contract.

    They are written as a sentence names a choice.
    """
    return " or ".join(f"effects.{one}" for one in PLACES if hasattr(module_of(one), name))


def every(effects: Iterable[NamedEffect], function: str) -> dict[str, Callable[..., Any]]:
    """Return the functions of this name that effects offer, with their settings.

    They are given by effect in the order of the effects.
    """
    return {
        effect.name: partial(getattr(effect.module, function), effect.settings)
        for effect in effects
        if hasattr(effect.module, function)
    }


def offering(block: Mapping[str, dict | None], place: str, name: str) -> dict[str, dict]:
    """Return those of an `effects` block that act at a place and offer a name of the contract.

    The name may be that of a function or another one.

    Of shipped effects only those of that place are imported, while a file of the user's own tells
    its place when it is loaded; idle ones are left out.
    """
    own = own_effects(block)
    asked = {key: value for key, value in block.items() if key in own or PLACES.get(key) == place}
    return {
        effect.name: block[effect.name] or {}
        for effect in called(asked)
        if effect.place == place and effect.offers(name)
    }


def only(effects: Iterable[NamedEffect], function: str) -> Callable[..., Any] | None:
    """Return the function of this name that one of the effects offers, with its settings.

    It is None where none of them offers it.

    Raises: InputError where several effects offer a function of which a scene has one.
    """
    found = every(effects, function)
    if len(found) > 1 and OFFERS[function].one:
        raise InputError(
            f"effects: {' and '.join(found)} both offer {function}, expected one of them in a scene"
        )
    return next(iter(found.values()), None)
