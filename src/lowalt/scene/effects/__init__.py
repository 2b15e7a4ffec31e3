"""The effects of a scene, one file each in the folder of its place, and the order of all.

What such a file offers: `lowalt.scene.contract`. An effect is imported when a scene names it, and never otherwise.
"""

import importlib
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from lowalt.files.errors import InputError
from lowalt.scene.contract import OFFERS, PLACE_ORDER

LISTED = (
    "motion/rotor_spread",
    "motion/gusts",
    "transmitter/slow_time",
    "transmitter/data_symbols",
    "transmitter/power_amplifier",
    "transmitter/comb_pilots",
    "channel/pointing_error",
    "channel/element_pattern",
    "channel/mean_cross_section",
    "channel/fluctuation",
    "channel/cross_sections",
    "channel/occlusion",
    "channel/line_of_sight",
    "channel/ground_reflection",
    "channel/walls",
    "channel/reflected_aspect",
    "channel/squint",
    "channel/wavefront",
    "channel/symbol_motion",
    "channel/cyclic_prefix",
    "channel/companions",
    "channel/direct_path",
    "channel/interference",
    "channel/clutter",
    "channel/background_channel",
    "receiver/receiver_noise",
    "receiver/cell_noise",
    "receiver/link_offset",
    "receiver/timing_offset",
    "receiver/clock_offset",
    "receiver/carrier_offset",
    "receiver/phase_noise",
    "receiver/transmit_leakage",
    "receiver/iq_imbalance",
    "receiver/adc",
    "detection/canceller",
    "detection/detector",
    "detection/cell_error",
)
"""Place and name of the effects whose order within their place matters, in the order of the chain."""


def _every_effect() -> tuple[str, ...]:
    """LISTED, each place followed by the effects in its folder that are not listed, in alphabetical order."""
    folder, result = Path(__file__).parent, []
    for place in PLACE_ORDER:
        listed = [entry for entry in LISTED if entry.startswith(f"{place}/")]
        files = sorted(f"{place}/{path.stem}" for path in (folder / place).glob("*.py") if path.stem != "__init__")
        result += listed + [entry for entry in files if entry not in listed]
    return tuple(result)


PLACES = {name: place for place, _, name in (entry.partition("/") for entry in _every_effect())}
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


def dotted(name: str) -> str:
    """Return the module of an effect, such as lowalt.scene.effects.receiver.adc.

    Raises: InputError for a name that belongs to no effect.
    """
    if name not in PLACES:
        raise InputError(f"effects: unknown effect {name!r}, expected some of {sorted(PLACES)}")
    return f"{__name__}.{PLACES[name]}.{name}"


def called(block: dict[str, dict | None]) -> list[NamedEffect]:
    """Return the effects of a scene's `effects` block in the chain's order, without those that are idle.

    Raises: InputError for an unknown effect or parameter, or two effects that offer a function of which a scene has
    one (`contract.OFFERS`).
    """
    modules = {name: importlib.import_module(dotted(name)) for name in block}
    result = []
    for name in filter(block.__contains__, PLACES):
        module, changed = modules[name], block[name] or {}
        unknown = sorted(set(changed) - set(module.DEFAULTS))
        if unknown:
            raise InputError(
                f"effects.{name}: unknown parameter(s) {unknown}, expected some of {list(module.DEFAULTS)}"
            )
        result.append(NamedEffect(name, PLACES[name], module, {**module.DEFAULTS, **changed}))
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


def only(effects: Iterable[NamedEffect], function: str) -> Callable[..., Any] | None:
    """Return the function of this name that one of the effects offers, with its settings, None where none does.

    Raises: InputError where several effects offer a function of which a scene has one.
    """
    found = every(effects, function)
    if len(found) > 1 and OFFERS[function].one:
        raise InputError(f"effects: {' and '.join(found)} both offer {function}, expected one of them in a scene")
    return next(iter(found.values()), None)
