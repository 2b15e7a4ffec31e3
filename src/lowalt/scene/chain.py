"""One sample at one station: signal = detect(receive(transmit(sum of responses))).

In a scene with effects on the motion only, the echo engine gives the signal. Otherwise every effect that the scene
names acts in the order of the catalogue. What no effect asks for is left out whole: symbols without a receiver effect,
time samples without anything that reaches into them.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Station
from lowalt.echo import echo_signal
from lowalt.machine.blas_threads import one_blas_thread
from lowalt.machine.memory import keep_freed_arrays
from lowalt.numerics.power import rms
from lowalt.scene import protocols, waveform
from lowalt.scene.arrivals import Physics, arriving
from lowalt.scene.catalogue import BY_END, NamedEffect, placed, providing
from lowalt.scene.listening import Listening
from lowalt.scene.observe import Scene, ends_of, observe, with_cross_sections
from lowalt.scene.response import ImagePath, response
from lowalt.scene.view import View
from lowalt.scene.waveform import Look
from lowalt.targets.cloud import Cloud


class Received(NamedTuple):
    """The signal of one target at one station.

    signal: (N,) complex128, Y_bin; cell: (N,) chosen range cells, -1 where no symbol was received; power: mean
    |Y_bin|^2 of the target's echo alone as it arrives on the direct path (W), after occlusion, aspect and fluctuation;
    set SNRs refer to it.
    """

    signal: np.ndarray
    cell: np.ndarray
    power: float


class SceneSample:
    """One motion model seen at one station of a scene, and what each step of the chain makes of it.

    row: of the motion table; occluders: the target's surfaces, for self-occlusion; clouds: those of other subtypes, for
    companions. Raises: InputError naming the sample that cannot be computed.
    """

    def __init__(
        self, scene: Scene, station: Station, cloud: Cloud, row: dict, occluders: dict | None = None,
        clouds: Mapping[str, Cloud] | None = None,
    ):  # fmt: skip
        self.scene, self.station, self.cloud, self.row = scene, station, with_cross_sections(scene, cloud), row
        self.clouds = clouds or {}
        self.view = observe(scene, station, self.cloud, row, occluders)
        self.draws = partial(scene.drawn, row, station)
        fixed = providing(scene.effects, protocols.SetsCrossSections)
        beyond = [effect for effect in scene.effects if effect.place != "motion" and effect not in fixed]
        self.transmitter, self.channel, self.receiver, self.detection = (
            placed(beyond, place) for place in ("transmitter", "channel", "receiver", "detection")
        )
        self.names = frozenset(effect.name for effect in beyond)
        by_name = {effect.name: effect for effect in beyond}
        self.physics = Physics(
            "squint" in self.names,
            "wavefront" in self.names,
            by_name.get("symbol_motion"),
            by_name.get("cyclic_prefix"),
        )
        self.share = 1.0
        """Factor on the amplitudes of the target's own points."""
        self._factors: dict[tuple[View, str], np.ndarray] = {}

    @cached_property
    def data(self) -> np.ndarray:
        """The data (N, M) that the receiver knows."""
        return self._drawn_data("waveform")

    @cached_property
    def aired(self) -> np.ndarray:
        """The subcarriers (N, M) on the air."""
        return self._amplified(self.data)

    @property
    def plain(self) -> bool:
        """Whether the sample is that of the echo stage: nothing acts beyond the motion."""
        return not self.names and self.station.transmitter is None

    def weight(self, view: View, names: Iterable[str] | None = None) -> np.ndarray:
        """Return the product (N, L) of the factors of all effects, or those named, on the points of a view."""
        result = np.full(view.places.shape[:2], self.share if view.row is self.row else 1.0)
        for effect in providing(self.channel, protocols.WeighsPoints):
            if names is None or effect.name in names:
                result *= self._factor(effect, view)
        return result

    def _factor(self, effect: NamedEffect, view: View) -> np.ndarray:
        """The factor (N, L) or (N, 1) of one effect, computed once a view."""
        if (view, effect.name) not in self._factors:
            visible, settings = effect.module.visible, effect.settings
            if view.station.transmitter is not None and effect.name in BY_END:
                out, back = (
                    visible(settings, end, self.scene.drawn(view.row, end.station, effect.name)) for end in view.ends()
                )
                factor = np.sqrt(out * back)
            else:
                factor = visible(settings, view, self.scene.drawn(view.row, self.station, effect.name))
            self._factors[view, effect.name] = factor
        return self._factors[view, effect.name]

    def every_path(self, view: View) -> list[ImagePath]:
        """Return all paths but the direct one; on a link those of its receiver, each with its sender's."""
        adding = providing(self.channel, protocols.AddsPaths)
        ends = [
            [path for effect in adding for path in effect.module.paths(effect.settings, end)] for end in view.ends()
        ]
        if len(ends) == 2:
            ends[0] = [there._replace(sender=here) for here, there in zip(*ends, strict=True)]
        return ends[0]

    def paths(self, view: View) -> list[ImagePath]:
        """Return those paths that carry anything in the look: most facades reflect nothing of it."""
        return [path for path in self.every_path(view) if _carries(path)]

    def routes(self, view: View, paths: list[ImagePath]) -> np.ndarray:
        """Return the factor on the points' amplitudes, (N, L), or (R, R, N, L) where the scene tells routes apart."""
        telling = providing(self.channel, protocols.WeighsRoutes)
        if not telling or not paths:
            return self.weight(view)
        return telling[0].module.routes(telling[0].settings, view, paths, self.weight)

    def targets(self) -> list[View]:
        """Return the view of the target and of every companion, under the same beams at the same instants."""
        result = [self.view]
        for effect in providing(self.channel, protocols.AddsTargets):
            rng = self.scene.stream(effect.name, self.row)
            found = effect.module.companions(effect.settings, self.cloud, self.row, self.clouds, rng)
            beams = {end.name: self.view.beams_of(end) for end in ends_of(self.scene.network, self.station)}
            for cloud, row in found:
                own = cloud if cloud is self.cloud else with_cross_sections(self.scene, cloud)
                occluders = self.view.occluders if cloud is self.cloud else None
                view = observe(self.scene, self.station, own, row, occluders)
                result.append(replace(view, times_s=self.view.times_s, sampling=self.view.sampling, beams=beams))
        return result

    @cached_property
    def direct(self) -> np.ndarray:
        """The target's subcarriers (N, M) on the direct path, by plane waves of one frequency."""
        return response(self.view, (), self.weight(self.view))

    def reference(self) -> float:
        """Return the mean |Y_bin|^2 (W) of the target's echo alone, to which set SNRs refer."""
        cells = waveform.range_cells(self.direct)
        return arriving_power(np.take_along_axis(cells, abs(cells).argmax(axis=1)[:, None], axis=1)[:, 0])

    def echo(self, view: View) -> np.ndarray:
        """Return the subcarriers (N, M) of a view's target on all paths, without what reaches into symbols."""
        paths, bent = self.paths(view), self.physics.squint or self.physics.wavefront
        if view is self.view and not paths and not bent:
            return self.direct
        return self.physics.response(view, paths, self.routes(view, paths))

    def arrived(self) -> np.ndarray:
        """Return the response (N, M) of all echoes as the receiver's own data reveal it, behind the receiver's effects.

        Where nothing acts on time samples there are none.
        """
        adding = providing(self.channel, protocols.AddsEchoes)
        added = [each.module.scatter(each.settings, self.view, self.draws(each.name)) for each in adding]
        unknown = self._unknown()
        if self.physics.within_symbols:
            symbols = self.aired, self._amplified(self._drawn_data("previous waveform"))
            samples = sum(self._samples(view, symbols) for view in self.targets())
            for effect, echo in zip(adding, added, strict=True):
                samples += self._standing(echo, _offset_cells(effect, self.view), symbols)
        else:
            total = sum(added, sum(map(self.echo, self.targets())))
            if unknown is None and not self.receiver and not providing(self.transmitter, protocols.ChangesWaveform):
                return total
            samples = waveform.transmit(total, self.aired)
        if unknown is not None:
            samples += unknown
        look = self.look
        for effect in self.receiver:
            samples = effect.module.receive(effect.settings, samples, look, self.draws(effect.name))
        return waveform.demodulate(samples, self.data)

    def _samples(self, view: View, symbols: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """Time samples (N, M) of a view's target with what reaches into symbols."""
        kept = [number for number, path in enumerate(self.every_path(view)) if _carries(path)]

        def paths_of(moved: View) -> list[ImagePath]:
            """The same paths at other instants."""
            every = self.every_path(moved)
            return [every[number] for number in kept]

        return arriving(self.physics, view, self.routes(view, paths_of(view)), paths_of, symbols)

    def _standing(self, echo: np.ndarray, offset: float, symbols: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
        """Time samples (N, M) of echoes (N, M) that do not move within a symbol, cut by the prefix at their cells."""
        prefix = self.physics.cyclic_prefix
        if prefix is None:
            return waveform.transmit(echo, symbols[0])
        return prefix.module.convolved(prefix.settings, self.scene.network, echo, symbols, offset)

    def _unknown(self) -> np.ndarray | None:
        """Time samples (N, M) of signals that the receiver does not know, None where there are none."""
        facts = Listening(
            self.view,
            self.names,
            self.draws,
            lambda name: self._amplified(self._drawn_data(name)),
            self.direct_seen,
        )
        heard = [
            effect.module.heard(effect.settings, facts) for effect in providing(self.channel, protocols.AddsSignals)
        ]
        heard = [samples for samples in heard if samples is not None]
        return sum(heard[1:], heard[0]) if heard else None

    def direct_seen(self, view: View) -> np.ndarray:
        """Return the subcarriers (N, M) of the target on the direct path with squint and spherical waves as named."""
        return self.physics.response(view, [], self.weight(view))

    @cached_property
    def power(self) -> float:
        """`reference`, which the look and noise at set SNRs ask for."""
        return self.reference()

    @cached_property
    def look(self) -> Look:
        """The look as receiver and detection know it."""
        ends = self.station.transmitter or self.station, self.station
        ways_m = sum(float(np.linalg.norm(self.view.aim_m - np.asarray(end.position_m))) for end in ends)
        return Look(
            self.scene.network, self.station, self.data, self.aired, self.view.times_s, self.power,
            ways_m / SPEED_OF_LIGHT,
        )  # fmt: skip

    @cached_property
    def cells(self) -> np.ndarray:
        """The range cells (N, M) of the received symbols behind the receiver, before detection."""
        total, picking = self.arrived(), providing(self.transmitter, protocols.PicksSubcarriers)
        cells = picking[0].module.range_cells(picking[0].settings, total) if picking else waveform.range_cells(total)
        return cells if self.view.sampling is None else cells[self.view.sampling.present]

    def filtered(self, detection: Sequence[NamedEffect]) -> np.ndarray:
        """Return the range cells (N, M) behind the filters of these detection effects."""
        cells = self.cells
        for effect in providing(detection, protocols.FiltersCells):
            cells = effect.module.process(effect.settings, cells, self.look, self.draws(effect.name))
        return cells

    def chosen(self, detection: Sequence[NamedEffect], cells: np.ndarray) -> np.ndarray:
        """Return the cells (N,) that these detection effects choose of range cells (N, M): else the strongest."""
        result = abs(cells).argmax(axis=1)
        for effect in providing(detection, protocols.ChoosesCells):
            result = effect.module.choose(effect.settings, result, cells, self.look, self.draws(effect.name))
        return result

    def received(self) -> Received:
        """Return the sample's signal, the chosen range cells and the reference power."""
        if self.plain:
            echo = echo_signal(
                self.scene.network, self.station, self.view.motion, self.cloud.rcs_m2, self.view.aim_m,
                self.scene.tolerance, sample=self.name,
            )  # fmt: skip
            return Received(echo.signal, echo.cell, arriving_power(echo.signal))
        cells = self.filtered(self.detection)
        chosen = self.chosen(self.detection, cells)
        signal = cells[np.arange(len(cells)), chosen]
        sampling = self.view.sampling
        if sampling is not None:
            timing = providing(self.transmitter, protocols.SamplesTime)[0]
            signal = timing.module.regridded(timing.settings, signal, sampling, self.scene.network)
            every = np.full(len(sampling.times_s), -1)
            every[sampling.present] = chosen
            chosen = every
        return Received(signal, chosen, self.power)

    def without_target(self) -> "SceneSample":
        """Return the same sample, with the same draws and noise level, whose target reflects nothing."""
        result, power = copy(self), self.power
        result.__dict__ = {name: value for name, value in self.__dict__.items() if name not in ("cells", "direct")}
        result.share, result.power = 0.0, power
        return result

    def own_cell(self) -> np.ndarray:
        """Return the range cell (N,) of the target's middle at each received symbol, on the direct path."""
        ends = self.station.transmitter or self.station, self.station
        middle = self.view.places.mean(axis=1)
        ways_m = sum(np.linalg.norm(middle - np.asarray(end.position_m), axis=1) for end in ends)
        cells = np.rint(ways_m / (2 * self.scene.network.cell_m)).astype(np.int64) % self.cells.shape[1]
        return cells if self.view.sampling is None else cells[self.view.sampling.present]

    @property
    def name(self) -> str:
        """The sample as messages name it."""
        return f"{self.row['subtype']}, model {self.row['model']}, station {self.station.name}"

    def _drawn_data(self, name: str) -> np.ndarray:
        """The data (N, M) of the stream of this name: QPSK unless an effect chooses them."""
        shape, rng = (self.scene.network.symbols, self.scene.network.subcarriers), self.draws(name)
        choosing = providing(self.transmitter, protocols.DrawsData)
        if not choosing:
            return waveform.qpsk(rng, *shape)
        return choosing[0].module.data(choosing[0].settings, *shape, rng)

    def _amplified(self, data: np.ndarray) -> np.ndarray:
        """The subcarriers (N, M) on the air for these data, after all amplifier effects."""
        for effect in providing(self.transmitter, protocols.ChangesWaveform):
            data = effect.module.aired(effect.settings, data)
        return data


@one_blas_thread()
def received_signal(
    scene: Scene, station: Station, cloud: Cloud, row: dict, occluders: dict | None = None,
    clouds: Mapping[str, Cloud] | None = None,
) -> Received:  # fmt: skip
    """Return the signal at `station` of the motion model `row` (motion table) under the scene's effects.

    occluders: the target's surfaces, for self-occlusion; clouds: those of other subtypes, for companions.
    Raises: InputError naming the sample that cannot be computed.
    """
    keep_freed_arrays()
    return SceneSample(scene, station, cloud, row, occluders, clouds).received()


def _carries(path: ImagePath) -> bool:
    """Whether a path carries anything in the look, both ways of a link."""
    return bool(np.any(path.coefficient) and np.any((path.sender or path).coefficient))


def arriving_power(signal: np.ndarray) -> float:
    """Return the mean |Y_bin|^2 (W) of a signal (N,), after rounding to complex64 as the echo stage rounds.

    The noise level is then the same with and without effects.
    """
    return rms(signal.astype(np.complex64)) ** 2


def _offset_cells(effect: NamedEffect, view: View) -> float:
    """How far an effect's echoes stand beyond their range cells' centres, in cells."""
    offset: Callable[[View], float] = getattr(effect.module, "offset_cells", lambda view: 0.0)
    return offset(view)
