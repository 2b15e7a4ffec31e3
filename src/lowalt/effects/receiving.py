"""What a station's receiver makes of responses and of time samples, and the look as receiver and detection know it."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.effects import waveform
from lowalt.effects.catalogue import NamedEffect, providing, stream_name
from lowalt.effects.interface import ChangesResponse, ChangesTones, Quantises
from lowalt.effects.sending import Sending
from lowalt.effects.view import View
from lowalt.effects.waveform import Frame


class Heard(NamedTuple):
    """Responses (N, M) behind the receiver, and whether it has acted on the target's direct echo alone."""

    responses: np.ndarray
    alone: bool = False


class Receiving:
    """The receiver effects of one station, in the chain's order; arguments as in `chain.Chain`."""

    def __init__(
        self, effects: list[NamedEffect], view: View, draws: Callable[[str], np.random.Generator], sending: Sending,
        power: float,
    ):  # fmt: skip
        self.effects, self.view, self.draws, self.sending, self.power = effects, view, draws, sending, power
        self._converted: tuple[NamedEffect, np.ndarray] | None = None

    def responded(self, spectrum: np.ndarray) -> tuple[np.ndarray, list[NamedEffect]]:
        """Return responses (N, M) behind the leading effects that act on responses, and the remaining effects."""
        for place, effect in enumerate(self.effects):
            changed = None
            if providing([effect], ChangesResponse):
                draws = self.draws(stream_name(effect.name))
                changed = effect.module.respond(effect.settings, spectrum, self.bare, draws)
            if changed is None:
                return spectrum, self.effects[place:]
            spectrum = changed
        return spectrum, []

    def aired(self, spectrum: np.ndarray, left: list[NamedEffect], rows: slice | np.ndarray) -> np.ndarray:
        """Return the responses (N, M) behind the effects `left` of responses (N, M) of the symbols `rows`, as sent."""
        tones = waveform.tones_of(spectrum, self.sending.aired[rows])
        if left and providing(left[:1], ChangesTones):
            draws = self.draws(stream_name(left[0].name))
            samples = left[0].module.retimed(left[0].settings, tones, self.frame, draws)
            return self.sampled(samples, left[1:], rows)
        return self.sampled(np.fft.ifft(tones, axis=1, out=tones), left, rows)

    def sampled(self, samples: np.ndarray, left: list[NamedEffect], rows: slice | np.ndarray) -> np.ndarray:
        """Return the responses (N, M) of time samples (N, M) of the symbols `rows`, behind the effects `left`."""
        for effect in left:
            if providing([effect], Quantises):
                self._converted = effect, samples
            draws = self.draws(stream_name(effect.name))
            samples = effect.module.receive(effect.settings, samples, self.frame, draws)
        return self.sending.received(samples, rows)

    @property
    def step(self) -> float:
        """Height of a step of the last look's converter (units of its samples), 0 without one."""
        if self._converted is None:
            return 0.0
        effect, samples = self._converted
        return effect.module.step(effect.settings, samples)

    @cached_property
    def frame(self) -> Frame:
        """The look as receiver and detection effects know it."""
        aired = self.sending.aired if self.sending.distorts else None
        return replace(self.bare, sent=self.sending.known, aired=aired)

    @cached_property
    def bare(self) -> Frame:
        """The look for effects that need no data: all ones in their place, so that none are drawn."""
        view = self.view
        range_m = float(np.linalg.norm(view.aim_m - np.asarray(view.station.position_m)))
        starts = None if view.sampling is None else view.sampling.times_s
        ones = np.broadcast_to(np.ones((), np.complex128), (view.network.symbols, view.network.subcarriers))
        delay_s = 2.0 * range_m / SPEED_OF_LIGHT
        return Frame(view.network, view.station, ones, self.power, delay_s, starts_s=starts)
