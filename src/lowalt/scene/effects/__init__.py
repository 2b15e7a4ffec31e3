"""The effects of a scene, one file each in the folder of its place, and the order of all.

What such a file offers: `lowalt.scene.contract`. An effect is imported when a scene names it, and never otherwise.
"""

import importlib
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from lowalt.config.extensions import AddedEffect, module_offered, offered
from lowalt.config.named_code import own_effects
from lowalt.files.errors import InputError, instead
from lowalt.scene.contract import OFFERS, PLACE_ORDER
from lowalt.scene.own_effect import checked, kept_contract, loaded, place_of

LISTED = {
    "motion": "rotor_spread gusts",
    "transmitter": "slow_time data_symbols power_amplifier comb_pilots",
    "channel": (
        "pointing_error element_pattern mean_cross_section fluctuation cross_sections occlusion line_of_sight "
        "ground_reflection walls reflected_aspect squint wavefront symbol_motion cyclic_prefix companions "
        "direct_path interference clutter background_channel"
    ),
    "receiver": (
        "receiver_noise cell_noise link_offset timing_offset clock_offset carrier_offset phase_noise transmit_leakage "
        "iq_imbalance adc"
    ),
    "detection": "canceller detector cell_error",
}
"""Names of the effects whose order within their place matters, in the order of the chain."""


ADDED: dict[str, AddedEffect] = offered("effects")
"""Effects of extensions by name."""


def _places() -> dict[str, str]:
    """The place of every effect: those LISTED, then the others of its folder, and extensions' between."""
    folder, result = Path(__file__).parent, {}
    for place in PLACE_ORDER:
        files = sorted(path.stem for path in (folder / place).glob("*.py") if path.stem != "__init__")
        names = [*dict.fromkeys((*LISTED[place].split(), *files))]
        for name, added in ADDED.items():
            if added.place == place:
                names.insert(names.index(added.after) + 1 if added.after in names else len(names), name)
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
        """Whether the settings change nothing."""
        entries = getattr(self.module, "IDLE", ())
        return any(all(self.settings[key] == value for key, value in entry.items()) for entry in entries)

    @property
    def snr_db(self) -> float | None:
        """The SNR at which the effect adds noise; None for each of noise.snr_db, and for effects without one."""
        return self.settings.get(getattr(self.module, "SET_SNR", None))

    def at_snr(self, snr_db: float) -> "NamedEffect":
        """Return the effect with its noise, if it adds any, at this SNR (dB)."""
        key = getattr(self.module, "SET_SNR", None)
        return self._replace(settings=self.settings | {key: snr_db}) if key else self


def dotted(name: str) -> str:
    """Return the module of an effect, such as lowalt.scene.effects.receiver.adc, or the path of the user's own.

    Raises: InputError for a name that belongs to no effect.
    """
    if own_effects([name]):
        return name
    if name not in PLACES:
        known = f"{instead([name], sorted(PLACES))}, or the path of an effect's Python file"
        raise InputError(f"effects: unknown effect {name!r}, expected {known}")
    return ADDED[name].module if name in ADDED else f"{__name__}.{PLACES[name]}.{name}"


def module_of(name: str) -> ModuleType:
    """Return the module of an effect, loaded. Raises: InputError where there is none."""
    if own_effects([name]):
        return loaded(name)
    if name in ADDED:
        return kept_contract(name, module_offered("effects", name, ADDED[name].module))
    return importlib.import_module(dotted(name))


def called(block: Mapping[str, dict | None]) -> list[NamedEffect]:
    """Return the effects of a scene's `effects` block in the chain's order, without those that are idle.

    Raises: InputError for an unknown effect or parameter, or two effects that offer a function of which a scene has
    one (`contract.OFFERS`).
    """
    modules = {name: module_of(name) for name in block}
    own, result = own_effects(block), []
    if len({Path(name).name for name in own}) < len(own):
        raise InputError(f"effects: {own}, expected files of different names, after which random streams are called")
    for name in (*filter(block.__contains__, PLACES), *own):
        module, changed = modules[name], block[name] or {}
        unknown = sorted(set(changed) - set(module.DEFAULTS))
        if unknown:
            raise InputError(
                f"effects.{name}: unknown parameter(s) {unknown}, expected some of {list(module.DEFAULTS)}"
            )
        brought = name in own or name in ADDED
        settings = checked(name, module, changed) if brought else {**module.DEFAULTS, **changed}
        result.append(NamedEffect(name, place_of(name, module) if name in own else PLACES[name], module, settings))
    result.sort(key=lambda effect: PLACE_ORDER.index(effect.place))
    acting = [effect for effect in result if not effect.idle]
    for function in OFFERS:
        only(acting, function)
    return acting


def every(effects: Iterable[NamedEffect], function: str) -> dict[str, Callable[..., Any]]:
    """Return the functions of this name that effects offer, with their settings, by effect in the order given."""
    return {
        effect.name: partial(getattr(effect.module, function), effect.settings)
        for effect in effects
        if hasattr(effect.module, function)
    }


def offering(block: Mapping[str, dict | None], place: str, name: str) -> dict[str, dict]:
    """Return the part of an `effects` block that acts at a place and has a function, or another name, of the contract.

    Only shipped effects of that place are imported; idle ones are left out.
    """
    asked = called({key: value for key, value in block.items() if PLACES.get(key) == place})
    return {effect.name: block[effect.name] or {} for effect in asked if hasattr(effect.module, name)}


def only(effects: Iterable[NamedEffect], function: str) -> Callable[..., Any] | None:
    """Return the function of this name that one of the effects offers, with its settings, None where none does.

    Raises: InputError where several effects offer a function of which a scene has one.
    """
    found = every(effects, function)
    if len(found) > 1 and OFFERS[function].one:
        raise InputError(f"effects: {' and '.join(found)} both offer {function}, expected one of them in a scene")
    return next(iter(found.values()), None)
