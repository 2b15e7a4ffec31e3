"""One sample through everything its scene calls for: motion, channel, waveform, receiver, detection.

Without effects beyond motion the echo engine answers alone. Only what is called for is computed: no waveform without
a receiver effect, no frequency response where physics by need can all be left out.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from lowalt.echo import echo_signal
from lowalt.effects import need
from lowalt.effects.catalogue import BY_NEED, Effect, placed
from lowalt.effects.need import Decision
from lowalt.effects.response import response
from lowalt.effects.view import View
from lowalt.network import SPEED_OF_LIGHT, Network, Station
from lowalt.power import rms
from lowalt.streams import stream
from lowalt.targets.cloud import Cloud


@dataclass(frozen=True)
class Scene:
    """What a scene asks of every sample: `effects` in the chain's order (`catalogue.called`)."""

    network: Network
    seed: int
    tolerance: float | None
    effects: tuple[Effect, ...]


class Heard(NamedTuple):
    """What one station hears of one target.

    signal: (N,) complex128, Y_bin; cell: (N,) chosen range cells; power: mean |Y_bin|^2 of the target's echo alone,
    before any channel effect (W), which set SNRs refer to; decisions: what physics by need was computed, and why.
    """

    signal: np.ndarray
    cell: np.ndarray
    power: float
    decisions: list[Decision]


def hear(scene: Scene, station: Station, cloud: Cloud, row: dict, occluders: dict | None = None) -> Heard:
    """Return what `station` hears of the motion model `row` (motion table) under the scene's effects.

    occluders: the target's surfaces, for self-occlusion.
    Raises: InputError naming the sample where something cannot be computed with.
    """
    sample = f"{row['subtype']}, model {row['model']}, station {station.name}"
    asked = [effect.name for effect in scene.effects if effect.name in BY_NEED]
    # What is left out and what the engine approximates share the tolerance.
    share = scene.tolerance if scene.tolerance is None or not asked else 0.5 * scene.tolerance
    view = observe(scene, station, cloud, row, occluders)
    own = echo_signal(scene.network, station, view.motion, cloud.rcs_m2, view.aim_m, share, sample=sample)
    # Of the signal as it is stored, so that noise set against it is what it would be without this chain.
    power = rms(own.signal.astype(np.complex64)) ** 2
    if not placed(scene.effects, "channel", "receiver", "detection"):
        return Heard(own.signal, own.cell, power, [])
    chain = _Chain(scene, view, power)
    if share is not None:
        # Interpolation may take a fiftieth of the tolerance; it is bounded against the sum of peak amplitudes.
        peaks = float(need.part_amplitudes(view).sum(axis=1).max())
        chain.error = max(0.02 * share * float(abs(own.signal).max()) / peaks, chain.error)
    if len(asked) < len(placed(scene.effects, "channel", "receiver", "detection")):
        trial = None
        if asked and share is not None and math.isfinite(chain.amplification):
            trial = chain.run(frozenset())
        return _settle(chain, asked, share, trial, power)
    if share is None:
        return _settle(chain, asked, None, None, power)
    return _settle(chain, asked, share, _Outcome(own.signal, own.cell, own.gap), power)


def observe(scene: Scene, station: Station, cloud: Cloud, row: dict, occluders: dict | None = None) -> View:
    """Return the view of a sample with the scene's motion effects drawn; their draws know no station."""
    times_s = scene.network.times_s
    grid_s = np.append(times_s, len(times_s) * scene.network.symbol_interval_s)
    moved = tuple(
        effect.module.perturb(effect.settings, cloud, row, grid_s, _stream(scene, effect.name, row))
        for effect in placed(scene.effects, "motion")
    )
    reflected = any(hasattr(effect.module, "ways") for effect in scene.effects)
    return View(
        scene.network, station, cloud, row, times_s, scene.tolerance, grid_s, moved, occluders, reflected
    )  # fmt: skip


def _stream(scene: Scene, name: str, row: dict, *more: str) -> np.random.Generator:
    return stream(scene.seed, "effect", name, row["subtype"], row["model"], *more)


class _Outcome(NamedTuple):
    """Signal (N,), chosen cells (N,), and by how much the strongest cell leads (N,)."""

    signal: np.ndarray
    cell: np.ndarray
    gap: np.ndarray


def _settle(chain: "_Chain", asked: list[str], share: float | None, trial: _Outcome | None, power: float) -> Heard:
    """Decide on physics by need, compute what is needed, and whole where the strongest cell is contested."""
    everything = frozenset(asked)
    if trial is None:
        outcome = chain.run(everything)
        largest = float(abs(outcome.signal).max())
        return Heard(outcome.signal, outcome.cell, power, need.decisions(asked, {}, [], share, largest))
    largest = float(abs(trial.signal).max())
    bounds = chain.bounds(asked)
    left, spent = need.leave_out(bounds, share, largest)
    outcome = trial if len(left) == len(asked) else chain.run(everything - set(left))
    contested = outcome.gap <= 2.0 * spent
    if left and contested.any():
        outcome = chain.patched(outcome, contested, everything)
    notes = need.decisions(asked, bounds, left, share, largest)
    return Heard(outcome.signal, outcome.cell, power, notes)


