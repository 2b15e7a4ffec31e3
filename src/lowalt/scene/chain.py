"""One sample at one station: signal = detect(receive(transmit(sum of responses))).

In a scene with effects on the motion only, the echo engine gives the signal. Otherwise every effect that the scene
names acts in the order of `effects.LISTED`. What no effect asks for is left out whole: symbols without a receiver
effect, time samples without anything that reaches into them.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from functools import cache, cached_property, partial
from typing import NamedTuple

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Station
from lowalt.echo import echo_signal
from lowalt.machine.blas_threads import one_blas_thread
from lowalt.machine.progress import reported
from lowalt.numerics.power import rms
from lowalt.scene import truth, waveform
from lowalt.scene.effects import PLACE_ORDER, NamedEffect, offered, placed
from lowalt.scene.observe import Scene, observe
from lowalt.scene.response import ImagePath, response
from lowalt.scene.view import View
from lowalt.targets.cloud import Cloud, cloud_of

BY_END = ("line_of_sight",)
"""Effects that act on each way of a link as the station at its end draws them for its own look."""


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
    """One motion model seen at one station of a scene, and what each step of the chain makes of it."""

    def __init__(self, scene: Scene, view: View, clouds: Mapping[str, Cloud] | None = None, power: float | None = None):
        """Take a view of the sample in the scene (`observe`), and clouds by subtype, for companions.

        power: to which set SNRs refer (W), None for that of the target's own echo.
        """
        self.scene, self.view, self.clouds, self._power = scene, view, clouds or {}, power
        self.draws = partial(scene.drawn, view.row, view.station)
        self.transmitter, self.channel, self.receiver, self.detection = (
            placed(scene.effects, place) for place in PLACE_ORDER[1:]
        )
        self.settings = {effect.name: effect.settings for effect in scene.effects}
        self._waves = {name: name in self.settings for name in ("squint", "wavefront")}
        self._factors: dict[tuple[View, str], np.ndarray] = {}

    def weight(self, view: View, names: Collection[str] | None = None) -> np.ndarray:
        """Return the product (N, L) of the factors of all effects, or those named, on the points of a view."""
        result = np.ones(view.places.shape[:2])
        for name, visible in offered(self.channel, "visible").items():
            if names is not None and name not in names:
                continue
            if (view, name) not in self._factors:
                ends = [(end, end.station) for end in view.ends()] if name in BY_END else [(view, self.view.station)]
                factors = [visible(end, self.scene.drawn(view.row, station, name)) for end, station in ends]
                self._factors[view, name] = factors[0] if len(factors) == 1 else np.sqrt(factors[0] * factors[1])
            result *= self._factors[view, name]
        return result

    def paths(self, view: View) -> list[ImagePath]:
        """Return all paths but the direct one; on a link those of its receiver, each with its sender's."""
        adding = offered(self.channel, "paths").values()
        ends = [[path for paths in adding for path in paths(end)] for end in view.ends()]
        if len(ends) == 1:
            return ends[0]
        return [there._replace(sender=here) for here, there in zip(*ends, strict=True)]

    def routes(self, view: View, paths: list[ImagePath]) -> np.ndarray:
        """Return the factor on the points' amplitudes, (N, L), or (R, R, N, L) where the scene tells routes apart."""
        for routes in offered(self.channel, "routes").values() if paths else ():
            return routes(view, paths, self.weight)
        return self.weight(view)

    @cached_property
    def targets(self) -> list[View]:
        """The view of the target and of every companion, under the same beams at the same instants."""
        view, result = self.view, [self.view]
        for name, companions in offered(self.channel, "companions").items():
            cloud = self.clouds.get(view.cloud.subtype, view.cloud)
            for other, row in companions(cloud, view.row, self.clouds, self.scene.stream(name, view.row)):
                occluders = view.occluders if other is cloud else None
                result.append(observe(self.scene, view.station, other, row, occluders, beside=view))
        return result

    @cached_property
    def direct(self) -> np.ndarray:
        """The target's subcarriers (N, M) on the direct path, by plane waves of one frequency."""
        return response(self.view, (), self.weight(self.view))

    @cached_property
    def power(self) -> float:
        """Mean |Y_bin|^2 (W) of the target's echo alone on the direct path, to which set SNRs refer."""
        if self._power is not None:
            return self._power
        cells = waveform.range_cells(self.direct)
        return arriving_power(np.take_along_axis(cells, abs(cells).argmax(axis=1)[:, None], axis=1)[:, 0])

    def direct_echo(self, view: View) -> np.ndarray:
        """Return the subcarriers (N, M) of the target on the direct path, by waves as the scene names them."""
        return response(view, (), self.weight(view), **self._waves)

    def echo(self, view: View) -> np.ndarray:
        """Return the subcarriers (N, M) of a view's target on all paths, without what reaches into symbols."""
        # Most facades reflect nothing in a whole look.
        paths = [path for path in self.paths(view) if np.any(path.coefficient) and np.any(path.outward.coefficient)]
        if view is self.view and not paths and not any(self._waves.values()):
            return self.direct
        return response(view, paths, self.routes(view, paths), **self._waves)

    def _samples(self, view: View) -> np.ndarray:
        """Time samples (N, M) of a view's target whose points move within symbols, or are later than the prefix."""
        delays_s, weights = np.zeros(1), np.ones((1, self.scene.network.subcarriers))
        for instants in offered(self.channel, "instants").values():
            delays_s, weights = instants(view)
        # The instants of a symbol stand together, as symbols of their own.
        moved = view.at((view.times_s[:, None] + delays_s).reshape(-1))
        factor, paths = self.routes(view, self.paths(view)), self.paths(moved)
        late, network = np.zeros(view.places.shape[:2], np.int64), self.scene.network
        for late_samples in offered(self.channel, "late_samples").values():
            late = late_samples(view)

        @cache
        def on_air(name: str) -> np.ndarray | None:
            """The subcarriers on the air at every instant of each symbol."""
            aired = self.on_air(name)
            return None if aired is None else np.repeat(aired, len(delays_s), axis=0)

        samples = np.zeros((len(moved.times_s), network.subcarriers), np.complex128)
        # Points that lose equally many samples of the window share one response.
        for lost in np.unique(late).tolist():
            some = np.repeat(factor * (late == lost), len(delays_s), axis=-2)
            echo = response(moved, paths, some, **self._waves)
            samples += waveform.windowed(network, self.prefix_s, echo, lost, on_air)
        return np.einsum("nqm,qm->nm", samples.reshape(len(view.times_s), len(delays_s), -1), weights)

    def _standing(self, name: str, echo: np.ndarray) -> np.ndarray:
        """Time samples (N, M) of an effect's echoes (N, M), which do not move within a symbol."""
        for convolved in offered(self.channel, "convolved").values():
            offset = offered(self.channel, "offset_cells").get(name, lambda view: 0.0)
            return convolved(self.scene.network, echo, self.on_air, offset(self.view))
        return waveform.transmit(echo, self.on_air("waveform"))

    def arrived(self) -> np.ndarray:
        """Return the response (N, M) of all echoes as the receiver's own data reveal it, behind the receiver's effects.

        Where nothing acts on time samples there are none.
        """
        scattering = offered(self.channel, "scatter").items()
        still = {name: scatter(self.view, self.draws(name)) for name, scatter in scattering}
        unknown = [heard(self) for heard in offered(self.channel, "heard").values()]
        if offered(self.channel, "instants") or offered(self.channel, "late_samples"):
            samples = sum(map(self._samples, self.targets))
            samples = sum((self._standing(name, response) for name, response in still.items()), samples)
        else:
            total = sum(still.values(), sum(map(self.echo, self.targets)))
            if not unknown and not self.receiver and not offered(self.transmitter, "aired"):
                return total
            samples = waveform.transmit(total, self.look.aired)
        samples = sum(unknown, samples)
        for name, receive in offered(self.receiver, "receive").items():
            samples = receive(samples, self.look, self.draws(name))
        return waveform.demodulate(samples, self.look.data)

    @cached_property
    def look(self) -> waveform.Look:
        """The look as receiver and detection know it."""
        view, delay_s = self.view, float(self.view.ways_m(self.view.aim_m)) / SPEED_OF_LIGHT
        data = self._data("waveform"), self.on_air("waveform")
        return waveform.Look(self.scene.network, view.station, *data, view.times_s, self.power, delay_s)

    @cached_property
    def cells(self) -> np.ndarray:
        """The range cells (N, M) of the received symbols behind the receiver, before detection."""
        picking = offered(self.transmitter, "range_cells")
        range_cells = next(iter(picking.values()), waveform.range_cells)
        return self._present(range_cells(self.arrived()))

    def filtered(self, detection: Sequence[NamedEffect]) -> np.ndarray:
        """Return the range cells (N, M) behind the filters of these detection effects."""
        cells = self.cells
        for name, process in offered(detection, "process").items():
            cells = process(cells, self.look, self.draws(name))
        return cells

    def chosen(self, detection: Sequence[NamedEffect], cells: np.ndarray) -> np.ndarray:
        """Return the cells (N,) that these detection effects choose of range cells (N, M): else the strongest."""
        result = abs(cells).argmax(axis=1)
        for name, choose in offered(detection, "choose").items():
            result = choose(result, cells, self.look, self.draws(name))
        return result

    def received(self) -> Received:
        """Return the sample's signal, the chosen range cells and the reference power."""
        view, sampling = self.view, self.view.sampling
        beyond = [effect for effect in self.scene.effects if not hasattr(effect.module, "cross_sections")]
        if view.station.transmitter is None and all(effect.place == "motion" for effect in beyond):
            echo = echo_signal(
                self.scene.network, view.station, view.motion, view.cloud.rcs_m2, view.aim_m, self.scene.tolerance,
                sample=self.name,
            )  # fmt: skip
            return Received(echo.signal, echo.cell, arriving_power(echo.signal))
        cells = self.filtered(self.detection)
        chosen = self.chosen(self.detection, cells)
        signal = cells[np.arange(len(cells)), chosen]
        if sampling is not None:
            for regridded in offered(self.transmitter, "regridded").values():
                signal = regridded(signal, sampling, self.scene.network)
            every = np.full(len(sampling.times_s), -1)
            every[sampling.present] = chosen
            chosen = every
        return Received(signal, chosen, self.power)

    def without_target(self) -> "SceneSample":
        """Return the same sample, with the same draws and noise level, whose target reflects nothing."""
        dark = replace(self.view.cloud, rcs_m2=np.zeros_like(self.view.cloud.rcs_m2))
        return SceneSample(self.scene, replace(self.view, cloud=dark), self.clouds, self.power)

    def true_cell(self, view: View) -> np.ndarray:
        """Return the range cell (N,) of the middle of a view's target at each received symbol, on the direct path."""
        ways_m = view.ways_m(view.places.mean(axis=1))
        cells = np.rint(ways_m / (2 * self.scene.network.cell_m)).astype(np.int64) % self.cells.shape[1]
        return self._present(cells)

    def observed(self, view: View) -> tuple[np.ndarray, np.ndarray]:
        """Return the range cell (K,), with its fraction, at each received symbol, and the folded speed (N,) m/s at each
        symbol, at which the echo of the middle of a view's target appears on the direct path."""
        moving = offered(self.scene.effects, "displaced").items()
        displacements = [displaced(view, self.draws(name)) for name, displaced in moving]
        cell, speed_mps = truth.observed(view, displacements, self.cells.shape[1])
        return self._present(cell), speed_mps

    def observed_cell(self, view: View) -> np.ndarray:
        """Return the range cell (K,) nearest to where the echo of a view's target appears at each received symbol."""
        return np.rint(self.observed(view)[0]).astype(np.int64) % self.cells.shape[1]

    def _present(self, symbols: np.ndarray) -> np.ndarray:
        """Those of the symbols (N, ...) that are received."""
        return symbols if self.view.sampling is None else symbols[self.view.sampling.present]

    @property
    def prefix_s(self) -> float:
        """The cyclic prefix's length (s), that of `cyclic_prefix` or NR's."""
        return waveform.prefix_length_s(self.settings.get("cyclic_prefix", {}).get("prefix_s"), self.scene.network)

    @property
    def name(self) -> str:
        """The sample as messages name it."""
        row = self.view.row
        return f"{row['subtype']}, model {row['model']}, station {self.view.station.name}"

    def _data(self, name: str) -> np.ndarray | None:
        """The data (N, M) of the stream of this name: QPSK unless an effect chooses them, none but in OFDM."""
        network = self.scene.network
        if network.waveform != "ofdm":
            return None
        for draw in offered(self.transmitter, "data").values():
            return draw(network.symbols, network.subcarriers, self.draws(name))
        return waveform.qpsk(self.draws(name), network.symbols, network.subcarriers)

    def on_air(self, name: str) -> np.ndarray | None:
        """Return the subcarriers (N, M) on the air whose data come of the stream of this name.

        They are the "waveform", the "previous waveform", the "next waveform", or those of another station.
        """
        data = self._data(name)
        for aired in offered(self.transmitter, "aired").values():
            data = aired(data)
        return data


