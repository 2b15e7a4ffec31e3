"""The effects of a scene, one file each in the folder of its place: what such a file offers, and the order of all.

An effect `effects/PLACE/NAME.py` defines SOURCE, where its law comes from, and DEFAULTS, every parameter with its
value. All that it does is one or more of the functions below. IDLE, which may be left out, lists settings that change
nothing: where all values of an entry are set, the effect is dropped. `check(settings, scene)` raises InputError where
settings contradict the rest of a scene (`checks.CheckedScene`).

| place | function | returns |
|---|---|---|
| motion | `perturb(settings, cloud, row, times_s, rng)` | `Perturbation` of the motion of `row` at `times_s` (N,) |
| transmitter | `sampling(settings, network, rng)` | `Sampling`: when symbols are sent, which are received |
| | `regridded(settings, signal, timing, network)` | even signal (N,) of the received symbols |
| | `data(settings, symbols, subcarriers, rng)` | data (N, M) of mean power one |
| | `aired(settings, data)` | subcarriers (N, M) on the air for these data |
| | `range_cells(settings, response)` | range cells of responses (N, M) whose subcarriers are known in part |
| channel | `beams(settings, view, rng)` | `Beams`: where both beams point, and from when on |
| | `element(settings)` | `Element` of the antennas |
| | `cross_sections(settings, cloud, wavelength_m)` | mean cross section (L,) m2 of each point |
| | `visible(settings, view, rng)` | real factor on each point's two-way amplitude, (N, L) or (N, 1) |
| | `paths(settings, view)` | list of `ImagePath`: waves go out by any path and come back by any |
| | `routes(settings, view, paths, weight)` | factors (R, R, N, L) by the way out and the way back, direct first |
| | `companions(settings, cloud, row, clouds, rng)` | clouds and rows of other targets, alike for all stations |
| | `instants(settings, view)` | instants (Q,) s within a symbol, and their weights (Q, M) in its M samples |
| | `late_samples(settings, view)` | how many samples (N, L) of each point are the previous symbol's |
| | `convolved(settings, network, response, on_air, offset_cells)` | time samples (N, M) of still echoes with that |
| | `scatter(settings, view, rng)` | response (N, M) of something other than a target, in sqrt(W) a subcarrier |
| | `offset_cells(settings, view)` | how far those echoes stand beyond their range cells' centres, in cells |
| | `heard(settings, sample)` | time samples (N, M) of signals that the receiver does not know |
| any | `displaced(settings, view, rng)` | `Displacement` of a target's echo by this effect, in delay and frequency |
| receiver | `receive(settings, samples, look, rng)` | time samples (N, M) after the effect |
| detection | `process(settings, cells, look, rng)` | range cells (N, M) after the effect |
| | `choose(settings, chosen, cells, look, rng)` | chosen cells (N,) of range cells (N, M) |

N symbols, L points, M subcarriers or range cells; arrays are float64 or complex128. `settings` holds every key of
DEFAULTS. `rng` is the effect's own stream of this sample and station, so no effect moves another's draws. A module is
imported when a scene names it, and never otherwise.
"""

import importlib
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

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
    folder, result = Path(__file__).parent, []
    for place in PLACE_ORDER:
        listed = [entry for entry in LISTED if entry.startswith(f"{place}/")]
        files = sorted(f"{place}/{path.stem}" for path in (folder / place).glob("*.py"))
        new = [entry for entry in files if entry not in listed]
        result += listed + [entry for entry in new if "\nDEFAULTS" in (folder / f"{entry}.py").read_text()]
    return tuple(result)


ONE = (
    "sampling", "regridded", "data", "range_cells", "beams", "element", "routes", "instants", "late_samples",
    "convolved",
)  # fmt: skip
"""Functions that at most one effect of a scene may offer; of the others, several act in order."""

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

    Raises: InputError for an unknown effect or parameter, or two effects that offer the same one of ONE.
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
    for function in ONE:
        owners = list(offered(acting, function))
        if len(owners) > 1:
            raise InputError(f"effects: {' and '.join(owners)} both offer {function}, expected one of them in a scene")
    return acting


def placed(effects: Iterable[NamedEffect], *places: str) -> list[NamedEffect]:
    """Return the effects of these places, order kept."""
    return [effect for effect in effects if effect.place in places]


def offered(effects: Iterable[NamedEffect], function: str) -> dict[str, Callable[..., Any]]:
    """Return the functions of this name that effects offer, with their settings, by effect in the order given."""
    return {
        effect.name: partial(getattr(effect.module, function), effect.settings)
        for effect in effects
        if hasattr(effect.module, function)
    }
