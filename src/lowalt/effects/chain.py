"""One sample's channel, waveform, receiver and detection, computed with any subset of the physics by need."""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.effects import need, steering, waveform
from lowalt.effects.catalogue import NamedEffect, placed, providing, stream_name
from lowalt.effects.interface import (
    AddsEchoes,
    AddsPaths,
    Amplifies,
    BoundsItself,
    ChangesResponse,
    ChoosesCells,
    FiltersCells,
    MovesImages,
    Quantises,
    SamplesTime,
    WeighsPoints,
    WeighsRoutes,
)
from lowalt.effects.response import ImagePath
from lowalt.effects.sending import Sending
from lowalt.effects.steering import Steered
from lowalt.effects.view import View
from lowalt.effects.waveform import Frame

COARSEST = 0.1
"""Largest error of interpolation, relative to the sum of peak amplitudes."""
EXACT = 1e-13
"""Error of interpolation, relative to the sum of peak amplitudes, where nothing is approximated."""


class Outcome(NamedTuple):
    """Signal (N,), chosen cells (N,), and magnitude of the strongest cell minus that of the second (N,)."""

    signal: np.ndarray
    cell: np.ndarray
    gap: np.ndarray


class Chain:
    """Computes one sample at one station; effects: all but motion's, in the chain's order.

    draws: returns the stream of an effect for this sample and station, from its start at every call; power: mean
    |Y_bin|^2 of the target's echo alone (W). `error` is the largest error of interpolation over frequencies and over
    instants, each relative to the sum of peak amplitudes; it is that of rounding unless `limit` allows more.
    """

    def __init__(
        self,
        effects: list[NamedEffect],
        view: View,
        draws: Callable[[str], np.random.Generator],
        power: float = 0.0,
    ):
        self.view, self.draws, self.power, self.error = view, draws, power, EXACT
        self.names = frozenset(effect.name for effect in effects)
        self.by_need = {effect.name: effect for effect in providing(effects, BoundsItself)}
        self.transmitter, self.channel, self.receiver, self.detection = (
            placed(effects, place) for place in ("transmitter", "channel", "receiver", "detection")
        )
        self.sending = Sending(self.transmitter, view.network, draws)
        self.timing = next(iter(providing(self.transmitter, SamplesTime)), None)
        self.amplification = math.prod(
            effect.module.amplifies(effect.settings)
            for effect in providing((*self.transmitter, *self.receiver, *self.detection), Amplifies)
        )
        self.others: list[Chain] = []
        """Other targets of the beam, each with its own view; everything they ask for is computed."""
        self.step = 0.0
        self._seen: dict[str, np.ndarray] = {}
        self.factor: np.ndarray | float = 1.0
        for effect in providing(self.channel, WeighsPoints):
            self.factor = self.factor * self._visible(effect, view)

    @property
    def bent(self) -> bool:
        """Whether `direct` is not the whole echo: the scene has further paths or physics by need."""
        return bool(self.by_need or providing(self.channel, AddsPaths))

    @cached_property
    def peaks(self) -> np.ndarray:
        """Largest sum of amplitudes (N, P) that each part can have in a range cell of the result."""
        return self.strengths * self.amplification

    @cached_property
    def strengths(self) -> np.ndarray:
        """Largest sum of amplitudes (N, P) that each part can have in a range cell before the receiver."""
        amplitudes = 1.0 + sum(float(np.max(abs(path.coefficient))) for path in self._paths)
        return need.part_amplitudes(self.view) * amplitudes**2 * float(np.max(self.routes))

    @cached_property
    def routes(self) -> np.ndarray | float:
        """Factor on the points' amplitudes: `factor`, or (R, N, L) of each route where the scene tells them apart."""
        told = providing(self.channel, WeighsRoutes)
        if not told or not self._paths:
            return self.factor
        weighing = providing(self.channel, WeighsPoints)
        return told[0].module.routes(told[0].settings, self.view, self._paths, weighing, self._visible)

    @cached_property
    def direct(self) -> np.ndarray:
        """The target's subcarriers (N, M) on the direct path alone, without physics by need, to rounding."""
        return steering.echo(self.view, factor=self.factor, error=EXACT)

    def interpolation(self) -> float:
        """Return a bound of a range cell's error by interpolation in frequency and time (units of the signal)."""
        return (2.0 if "symbol_motion" in self.by_need else 1.0) * self.error * float(self.peaks.sum(axis=1).max())

    def limit(self, allowed: float) -> None:
        """Set the error of interpolation so that no range cell errs by more than `allowed` (units of the signal).

        Where `allowed` is below rounding, the error is that of rounding.
        """
        self.error = EXACT
        self.error = min(max(EXACT, EXACT * allowed / self.interpolation()), COARSEST)

    def bounds(self, names: frozenset[str]) -> dict[str, float]:
        """Return the largest change of a range cell by each physics by need of `names` (units of the signal)."""
        return {
            name: float(
                (effect.module.bound(effect.settings, self.view, self.names - {name}) * self.peaks).sum(axis=1).max()
            )
            for name, effect in self.by_need.items()
            if name in names
        }

    def cells(self, on: frozenset[str], chosen: np.ndarray | None = None) -> np.ndarray:
        """Return the range cells (N, M) before detection with the physics `on`, of the symbols `chosen` (all)."""
        view, factor = self.view, self.routes
        rows = slice(None) if chosen is None else np.flatnonzero(chosen)
        if chosen is not None:
            view = view.at(view.times_s[rows])
            factor = factor if np.ndim(factor) == 0 else factor[..., rows, :]
        left = self.receiver
        if (on | self._company) & {"symbol_motion", "cyclic_prefix"}:
            samples = self._samples(view, on, factor, rows)
            for other in self.others:
                samples += other.own_samples[rows]
            if self._clutter is not None:
                cut = self.by_need["cyclic_prefix"] if "cyclic_prefix" in on else None
                samples = samples + self.sending.still(self._clutter, cut, self._offset_cells)[rows]
        else:
            spectrum = self._echo(view, on, factor)
            for other in self.others:
                spectrum = spectrum + other.own_response[rows]
            if self._clutter is not None:
                spectrum = spectrum + self._clutter[rows]
            spectrum, left = self._responded(spectrum)
            if not left and not self.sending.distorts:
                return self.sending.cells(spectrum)
            samples = waveform.transmit(spectrum, self.sending.aired[rows])
        for effect in left:
            draws = self.draws(stream_name(effect.name))
            if providing([effect], Quantises):
                self.step = effect.module.step(effect.settings, samples)
            samples = effect.module.receive(effect.settings, samples, self._frame, draws)
        return self.sending.cells(self.sending.received(samples, rows))

    def _responded(self, spectrum: np.ndarray) -> tuple[np.ndarray, list[NamedEffect]]:
        """The response (N, M) after the receiver's leading effects that act on responses, and the remaining effects."""
        for place, effect in enumerate(self.receiver):
            changed = None
            if providing([effect], ChangesResponse):
                draws = self.draws(stream_name(effect.name))
                changed = effect.module.respond(effect.settings, spectrum, self._bare_frame, draws)
            if changed is None:
                return spectrum, self.receiver[place:]
            spectrum = changed
        return spectrum, []

    @cached_property
    def own_response(self) -> np.ndarray:
        """Subcarriers (N, M) of this target with every effect of the scene, to rounding."""
        return self._echo(self.view, frozenset(self.by_need), self.routes)

    @cached_property
    def own_samples(self) -> np.ndarray:
        """Time samples (N, M) of this target with every effect of the scene, to rounding."""
        return self._samples(self.view, frozenset(self.by_need), self.routes, slice(None))

    @property
    def _company(self) -> frozenset[str]:
        """Physics by need of the other targets."""
        return frozenset(name for other in self.others for name in other.by_need)

    def run(self, on: frozenset[str], chosen: np.ndarray | None = None, leads: bool = True) -> Outcome:
        """Return the outcome with the physics `on`, of the symbols `chosen` (all); `leads`: whether gaps are needed."""
        cells = self.cells(on, chosen)
        if self.timing is not None:
            cells = cells[self.view.sampling.present]
        for effect in providing(self.detection, FiltersCells):
            cells = effect.module.process(effect.settings, cells, self._frame, self.draws(effect.name))
        size = abs(cells)
        best, lead = size.argmax(axis=1), need.gap(size) if leads else np.full(len(cells), np.nan)
        for effect in providing(self.detection, ChoosesCells):
            best = effect.module.choose(effect.settings, best, cells, self.draws(effect.name))
        outcome = Outcome(cells[np.arange(len(cells)), best], best, lead)
        return outcome if self.timing is None else self._evenly(outcome)

    def _evenly(self, outcome: Outcome) -> Outcome:
        """The received symbols' outcome at N evenly spaced symbols; the cell is -1 where none was received."""
        view, effect = self.view, self.timing
        cell, gap = np.full(len(view.times_s), -1), np.full(len(view.times_s), np.inf)
        cell[view.sampling.present], gap[view.sampling.present] = outcome.cell, outcome.gap
        return Outcome(effect.module.regridded(effect.settings, outcome.signal, view.sampling, view.network), cell, gap)

    def patched(self, outcome: Outcome, contested: np.ndarray, everything: frozenset[str]) -> Outcome:
        """Return the outcome with contested symbols computed again with all physics in `everything`.

        Interpolation is then to rounding. Transmitter, receiver and detection effects connect symbols, so with any
        of them the whole sample is computed again.
        """
        self.error = EXACT
        if self.transmitter or self.receiver or self.detection:
            return self.run(everything)
        whole = self.run(everything, contested)
        merged = Outcome(*(np.array(values) for values in outcome))
        for values, new in zip(merged, whole, strict=True):
            values[contested] = new
        return merged

    def _echo(
        self, view: View, on: frozenset[str], factor: np.ndarray | float, paths: list[ImagePath] | None = None
    ) -> np.ndarray:
        """The target's subcarriers (N, M), summed over all paths; `paths` where they are not those of `view`."""
        if paths is None:
            paths = self._paths if view is self.view else self._paths_of(view)
        if view is self.view and factor is self.factor and not paths and not on & {"squint", "wavefront"}:
            return self.direct
        return steering.echo(
            view, paths, factor, squint="squint" in on, wavefront="wavefront" in on, error=self.error
        )  # fmt: skip

    def _samples(self, view: View, on: frozenset[str], factor: np.ndarray | float, rows) -> np.ndarray:
        """Time samples (N, M) of the target's echo, with its motion inside a symbol and its cut by the prefix."""
        if "symbol_motion" not in on:
            still = np.zeros(1), np.ones((1, view.network.subcarriers))
            return self._summed(view, on, factor, rows, still)
        moving = self.by_need["symbol_motion"].module
        samples = self._summed(view, on, factor, rows, moving.instants(view, self.error))
        bent = np.flatnonzero(moving.bent(view))
        if len(bent):
            part = view.at(view.times_s[bent])
            own = factor if np.ndim(factor) == 0 else _every_row(factor, len(samples))[..., bent, :]
            numbers = np.arange(len(self.view.times_s))[rows][bent]
            samples[bent] = self._summed(part, on, own, numbers, moving.every_sample(part))
        return samples

    def _summed(
        self, view: View, on: frozenset[str], factor: np.ndarray | float, rows, times: tuple[np.ndarray, np.ndarray]
    ) -> np.ndarray:
        """Time samples (N, M) of the target's echo from its response at instants of a symbol.

        times: the instants (Q,) s and their interpolation weights (Q, M). Points are summed in groups that lose equally
        many samples.
        """
        delays, weights = times
        everyone = np.arange(len(view.times_s))
        groups: list[tuple[int, np.ndarray | float, np.ndarray]] = [(0, factor, everyone)]
        if "cyclic_prefix" in on:
            cut = self.by_need["cyclic_prefix"]
            first = cut.module.first_samples(cut.settings, view)
            groups = [(int(count), factor * (first == count), _any_of(first == count)) for count in np.unique(first)]
            turned = cut.module.turn(cut.settings, view.network, self._frame.baseband_hz)
        # Visibility and reflection coefficients stay during a symbol; only places move.
        held = self._paths if view is self.view else self._paths_of(view)
        samples = np.zeros((len(view.times_s), view.network.subcarriers), np.complex128)
        now, before = self.sending.aired[rows], self.sending.aired_before[rows] if "cyclic_prefix" in on else None
        for delay, weight in zip(delays, weights, strict=True):
            later = view.at(view.times_s + delay) if "symbol_motion" in on else view
            paths = held
            if held and later is not view:
                paths = [ImagePath(new, old.coefficient) for new, old in zip(self._images_of(later), held, strict=True)]
            rays = Steered(later, paths, squint="squint" in on, wavefront="wavefront" in on, error=self.error)
            for count, strength, lit in groups:
                spectrum = rays.echo(strength)[lit]
                echo = waveform.transmit(spectrum, now[lit])
                if count:
                    echo[:, :count] = waveform.transmit(spectrum * turned, before[lit])[:, :count]
                echo *= weight
                samples[lit] += echo
        return samples

    def _paths_of(self, view: View) -> list[ImagePath]:
        """All paths except the direct one."""
        return [
            path for effect in providing(self.channel, AddsPaths) for path in effect.module.paths(effect.settings, view)
        ]

    def _images_of(self, view: View) -> list[np.ndarray]:
        """The points' images (N, L, 3) m of all paths except the direct one."""
        found = []
        for effect in providing(self.channel, AddsPaths):
            if providing([effect], MovesImages):
                found += effect.module.images(effect.settings, view)
            else:
                found += [path.places for path in effect.module.paths(effect.settings, view)]
        return found

    @cached_property
    def _paths(self) -> list[ImagePath]:
        """All paths except the direct one, over the whole look."""
        return self._paths_of(self.view)

    @property
    def _offset_cells(self) -> float:
        """How far the echoes of everything but the target stand beyond the centres of their range cells."""
        offsets = [getattr(effect.module, "OFFSET_CELLS", 0.0) for effect in providing(self.channel, AddsEchoes)]
        return offsets[0] if offsets else 0.0

    def _visible(self, effect: NamedEffect, view: View) -> np.ndarray:
        """The factor of one effect on the points' amplitudes, seen as in `view`; its draws are the same each time."""
        if view is self.view and effect.name in self._seen:
            return self._seen[effect.name]
        found = effect.module.visible(effect.settings, view, self.draws(effect.name))
        if view is self.view:
            self._seen[effect.name] = found
        return found

    @cached_property
    def _clutter(self) -> np.ndarray | None:
        """Sum of the echoes of everything but the target (N, M), None where there are none."""
        added = [
            effect.module.scatter(effect.settings, self.view, self.draws(effect.name))
            for effect in providing(self.channel, AddsEchoes)
        ]
        return sum(added[1:], added[0]) if added else None

    @cached_property
    def _frame(self) -> Frame:
        """The look as receiver and detection effects know it."""
        aired = self.sending.aired if self.sending.distorts else None
        return replace(self._bare_frame, sent=self.sending.known, aired=aired)

    @cached_property
    def _bare_frame(self) -> Frame:
        """The look for effects that need no data: all ones in their place, so that none are drawn."""
        view = self.view
        range_m = float(np.linalg.norm(view.aim_m - np.asarray(view.station.position_m)))
        starts = None if view.sampling is None else view.sampling.times_s
        ones = np.broadcast_to(np.ones((), np.complex128), (view.network.symbols, view.network.subcarriers))
        delay_s = 2.0 * range_m / SPEED_OF_LIGHT
        return Frame(view.network, view.station, ones, self.power, delay_s, starts_s=starts)


def _every_row(factor: np.ndarray, count: int) -> np.ndarray:
    """A factor (N or 1, L) or (R, N or 1, L) with a row for each of `count` symbols."""
    return np.broadcast_to(factor, (*factor.shape[:-2], count, factor.shape[-1]))


def _any_of(chosen: np.ndarray) -> np.ndarray:
    """Return the symbols (K,) in which any point (N, L) is chosen."""
    return np.flatnonzero(chosen.any(axis=1))
