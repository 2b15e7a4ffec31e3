"""The signal of one sample at one station in a scene, and the decision which physics by need is computed.

In a scene with effects on the motion only, the echo engine gives the signal. Otherwise the chain computes what the
scene names: no waveform without a receiver effect, no frequency response where all physics by need can be left out.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from lowalt.common.blas_threads import one_blas_thread
from lowalt.common.memory import keep_freed_arrays
from lowalt.common.network import SPEED_OF_LIGHT, Network, Station
from lowalt.common.power import rms
from lowalt.common.streams import stream
from lowalt.echo import echo_signal
from lowalt.effects import need, sent_alone
from lowalt.effects.catalogue import BY_NEED, NamedEffect, placed, providing
from lowalt.effects.chain import EXACT, Chain
from lowalt.effects.effect_streams import drawn
from lowalt.effects.interface import (
    AddsEchoes,
    AddsPaths,
    AddsTargets,
    PointsBeams,
    SamplesTime,
    SetsCrossSections,
    ShapesElements,
    WeighsPoints,
)
from lowalt.effects.need import Decision
from lowalt.effects.outcome import Outcome, largest_of
from lowalt.effects.receiving import DrawsNothing
from lowalt.effects.steps import SHARE, error_before, steps_alone
from lowalt.effects.target_echo import TargetEcho
from lowalt.effects.view import View
from lowalt.targets.cloud import Cloud

BEYOND_MOTION = "transmitter", "channel", "receiver", "detection"
"""Places of the effects that the chain computes."""
INTERPOLATION = 0.04
"""Share of what may be left out that interpolation over frequencies and instants may err by."""


@dataclass(frozen=True)
class Scene:
    """A scene: its network, seed, tolerance, and its `effects` in the chain's order (`catalogue.called`)."""

    network: Network
    seed: int
    tolerance: float | None
    effects: tuple[NamedEffect, ...]

    @cached_property
    def still(self) -> frozenset[str]:
        """Names of the effects that draw nothing."""
        return frozenset(effect.name for effect in providing(self.effects, DrawsNothing))

    def stream(self, name: str, row: dict, *more: str) -> np.random.Generator:
        """Return the stream of an effect for the motion model `row`, from its start at every call."""
        # Noise at one SNR does not depend on noise at another.
        levels = [effect.settings["snr_db"] for effect in self.effects if effect.name == name == "cell_noise"]
        return stream(self.seed, "effect", name, row["subtype"], row["model"], *more, *filter(None, levels))

    def at_snr(self, snr_db: float) -> "Scene":
        """Return the scene with noise in all range cells at this SNR (dB), instead of at each of noise.snr_db."""
        changed = [
            effect._replace(settings=effect.settings | {"snr_db": snr_db}) if effect.name == "cell_noise" else effect
            for effect in self.effects
        ]
        return replace(self, effects=tuple(one for one in changed if not one.module.idle(one.settings)))


class Received(NamedTuple):
    """The signal of one target at one station.

    signal: (N,) complex128, Y_bin; cell: (N,) chosen range cells; power: mean |Y_bin|^2 of the target's echo alone as
    it arrives on the direct path (W), after occlusion, aspect and fluctuation; set SNRs refer to it; decisions: which
    physics by need was computed, and why.
    """

    signal: np.ndarray
    cell: np.ndarray
    power: float
    decisions: list[Decision]