class _Chain:
    """One sample's channel, waveform, receiver and detection, with any choice of physics by need."""

    def __init__(self, scene: Scene, view: View, power: float):
        self.scene, self.view, self.power = scene, view, power
        self.error = 1e-13
        self.channel = [e for e in placed(scene.effects, "channel") if e.name not in BY_NEED]
        self.by_need = [e for e in scene.effects if e.name in BY_NEED]
        self.receiver = placed(scene.effects, "receiver")
        self.detection = placed(scene.effects, "detection")
        self.amplification = math.prod(
            e.module.amplifies(e.settings) if hasattr(e.module, "amplifies") else 1.0
            for e in (*self.receiver, *self.detection)
        )
        self.factor: np.ndarray | float = 1.0
        for effect in self.channel:
            if hasattr(effect.module, "visible"):
                self.factor = self.factor * effect.module.visible(effect.settings, view)
        self._clutter: np.ndarray | None = None
        self._sent: np.ndarray | None = None
        self._frame = None
        self._routes = 1.0

    def stream(self, name: str) -> np.random.Generator:
        """Return an effect's stream for this sample and station, anew at every call."""
        return _stream(self.scene, name, self.view.row, self.view.station.name)

    def bounds(self, asked: list[str]) -> dict[str, float]:
        """Return the largest change of a range cell by each effect of `asked` (same units as the signal)."""
        view = self.view
        peaks = need.part_amplitudes(view)
        peaks = peaks * self._routes**2 * float(np.max(self.factor)) * self.amplification
        return {
            effect.name: float((effect.module.bound(effect.settings, view) * peaks).sum(axis=1).max())
            for effect in self.by_need
            if effect.name in asked
        }

    def sent(self) -> np.ndarray:
        """Return the data (N, M) that all symbols carry."""
        if self._sent is None:
            from lowalt.effects import waveform

            shape = (self.view.network.symbols, self.view.network.subcarriers)
            self._sent = waveform.sent(self.stream("waveform"), *shape)
        return self._sent

    def echo(self, view: View, on: frozenset[str], factor: np.ndarray | float) -> np.ndarray:
        """Return the target's subcarriers (N, M) over all routes."""
        ways = [
            way for e in self.channel if hasattr(e.module, "ways") for way in e.module.ways(e.settings, view)
        ]  # fmt: skip
        self._routes = max(self._routes, 1.0 + sum(float(np.max(abs(way.coefficient))) for way in ways))
        return response(
            view.network, view.station, view.places, view.cloud.rcs_m2, view.aim_m, ways=ways, factor=factor,
            squint="squint" in on, wavefront="wavefront" in on, error=self.error,
        )  # fmt: skip

    def run(self, on: frozenset[str], chosen: np.ndarray | None = None) -> _Outcome:
        """Return the outcome with the physics `on`, of the symbols `chosen` (all by default)."""
        view, factor = self.view, self.factor
        rows = slice(None) if chosen is None else np.flatnonzero(chosen)
        if chosen is not None:
            view = view.at(view.times_s[rows])
            factor = factor if np.ndim(factor) == 0 else factor[rows]
        clutter = self._scattered(rows)
        spectrum = self._moving(view, on, factor, rows) if "symbol_motion" in on else self.echo(view, on, factor)
        if clutter is not None:
            spectrum = spectrum + clutter
        if self.receiver:
            spectrum = self._received(spectrum)
        cells = np.fft.ifft(spectrum, axis=1)
        for effect in self.detection:
            if hasattr(effect.module, "process"):
                cells = effect.module.process(effect.settings, cells, self.frame(), self.stream(effect.name))
        best = abs(cells).argmax(axis=1)
        lead = need.gap(cells)
        for effect in self.detection:
            if hasattr(effect.module, "choose"):
                best = effect.module.choose(effect.settings, best, cells, self.stream(effect.name))
        return _Outcome(cells[np.arange(len(cells)), best], best, lead)

    def patched(self, outcome: _Outcome, contested: np.ndarray, everything: frozenset[str]) -> _Outcome:
        """Return the outcome with contested symbols computed with everything on.

        Receiver and detection effects reach over symbols, so with any of them the whole sample is computed again.
        """
        if self.receiver or self.detection:
            return self.run(everything)
        whole = self.run(everything, contested)
        signal, cell, lead = (np.array(values) for values in outcome)
        signal[contested], cell[contested], lead[contested] = whole
        return _Outcome(signal, cell, lead)

    def frame(self):
        """Return what receiver and detection effects know of the look."""
        from lowalt.effects.waveform import Frame

        view = self.view
        if self._frame is None:
            range_m = float(np.linalg.norm(view.aim_m - np.asarray(view.station.position_m)))
            self._frame = Frame(view.network, view.station, self.sent(), self.power, 2.0 * range_m / SPEED_OF_LIGHT)
        return self._frame

    def _moving(self, view: View, on: frozenset[str], factor, rows) -> np.ndarray:
        """Subcarriers (N, M) of a target that moves while a symbol lasts: its response at a few instants, blended."""
        from lowalt.effects.channel.symbol_motion import instants
        from lowalt.effects.waveform import demodulate, transmit

        sent = self.sent()[rows]
        delays, weights = instants(view, self.error)
        samples = 0.0
        for delay, weight in zip(delays, weights, strict=True):
            samples = samples + weight * transmit(self.echo(view.at(view.times_s + delay), on, factor), sent)
        return demodulate(samples, sent)

    def _scattered(self, rows) -> np.ndarray | None:
        """Sum of what else scatters (N, M), drawn once a sample."""
        if self._clutter is None:
            for effect in self.channel:
                if hasattr(effect.module, "scatter"):
                    added = effect.module.scatter(effect.settings, self.view, self.stream(effect.name))
                    self._clutter = added if self._clutter is None else self._clutter + added
        return None if self._clutter is None else self._clutter[rows]

    def _received(self, spectrum: np.ndarray) -> np.ndarray:
        """Subcarriers (N, M) after the receiver's effects on time samples."""
        from lowalt.effects import waveform

        frame = self.frame()
        samples = waveform.transmit(spectrum, frame.sent)
        for effect in self.receiver:
            samples = effect.module.receive(effect.settings, samples, frame, self.stream(effect.name))
        return waveform.demodulate(samples, frame.sent)
