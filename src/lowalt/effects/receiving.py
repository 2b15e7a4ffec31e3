"""What a station's receiver makes of responses and of time samples, and the look as receiver and detection know it."""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np

from lowalt.common.network import SPEED_OF_LIGHT
from lowalt.effects import strongest_cell, transforms, waveform
from lowalt.effects.catalogue import NamedEffect, providing, stream_name
from lowalt.effects.interface import AddsNoise, ChangesResponse, Quantises
from lowalt.effects.range_noise import RangeNoise
from lowalt.effects.sending import Sending
from lowalt.effects.view import View
from lowalt.effects.waveform import Carried, Frame


@runtime_checkable
class ChangesTones(Protocol):
    """Optional, receiver: an effect that can also act on the transform of its samples, without going back to them."""

    def retoned(self, settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
        """Return np.fft.fft of the samples (N, M) of `receive`, given that of its samples; tones may be overwritten."""


@runtime_checkable
class TakesTones(Protocol):
    """Optional, receiver: an effect that begins with a transform of its samples, which may then be given at once."""

    def retimed(self, settings: dict, tones: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
        """Return the samples (N, M) of `receive`, given np.fft.fft of its samples; tones may be overwritten."""


@runtime_checkable
class TakesResponses(Protocol):
    """Optional, receiver: an effect that changes tones and can also begin with responses and the data they carry."""

    def retoned_responses(
        self, settings: dict, carried: Carried, frame: Frame, rng: np.random.Generator
    ) -> np.ndarray:  # fmt: skip
        """Return what `retoned` returns of their tones (N, M); they are not changed."""


@runtime_checkable
class GivesTones(Protocol):
    """Optional, receiver: an effect that can transform the samples that it makes at once."""

    def toned(self, settings: dict, samples: np.ndarray, frame: Frame, rng: np.random.Generator) -> np.ndarray:
        """Return np.fft.fft of the samples (N, M) of `receive`."""


@runtime_checkable
class DrawsNothing(Protocol):
    """Optional: an effect without random numbers. No stream is made for it; its generator is UNUSED."""

    DRAWS_NOTHING: bool


@runtime_checkable
class NeedsNoData(Protocol):
    """Optional, receiver: an effect that reads no data. Its frame has ones in their place, so that none are made."""

    NEEDS_NO_DATA: bool


UNUSED = np.random.Generator(np.random.PCG64(0))
"""The generator of effects that draw nothing."""


class Heard:
    """What a receiver has made of a look: responses (N, M), or their tones and the QPSK data that they carried."""

    def __init__(self, responses: np.ndarray, signs: np.ndarray | None = None, noise: RangeNoise | None = None):
        """Keep responses, or with `signs` (2, N, M) of QPSK data, the tones (`waveform.tones_of`) of such symbols.

        noise: what is to be added to the range cells of responses.
        """
        self.given, self.signs, self.noise = responses, signs, noise

    @cached_property
    def responses(self) -> np.ndarray:
        """The responses (N, M), the data divided out."""
        if self.noise is not None:
            return self.given + self.noise.response
        return self.given if self.signs is None else waveform.without(self.given, waveform.of_signs(self.signs))

    def cells(self, sending: Sending) -> np.ndarray:
        """Return the range cells, all M or those of the pilots' comb."""
        if self.noise is None or sending.pilots is not None:
            return sending.cells(self.responses)
        cells = sending.cells(self.given)
        cells += self.noise.cells()
        return cells

    def strongest(self, near: int | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Return the strongest range cells of all symbols, values (N,) and numbers (N,), from no response at all.

        near: as in `strongest_cell.strongest`.
        """
        if self.noise is not None:
            return self.noise.strongest(self.given)
        return strongest_cell.strongest(self.given, self.signs, near)


class Receiving:
    """The receiver effects of one station, in the chain's order; arguments as in `chain.Chain`."""

    def __init__(
        self, effects: list[NamedEffect], view: View, draws: Callable[[str], np.random.Generator], sending: Sending,
        power: float,
    ):  # fmt: skip
        self.effects, self.view, self.draws, self.sending, self.power = effects, view, draws, sending, power
        self.again = False
        """Whether the look is computed more than once: what effects have drawn is then kept."""
        self._converted: tuple[NamedEffect, np.ndarray] | None = None

    def noise(self) -> tuple[RangeNoise | None, list[NamedEffect]]:
        """Return the noise of range cells with which the effects begin, if any, and the other effects.

        Noise is drawn in range cells where a cell has as much of it as any other, whatever the data.
        """
        first = self.effects[:1]
        if not providing(first, AddsNoise) or self.sending.source is not None or self.sending.distorts:
            return None, self.effects
        return first[0].module.noise(first[0].settings, self.bare, self.draws(first[0].name)), self.effects[1:]

    def responded(self, spectrum: np.ndarray, left: list[NamedEffect]) -> tuple[np.ndarray, list[NamedEffect]]:
        """Return responses (N, M) behind those effects `left` that come first and act on responses, and the others."""
        for place, effect in enumerate(left):
            changed = None
            if providing([effect], ChangesResponse):
                draws = self.draws(stream_name(effect.name))
                changed = effect.module.respond(effect.settings, spectrum, self.bare, draws)
            if changed is None:
                return spectrum, left[place:]
            spectrum = changed
        return spectrum, []

    def aired(self, spectrum: np.ndarray, left: list[NamedEffect], rows: slice | np.ndarray) -> Heard:
        """Return what is heard behind the effects `left` of responses (N, M) of the symbols `rows`, as sent."""
        return self._behind(left, rows, tones=waveform.carrying(spectrum, self.sending.aired[rows]))

    def toned(self, tones: np.ndarray, left: list[NamedEffect]) -> Heard:
        """Return what is heard of the tones (N, M) of a look, which are overwritten, behind the effects `left`."""
        return self._behind(left, slice(None), tones=tones)

    def sampled(self, samples: np.ndarray, left: list[NamedEffect], rows: slice | np.ndarray) -> Heard:
        """Return what is heard of time samples (N, M) of the symbols `rows`, behind the effects `left`."""
        return self._behind(left, rows, samples=samples)

    def _behind(
        self, left: list[NamedEffect], rows: slice | np.ndarray, samples: np.ndarray | None = None,
        tones: np.ndarray | Carried | None = None,
    ) -> Heard:  # fmt: skip
        """What is heard behind the effects `left` of samples, or of tones, which are overwritten.

        A transform takes longer than most effects, so tones are kept while no effect asks for samples.
        """
        for place, effect in enumerate(left):
            frame = self.bare if providing([effect], NeedsNoData) else self.frame
            given = frame, self.draws(stream_name(effect.name))
            takes = bool(providing([effect], TakesTones))
            if tones is None and takes:
                tones = transforms.forward(samples)
            stays = len(_on_tones(left[place:], self.again)) == len(left) - place
            next_takes = len(providing(left[place : place + 2], TakesTones)) == 2
            if tones is not None and (stays or next_takes) and _on_tones([effect], self.again):
                tones = _retoned(effect, tones, *given)
            elif takes:
                samples, tones = effect.module.retimed(effect.settings, _tones(tones), *given), None
            else:
                samples, tones = samples if tones is None else _samples(tones), None
                if providing([effect], Quantises):
                    self._converted = effect, samples
                next_takes = place + 1 == len(left) or bool(providing([left[place + 1]], TakesTones))
                if next_takes and providing([effect], GivesTones):
                    tones = effect.module.toned(effect.settings, samples, *given)
                else:
                    samples = effect.module.receive(effect.settings, samples, *given)
        return Heard(*self.sending.carrying(transforms.forward(samples) if tones is None else _tones(tones), rows))

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
        drawn: dict | None = {} if self.again else None
        return Frame(view.network, view.station, ones, self.power, delay_s, starts_s=starts, drawn=drawn)


def _on_tones(effects: list[NamedEffect], again: bool) -> list[NamedEffect]:
    """Those of some effects that change tones. In a look that is computed `again`, a converter's step is asked for."""
    steps = providing(effects, Quantises) if again else []
    return [effect for effect in providing(effects, ChangesTones) if effect not in steps]


def _retoned(
    effect: NamedEffect, tones: np.ndarray | Carried, frame: Frame, rng: np.random.Generator
) -> np.ndarray:  # fmt: skip
    """The tones (N, M) of symbols behind an effect that changes tones."""
    if isinstance(tones, Carried) and providing([effect], TakesResponses):
        return effect.module.retoned_responses(effect.settings, tones, frame, rng)
    return effect.module.retoned(effect.settings, _tones(tones), frame, rng)


def _tones(tones: np.ndarray | Carried) -> np.ndarray:
    """The tones (N, M), worked out where they are not."""
    return waveform.tones_of(*tones) if isinstance(tones, Carried) else tones


def _samples(tones: np.ndarray | Carried) -> np.ndarray:
    """The samples (N, M) of tones, which may be overwritten."""
    return waveform.transmit(*tones) if isinstance(tones, Carried) else transforms.inverse(tones, out=tones)
