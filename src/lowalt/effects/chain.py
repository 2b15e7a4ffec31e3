"""One sample's channel, waveform, receiver and detection, computed with any subset of the physics by need."""

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np

from lowalt.effects import detecting, strongest_cell, waveform
from lowalt.effects.catalogue import ON_ALL_ECHOES, NamedEffect, placed, providing
from lowalt.effects.detecting import FiltersSymbols
from lowalt.effects.interface import AddsEchoes, AddsSignals, Amplifies, SamplesTime
from lowalt.effects.listening import Listening
from lowalt.effects.outcome import Outcome
from lowalt.effects.receiving import Heard, Receiving
from lowalt.effects.sending import Sending
from lowalt.effects.target_echo import EXACT, TargetEcho
from lowalt.effects.view import View

COARSEST = 0.1
"""Largest error of interpolation, relative to the sum of peak amplitudes."""


class Chain:
    """Computes one sample at one station; effects: all but motion's, in the chain's order.

    draws: returns the stream of an effect for this sample and station, from its start at every call; power: mean
    |Y_bin|^2 of the target's echo alone (W).
    """

    def __init__(
        self,
        effects: list[NamedEffect],
        view: View,
        draws: Callable[[str], np.random.Generator],
        power: float = 0.0,
    ):
        self.view, self.draws = view, draws
        self.names = frozenset(effect.name for effect in effects)
        self.transmitter, self.channel, self.receiver, self.detection = (
            placed(effects, place) for place in ("transmitter", "channel", "receiver", "detection")
        )
        self.sending = Sending(self.transmitter, view.network, draws)
        self.timing = next(iter(providing(self.transmitter, SamplesTime)), None)
        self.amplification = math.prod(
            effect.module.amplifies(effect.settings)
            for effect in providing((*self.transmitter, *self.receiver, *self.detection), Amplifies)
        )
        self.target = TargetEcho(self.channel, view, draws, self.sending)
        self.others: list[TargetEcho] = []
        """Other targets of the beam, each with its own view; everything they ask for is computed."""
        self.receiving = Receiving(self.receiver, view, draws, self.sending, power)

    @property
    def error(self) -> float:
        """Error of the target's interpolation (`TargetEcho.error`): that of rounding unless `limit` allows more."""
        return self.target.error

    @error.setter
    def error(self, value: float) -> None:
        """Set the error of the target's interpolation."""
        self.target.error = value

    @cached_property
    def peaks(self) -> np.ndarray:
        """Largest sum of amplitudes (N, P) that each part can have in a range cell of the result."""
        return self.target.strengths * self.amplification

    def interpolation(self) -> float:
        """Return a bound of a range cell's error by interpolation in frequency and time (units of the signal)."""
        moving = self.target.by_need.get("symbol_motion")
        in_time = max(self.error, moving.module.rounding(self.view)) if moving else 0.0
        return (self.error + in_time) * float(self.peaks.sum(axis=1).max())

    def limit(self, allowed: float) -> None:
        """Set the error of interpolation so that no range cell errs by more than `allowed` (units of the signal).

        Where `allowed` is below rounding, the error is that of rounding. Of a target that no ray reaches, nothing errs.
        """
        self.error = COARSEST
        reached = self.interpolation()
        self.error = max(EXACT, COARSEST * min(1.0, allowed / reached)) if reached > 0.0 else COARSEST
        # The positions' rounding stays, however small the error; 1 + 1e-9 lets the division above round.
        if self.interpolation() > (1.0 + 1e-9) * allowed:
            self.error = EXACT

    def bounds(self, names: frozenset[str]) -> dict[str, float]:
        """Return the largest change of a range cell by each physics by need of `names` (units of the signal)."""
        return {name: self._largest(effect) for name, effect in self.target.by_need.items() if name in names}

    def _largest(self, effect: NamedEffect) -> float:
        """Return the largest change of a range cell by an effect: each part's bound times its peak.

        A part without amplitude changes nothing, even where its bound is infinite.
        """
        if effect.name in ON_ALL_ECHOES and providing(self.channel, AddsEchoes):
            return math.inf
        shares = effect.module.bound(effect.settings, self.view, self.names - {effect.name})
        return float((np.where(self.peaks > 0.0, shares, 0.0) * self.peaks).sum(axis=1).max())

    def cells(self, on: frozenset[str], chosen: np.ndarray | None = None) -> np.ndarray:
        """Return the range cells (N, M) before detection with the physics `on`, of the symbols `chosen` (all)."""
        return self.heard(on, chosen).cells(self.sending)

    def heard(self, on: frozenset[str], chosen: np.ndarray | None = None) -> Heard:
        """Return what the receiver makes of the symbols `chosen` (all) with the physics `on`."""
        view, factor = self.view, self.target.routes
        rows = slice(None) if chosen is None else np.flatnonzero(chosen)
        if chosen is not None:
            view = view.at(view.times_s[rows])
            factor = factor if np.ndim(factor) == 0 else factor[..., rows, :]
        noise, left = self.receiving.noise()
        if (tones := self.target.sent()) is not None:
            return self.receiving.toned(tones, left)
        plain = not left and not self.sending.distorts and self._unknown is None
        samples = None
        if (on | self._company) & {"symbol_motion", "cyclic_prefix"}:
            spectrum, samples = self._moving(view, on, factor, rows)
            if plain:
                spectrum = self.sending.with_samples(spectrum, samples, rows)
        else:
            spectrum = self.target.subcarriers(view, on, factor)
            for one in [*(other.own_response for other in self.others), self._clutter]:
                own = one is not None and spectrum is not self.target.__dict__.get("direct")
                spectrum = spectrum if one is None else np.add(spectrum, one[rows], out=spectrum if own else None)
        if plain:
            return Heard(spectrum, noise=noise)
        if noise is not None:
            # Only the arrays of `_moving` are its own and may be overwritten.
            spectrum = np.add(spectrum, noise.response, out=None if samples is None else spectrum)
        if samples is None and self._unknown is None:
            spectrum, left = self.receiving.responded(spectrum, left)
            done = not left and not self.sending.distorts
            return Heard(spectrum) if done else self.receiving.aired(spectrum, left, rows)
        heard = waveform.transmit(spectrum, self.sending.aired[rows])
        for one in (samples, None if self._unknown is None else self._unknown[rows]):
            heard = heard if one is None else np.add(heard, one, out=heard)
        return self.receiving.sampled(heard, left, rows)

    def _moving(
        self, view: View, on: frozenset[str], factor: np.ndarray | float, rows: slice | np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """All echoes with leakage between subcarriers: a response (N, M), and samples (N, M) to add to its own."""
        still, samples = self.target.arriving(view, on, factor, rows)
        for other in self.others:
            samples += other.own_samples[rows]
        if self._clutter is not None:
            cut = self.target.by_need["cyclic_prefix"] if "cyclic_prefix" in on else None
            samples += self._still(cut)[rows]
        return still, samples

    @property
    def _company(self) -> frozenset[str]:
        """Physics by need of the other targets."""
        return frozenset(name for other in self.others for name in other.by_need)

    def run(self, on: frozenset[str], chosen: np.ndarray | None = None, leads: bool = True) -> Outcome:
        """Return the outcome with the physics `on`, of the symbols `chosen` (all); `leads`: whether gaps are needed."""
        heard = self.heard(on, chosen)
        along = providing(self.detection, FiltersSymbols)
        if not leads and self.sending.pilots is None and len(along) == len(self.detection):
            value, cell = self._strongest(heard)
            outcome = Outcome(value, cell, np.full(len(value), np.nan))
            return outcome if self.timing is None else self._evenly(outcome)
        cells = heard.cells(self.sending)
        if self.timing is not None:
            cells = cells[self.view.sampling.present]
        cells = detecting.filtered(self.detection, cells, self.receiving.bare, self.draws)
        best, lead = detecting.chosen(self.detection, cells, self.draws, leads)
        outcome = Outcome(cells[np.arange(len(cells)), best], best, lead)
        return outcome if self.timing is None else self._evenly(outcome)

    def _strongest(self, heard: Heard) -> tuple[np.ndarray, np.ndarray]:
        """The strongest range cells of what is heard, behind filters over symbols; of the direct echo they are kept."""
        if self.detection or self.timing is not None:
            responses = heard.responses if self.timing is None else heard.responses[self.view.sampling.present]
            responses = detecting.filtered(self.detection, responses, self.receiving.bare, self.draws)
            return strongest_cell.strongest(responses, near=self.target.near)
        if heard.noise is None and heard.given is self.target.__dict__.get("direct"):
            return self.target.strongest
        return heard.strongest(self.target.near)

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

    def _still(self, cut: NamedEffect | None) -> np.ndarray:
        """Time samples (N, M) of the echoes of everything but the target, cut by the prefix at their range cells."""
        if cut is None or len(self._added) < 2:
            return self.sending.still(self._clutter, cut, self._added[0][0] if self._added else 0.0)
        return sum(self.sending.still(one, cut, offset) for offset, one in self._added)

    @cached_property
    def _added(self) -> list[tuple[float, np.ndarray]]:
        """How far the echoes of everything but the target stand beyond their range cells' centres, and they (N, M)."""
        found = []
        for effect in providing(self.channel, AddsEchoes):
            module = effect.module
            one = module.scatter(effect.settings, self.view, self.draws(effect.name))
            fixed = getattr(module, "OFFSET_CELLS", 0.0)
            offset = module.offset_cells(self.view) if hasattr(module, "offset_cells") else fixed
            found += [(offset, one)] if one.any() else []
        return found

    @cached_property
    def _clutter(self) -> np.ndarray | None:
        """Sum of the echoes of everything but the target (N, M), None where there are none."""
        added = [one for _, one in self._added]
        return sum(added[1:], added[0]) if added else None

    @cached_property
    def _unknown(self) -> np.ndarray | None:
        """Time samples (N, M) of signals that the receiver does not know, None where there are none."""
        given = Listening(self.view, self.sending, self.names, self.draws, self.target.weight)
        heard = [one.module.heard(one.settings, given) for one in providing(self.channel, AddsSignals)]
        found = [samples for samples in heard if samples is not None]
        return sum(found[1:], found[0]) if found else None