@one_blas_thread()
def received_signal(
    scene: Scene, station: Station, cloud: Cloud, row: dict, occluders: Mapping[str, dict] | None = None,
    clouds: Mapping[str, Cloud] | None = None,
) -> Received:  # fmt: skip
    """Return the signal at `station` of the motion model `row` (motion table) under the scene's effects.

    occluders: the target's surfaces, for self-occlusion; clouds: those of all subtypes, for companions.
    Raises: InputError naming the sample that cannot be computed.
    """
    return SceneSample(scene, observe(scene, station, cloud, row, occluders), clouds).received()


def scene_signals(
    scene: Scene, name: str, clouds: Mapping[str, Cloud], rows: list[dict], occluders: Mapping[str, dict] | None = None,
    snrs: list[float] | None = None,
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Return signals (models, N) complex64 at the station `name` and reference powers (models,) W of the motion table.

    clouds: by subtype, companions' too; occluders: each subtype's surfaces, where the scene hides points behind them;
    snrs (dB): signals are (models, snrs, N), with noise in all range cells, where the scene has `cell_noise`.
    Raises: InputError naming the sample where a subtype has no cloud or cannot be computed with.
    """
    station, occluders = scene.network.station(name), occluders or {}
    levels = [scene] if snrs is None else [scene.at_snr(snr) for snr in snrs]
    result = np.empty((len(rows), len(levels), scene.network.symbols), np.complex64)
    power = np.empty(len(rows))
    for index, row in enumerate(reported(rows, len(rows), "models")):
        cloud, surfaces = cloud_of(clouds, row), occluders.get(row["subtype"])
        for place, level in enumerate(levels):
            received = received_signal(level, station, cloud, row, surfaces, clouds)
            result[index, place], power[index] = received.signal, received.power
    return result[:, 0] if snrs is None else result, power


def arriving_power(signal: np.ndarray) -> float:
    """Return the mean |Y_bin|^2 (W) of a signal (N,), after rounding to complex64 as the echo stage rounds.

    The noise level is then the same with and without effects.
    """
    return rms(signal.astype(np.complex64)) ** 2