@one_blas_thread()
def received_signal(
    scene: Scene, station: Station, cloud: Cloud, row: dict, occluders: dict | None = None,
    clouds: Mapping[str, Cloud] | None = None,
) -> Received:  # fmt: skip
    """Return the signal at `station` of the motion model `row` (motion table) under the scene's effects.

    occluders: the target's surfaces, for self-occlusion; clouds: those of other subtypes, for companions.
    Raises: InputError naming the sample that cannot be computed.
    """
    sample = f"{row['subtype']}, model {row['model']}, station {station.name}"
    fixed = providing(scene.effects, SetsCrossSections)
    beyond = [one for one in placed(scene.effects, *BEYOND_MOTION) if one not in fixed]
    asked = [effect.name for effect in beyond if effect.name in BY_NEED]
    # Half the tolerance is for physics that is left out, the other half for the echo engine's approximations.
    share = scene.tolerance if scene.tolerance is None or not asked else 0.5 * scene.tolerance
    cloud = with_cross_sections(scene, cloud)
    view = observe(scene, station, cloud, row, occluders)
    link = station.transmitter is not None
    if not beyond and not link:
        own = echo_signal(scene.network, station, view.motion, cloud.rcs_m2, view.aim_m, share, sample=sample)
        return Received(own.signal, own.cell, arriving(own.signal), [])
    keep_freed_arrays()
    chain = Chain(beyond, view, partial(drawn, scene, row, station))
    # Bounds and the engine are those of a station that receives its own signal. Where no physics can be left out, one
    # exact run takes less time than finding out what error is allowed.
    exact = share is None or not asked or math.isinf(chain.amplification) or link
    weighed = bool(providing(beyond, WeighsPoints)) or view.beams is not None
    # Noise that an effect sets by this power must not depend on the engine's approximations.
    weighed = weighed or "cell_noise" in chain.names
    own = None
    # Call the engine only where the chain would not compute the same echo itself.
    if not link and (not exact or (chain.target.bent and not weighed)):
        own = echo_signal(scene.network, station, view.motion, cloud.rcs_m2, view.aim_m, share, sample=sample)
    if exact and not asked:
        sent_alone.send(chain)
    chain.receiving.power = power = arriving(seen_alone(chain) if own is None or weighed else own.signal)
    # At a tolerance the chain runs first without the physics by need.
    chain.receiving.again = share is not None and bool(asked)
    chain.others = others(scene, chain, cloud, row, clouds or {})
    if exact:
        if scene.tolerance is not None and asked and steps_alone(chain):
            largest = largest_of(chain.run(frozenset(), leads=False))
            chain.error = error_before(chain, SHARE * scene.tolerance * largest)
        outcome = chain.run(frozenset(asked), leads=False)
        notes = need.decisions(asked, {}, [], share, float(abs(outcome.signal).max()))
        return Received(outcome.signal, outcome.cell, power, notes)
    largest = float(abs(own.signal).max())
    chain.limit(INTERPOLATION * share * largest)
    # Where the scene names only physics by need, the engine's echo is the outcome without any of it.
    alone = len(asked) == len(beyond)
    trial = Outcome(own.signal, own.cell, own.gap) if alone else chain.run(frozenset())
    # A canceller may remove most of the echo; the tolerance is relative to the signal behind it.
    while not alone and chain.error > EXACT and chain.interpolation() > INTERPOLATION * share * largest_of(trial):
        chain.limit(0.5 * INTERPOLATION * share * largest_of(trial))
        trial = chain.run(frozenset())
    outcome, notes = settle(chain, asked, share, trial)
    return Received(outcome.signal, outcome.cell, power, notes)


def arriving(signal: np.ndarray) -> float:
    """Return the mean |Y_bin|^2 (W) of a signal (N,), after rounding to complex64 as the echo stage rounds.

    The noise level is then the same with and without effects.
    """
    return rms(signal.astype(np.complex64)) ** 2


def seen_alone(chain: Chain) -> np.ndarray:
    """Return the target's echo (N,) on the direct path with its visibility and aspect; SNRs refer to it."""
    return chain.target.strongest[0]


def with_cross_sections(scene: Scene, cloud: Cloud) -> Cloud:
    """Return the cloud with the cross sections that the scene gives its points."""
    wavelength_m = SPEED_OF_LIGHT / scene.network.carrier_hz
    for effect in providing(scene.effects, SetsCrossSections):
        cloud = replace(cloud, rcs_m2=effect.module.cross_sections(effect.settings, cloud, wavelength_m))
    return cloud


