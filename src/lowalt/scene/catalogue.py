"""The names of all effects in the order the chain applies them, and the loading of those a scene names.

Only names live here: a module is imported when a scene names it, and never otherwise. An effect is a module in the
folder of its place that defines DEFAULTS. One that the list below does not name comes last in its place.
"""

import importlib
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

from lowalt.files.errors import InputError

PLACE_ORDER = ("motion", "transmitter", "channel", "receiver", "detection")
"""The places where effects act, in the order of the chain."""
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
    folder, result = Path(__file__).parent / "effects", []
    for place in PLACE_ORDER:
        listed = [entry for entry in LISTED if entry.startswith(f"{place}/")]
        files = sorted(f"{place}/{path.stem}" for path in (folder / place).glob("*.py"))
        new = [entry for entry in files if entry not in listed]
        result += listed + [entry for entry in new if "\nDEFAULTS" in (folder / f"{entry}.py").read_text()]
    return tuple(result)


ORDER = _every_effect()
"""Place and name of every effect, in the order of the chain."""
PLACES = {entry.partition("/")[2]: entry.partition("/")[0] for entry in ORDER}
"""Place of every effect by its name."""

SHARED_STREAMS = {"clock_offset": "oscillator", "carrier_offset": "oscillator"}
"""Random streams of effects that draw the same error of one oscillator."""
LOOK_WIDE = ("link_offset",)
"""Effects past the motion whose draws are the same for all stations of a look."""
PAIR_WIDE = ("fluctuation",)
"""Effects whose draws are the same for both directions of a link."""
BY_END = ("line_of_sight",)
"""Effects that act on each way of a link as the station at its end draws them for its own look."""


class NamedEffect(NamedTuple):
    """An effect that a scene names: its module (`protocols`), and its settings, defaults filled in."""

    name: str
    place: str
    module: ModuleType
    settings: dict


def dotted(name: str) -> str:
    """Return the module of an effect, such as lowalt.scene.effects.receiver.adc.

    Raises: InputError for a name that belongs to no effect.
    """
    if name not in PLACES:
        raise InputError(f"effects: unknown effect {name!r}, expected some of {sorted(PLACES)}")
    return f"lowalt.scene.effects.{PLACES[name]}.{name}"


def called(block: dict[str, dict | None]) -> list[NamedEffect]:
    """Return the effects of a scene's `effects` block in the chain's order, without those that are the identity.

    Raises: InputError for an unknown effect or parameter.
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
        settings = {**module.DEFAULTS, **changed}
        if not module.idle(settings):
            result.append(NamedEffect(name, PLACES[name], module, settings))
    return result


def placed(effects: Iterable[NamedEffect], *places: str) -> list[NamedEffect]:
    """Return the effects of these places, order kept."""
    return [effect for effect in effects if effect.place in places]


def providing(effects: Iterable[NamedEffect], protocol: type) -> list[NamedEffect]:
    """Return the effects whose modules satisfy a protocol of `protocols`, order kept."""
    return [effect for effect in effects if _satisfies(effect.module, protocol)]


@cache
def _satisfies(module: ModuleType, protocol: type) -> bool:
    """Whether a module satisfies a protocol; Python compares all names of a protocol each time it is asked."""
    return isinstance(module, protocol)