def others(scene: Scene, chain: Chain, cloud: Cloud, row: dict, clouds: Mapping[str, Cloud]) -> list[TargetEcho]:
    """Return the echo of every target other than that of `chain`, under the same beams at the same instants."""
    view, adding = chain.view, providing(scene.effects, AddsTargets)
    mine = [one for one in chain.channel if not isinstance(one.module, (AddsTargets, AddsEchoes))] if adding else []
    result = []
    for effect in adding:
        found = effect.module.companions(effect.settings, cloud, row, clouds, scene.stream(effect.name, row))
        for given, at in found:
            # A companion of the target's own subtype has its cross sections already.
            own = given if given is cloud else with_cross_sections(scene, given)
            seen = observe(scene, view.station, own, at, view.occluders if given is cloud else None)
            beams = {end.name: view.beams_of(end) for end in _ends(scene.network, view.station)}
            seen = replace(seen, times_s=view.times_s, sampling=view.sampling, beams=beams)
            draws = partial(drawn, scene, at, view.station)
            result.append(TargetEcho(mine, seen, draws, chain.sending))
    return result


def observe(scene: Scene, station: Station, cloud: Cloud, row: dict, occluders: dict | None = None) -> View:
    """Return the view of a sample with the scene's motion effects drawn; their draws do not depend on the station."""
    times_s = scene.network.times_s
    grid_s = np.append(times_s, len(times_s) * scene.network.symbol_interval_s)
    sampling = None
    for effect in providing(scene.effects, SamplesTime):
        draws = scene.stream(effect.name, row, station.name)
        sampling = effect.module.sampling(effect.settings, scene.network, draws)
        times_s = sampling.times_s
    moved = tuple(
        effect.module.perturb(effect.settings, cloud, row, grid_s, scene.stream(effect.name, row))
        for effect in placed(scene.effects, "motion")
    )
    reflected = bool(providing(scene.effects, AddsPaths))
    shaped = [effect.module.element(effect.settings) for effect in providing(scene.effects, ShapesElements)]
    element = shaped[0] if shaped else None
    view = View(
        scene.network, station, cloud, row, times_s, grid_s, moved, occluders, element, reflected, sampling=sampling
    )  # fmt: skip
    for effect in providing(scene.effects, PointsBeams):
        beams = {
            end.name: effect.module.beams(effect.settings, view.of(end), scene.stream(effect.name, row, end.name))
            for end in _ends(scene.network, station)
        }
        view = replace(view, beams=beams)
    return view


def _ends(network: Network, station: Station) -> list[Station]:
    """All stations of the network that are not links, and those of `station`."""
    own = [station] if station.transmitter is None else [station.transmitter, station.receiver]
    others = [one for one in network.stations if one.transmitter is None]
    return list({one.name: one for one in [*others, *own]}.values())


def settle(chain: Chain, asked: list[str], share: float, trial: Outcome) -> tuple[Outcome, list[Decision]]:
    """Return the outcome with the physics `asked` for computed by need, and the decisions.

    share: largest change allowed by leaving physics out, relative to the sample's largest value; trial: the outcome
    with none of it computed. Where the physics that is left out could change a symbol's strongest cell, that symbol is
    computed with all of it.
    """
    everything = frozenset(asked)
    largest = largest_of(trial)
    bounds = chain.bounds(everything)
    left, spent = need.leave_out(bounds, share, largest)
    outcome = trial if len(left) == len(asked) else chain.run(everything - set(left))
    # The strongest cell is certain where it exceeds the second by more than twice the largest error of a cell.
    contested = outcome.gap <= 2.0 * (spent + chain.interpolation())
    if contested.any():
        outcome = chain.patched(outcome, contested, everything)
    return outcome, need.decisions(asked, bounds, left, share, largest)
