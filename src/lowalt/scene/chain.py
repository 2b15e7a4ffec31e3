"""The signal of one sample at one station of a scene.

It is detect(receive(transmit(sum of frequency responses))).

The chain asks the scene's effects for functions (`contract`) and names no effect. Effects of one
place act in the order of `effects.LISTED`. A step that no effect needs is skipped: the echo engine
computes scenes whose effects change the motion only, and time samples are made only where an effect
acts on them.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache, cached_property, partial
from itertools import zip_longest
from typing import NamedTuple

import numpy as np

from lowalt.config.network import SPEED_OF_LIGHT, Station
from lowalt.echo import echo_signal
from lowalt.files.errors import InputError
from lowalt.machine.blas_threads import one_blas_thread
from lowalt.machine.progress import reported
from lowalt.numerics.portable import rms
from lowalt.scene import truth, waveform
from lowalt.scene.contract import numbers
from lowalt.scene.effects import NamedEffect, every, only
from lowalt.scene.observe import Scene, observe
from lowalt.scene.response import ImagePath, response
from lowalt.scene.view import Still, View
from lowalt.targets.cloud import Cloud, cloud_of


class Received(NamedTuple):
    """The signal of one target at one station.

    signal: (N,) complex128, Y_bin; cell: (N,) chosen range cells, -1 where no symbol was received;
    power: the mean |Y_bin|^2 (W) of the target's own echo on the direct path, with the amplitude
    factors of effects. The SNRs of the configuration refer to this power.
    """

    signal: np.ndarray
    cell: np.ndarray
    power: float


class SceneSample:
    """One motion model as one station of a scene receives it.

    Each method is a step of the chain.
    """

    def __init__(
        self,
        scene: Scene,
        view: View,
        clouds: Mapping[str, Cloud] | None = None,
        power: float | None = None,
    ):
        """Take the scene, the sample's view in it (`observe`), and the clouds of all subtypes.

        Effects that add other targets need the clouds.

        power: the reference of the configuration's SNRs (W), None for the power of the target's own
        echo.
        """
        self.scene = scene
        self.view = view
        self.clouds = clouds or {}
        self._power = power
        self.draws = partial(scene.drawn, view.row, view.station)
        self.only = partial(only, scene.effects)
        self.all = partial(every, scene.effects)
        self.detection = [effect for effect in scene.effects if effect.place == "detection"]
        self._waves: dict[str, bool] = {}
        for waves in self.all("waves").values():
            self._waves |= waves()
        self._factors: dict[tuple[View, str], np.ndarray] = {}

    def weight(self, view: View, one_sided: bool | None = None) -> np.ndarray:
        """Return the product (N, L) of the amplitude factors that effects put on a view's points.

        one_sided: True for the effects with ONE_SIDED alone, False for the others, None for all.
        Raises: InputError for a wrong shape.
        """
        result = np.ones(view.places.shape[:2])
        # Factors of both ends come last, so that a product always has the same order.
        for effect in sorted(self.scene.effects, key=lambda one: one.offers("visible_one_way")):
            if not (effect.offers("visible") or effect.offers("visible_one_way")):
                continue
            if one_sided is not None and effect.offers("ONE_SIDED") != one_sided:
                continue
            key = view, effect.name
            if key not in self._factors:
                self._factors[key] = self._factor(view, effect)
            result *= self._factors[key]
        return result

    def _factor(self, view: View, effect: NamedEffect) -> np.ndarray:
        """The amplitude factor (N, L) or (N, 1) of one effect on the points of a view.

        A one-way factor of a link is the root of the product of those at both ends.
        """
        shapes = [view.places.shape[:2], (len(view.places), 1)]
        if not effect.offers("visible_one_way"):
            visible = self.all("visible")[effect.name]
            rng = self.scene.drawn(view.row, self.view.station, effect.name)
            return numbers(effect.name, "visible", visible(view, rng), shapes, real=True)
        visible = self.all("visible_one_way")[effect.name]
        factors = []
        for end in view.ends():
            rng = self.scene.drawn(view.row, end.station, effect.name)
            found = visible(end, rng)
            factors.append(numbers(effect.name, "visible_one_way", found, shapes, real=True))
        if len(factors) == 1:
            return factors[0]
        product = factors[0] * factors[1]
        if (product < 0).any():
            raise InputError(
                f"{effect.name}: factors of unlike signs at both ends of a link, expected none "
                "below 0"
            )
        return np.sqrt(product)

    def paths(self, view: View) -> list[ImagePath]:
        """Return all paths but the direct one.

        On a link, they are those of the receiver, each with the sender's of its kind.
        """
        ends = []
        for end in view.ends():
            seen: list[ImagePath] = []
            for paths in self.all("paths").values():
                seen += paths(end)
            ends.append(seen)
        if len(ends) == 1:
            return ends[0]
        # Both ends of a link may see different numbers of paths: pad the shorter list with paths of
        # factor 0.
        none = ImagePath(view.places, 0.0)
        return [there._replace(sender=here) for here, there in zip_longest(*ends, fillvalue=none)]

    def routes(self, view: View, paths: list[ImagePath]) -> np.ndarray:
        """Return the amplitude factor of each point, (N, L).

        It is (R, R, N, L) where it depends on the route.
        """
        routes = self.only("routes")
        if routes and paths:
            return routes(view, paths, self.weight)
        return self.weight(view)

    @cached_property
    def targets(self) -> list[View]:
        """The views of the target and of its companions; all have the same beams and instants."""
        view = self.view
        result = [view]
        for name, companions in self.all("companions").items():
            cloud = self.clouds.get(view.cloud.subtype, view.cloud)
            rng = self.scene.stream(name, view.row)
            for other, row in companions(cloud, view.row, self.clouds, rng):
                occluders = view.occluders if other is cloud else None
                result.append(observe(self.scene, view.station, other, row, occluders, beside=view))
        return result

    @cached_property
    def direct(self) -> np.ndarray:
        """The target's frequency response (N, M) on the direct path.

        Waves are plane and beams do not squint, whatever the scene says: set SNRs refer to this
        echo, so that noise does not follow the scene's physics of arrays.
        """
        return response(self.view, (), self.weight(self.view))

    @cached_property
    def power(self) -> float:
        """The reference of the configuration's SNRs.

        It is the mean |Y_bin|^2 (W) of the target's own echo on the direct path.
        """
        if self._power is not None:
            return self._power
        cells = waveform.range_cells(self.direct)
        strongest = abs(cells).argmax(axis=1)
        return arriving_power(cells[np.arange(len(cells)), strongest])

    def direct_echo(self, view: View) -> np.ndarray:
        """Return the frequency response (N, M) of a view's target on the direct path.

        Unlike `direct`, it has the squint and the spherical waves that the scene names.
        """
        return response(view, (), self.weight(view), **self._waves)

    def echo(self, view: View) -> np.ndarray:
        """Return the frequency response (N, M) on all paths of a view's target.

        The target stands still within a symbol.
        """
        # Most facades reflect nothing during a look, so their paths are left out. On a link, waves
        # that leave on a path may return on any other, so a path counts where either end uses it.
        paths = [
            path
            for path in self.paths(view)
            if np.any(path.coefficient) or np.any(path.outward.coefficient)
        ]
        if view is self.view and not paths and not self._waves:
            return self.direct
        return response(view, paths, self.routes(view, paths), **self._waves)

    def _samples(self, view: View) -> np.ndarray:
        """Time samples (N, M) of a target that moves within symbols or beyond the prefix."""
        delays_s = np.zeros(1)
        weights = np.ones((1, self.scene.network.subcarriers))
        if instants := self.only("instants"):
            delays_s, weights = instants(view)
        # Each instant of a symbol is computed as a separate symbol; the instants of one symbol are
        # consecutive.
        moved = view.at((view.times_s[:, None] + delays_s).reshape(-1))
        factor = self.routes(view, self.paths(view))
        paths = self.paths(moved)
        late = np.zeros(view.places.shape[:2], np.int64)
        network = self.scene.network
        if late_samples := self.only("late_samples"):
            late = late_samples(view)

        @cache
        def on_air(name: str) -> np.ndarray | None:
            """The subcarriers on the air at every instant of each symbol."""
            aired = self.on_air(name)
            if aired is None:
                return None
            return np.repeat(aired, len(delays_s), axis=0)

        samples = np.zeros((len(moved.times_s), network.subcarriers), np.complex128)
        # Points that are late by the same number of samples share one response.
        for lost in np.unique(late).tolist():
            some = np.repeat(factor * (late == lost), len(delays_s), axis=-2)
            echo = response(moved, paths, some, **self._waves)
            samples += waveform.windowed(network, self.prefix_s, echo, lost, on_air)
        by_instant = samples.reshape(len(view.times_s), len(delays_s), -1)
        return np.einsum("nqm,qm->nm", by_instant, weights)

    def _standing(self, still: Still) -> np.ndarray:
        """Time samples (N, M) of echoes that do not move within a symbol."""
        if convolved := self.only("convolved"):
            return convolved(self.scene.network, still.response, self.on_air, still.offset_cells)
        return waveform.transmit(still.response, self.on_air("waveform"))

    def arrived(self) -> np.ndarray:
        """Return the frequency response (N, M) that the receiver measures.

        It is taken after the receiver's effects and divided by the sent data.

        Without an effect on time samples, the responses of all echoes are added and no samples are
        made.
        """
        still = self._still()
        unknown = []
        shape = (len(self.view.times_s), self.scene.network.subcarriers)
        for name, heard in self.all("heard").items():
            unknown.append(numbers(name, "heard", heard(self), [shape]))
        none = np.zeros(shape, np.complex128)
        if self.only("instants") or self.only("late_samples"):
            samples = sum(map(self._samples, self.targets), none)
            samples = sum(map(self._standing, still), samples)
        else:
            total = sum(map(self.echo, self.targets), none)
            total = sum((each.response for each in still), total)
            if not unknown and not self.all("receive") and not self.all("aired"):
                return total
            samples = waveform.transmit(total, self.look.aired)
        samples = sum(unknown, samples)
        for name, receive in self.all("receive").items():
            changed = receive(samples, self.look, self.draws(name))
            samples = numbers(name, "receive", changed, [samples.shape])
        return waveform.demodulate(samples, self.look.data)

    def _still(self) -> list[Still]:
        """The echoes of all but targets: a link's direct path, and what effects scatter."""
        result = []
        if from_sender := self.only("from_sender"):
            result.append(from_sender(self.view))
        shape = (len(self.view.times_s), self.scene.network.subcarriers)
        for name, scatter in self.all("scatter").items():
            found = scatter(self.view, self.draws(name))
            response = numbers(name, "scatter", found.response, [shape])
            result.append(found._replace(response=response))
        return result

    @cached_property
    def look(self) -> waveform.Look:
        """What the receiver and the detection know of the coherent processing interval.

        We call the interval a look.
        """
        view = self.view
        delay_s = float(view.ways_m(view.aim_m)) / SPEED_OF_LIGHT
        data = self._data("waveform")
        aired = self.on_air("waveform")
        return waveform.Look(
            self.scene.network, view.station, data, aired, view.times_s, self.power, delay_s
        )

    @cached_property
    def cells(self) -> np.ndarray:
        """The range cells (N, M) of the received symbols, before detection."""
        range_cells = self.only("range_cells") or waveform.range_cells
        return self._present(range_cells(self.arrived()))

    def filtered(self, detection: Sequence[NamedEffect]) -> np.ndarray:
        """Return the range cells (N, M) after the linear filters among these detection effects."""
        cells = self.cells
        for name, filtered in every(detection, "filtered").items():
            cells = numbers(name, "filtered", filtered(cells), [cells.shape])
        return cells

    def chosen(self, detection: Sequence[NamedEffect], cells: np.ndarray) -> np.ndarray:
        """Return the range cell (N,) that these detection effects choose per symbol.

        Without any, it is the strongest.
        """
        result = abs(cells).argmax(axis=1)
        for name, choose in every(detection, "choose").items():
            result = choose(result, cells, self.look, self.draws(name))
        return result

    @property
    def moves_only(self) -> bool:
        """Whether the echo engine computes the sample.

        It does for a station that sends and receives, with effects that change nothing but the
        target's motion and its cross sections.
        """
        if self.view.station.transmitter is not None:
            return False
        return all(
            effect.place == "motion" or effect.offers("cross_sections")
            for effect in self.scene.effects
        )

    def received(self) -> Received:
        """Return the sample's signal, the chosen range cells and the reference power."""
        view = self.view
        sampling = view.sampling
        if self.moves_only:
            echo = echo_signal(
                self.scene.network,
                view.station,
                view.motion,
                view.cloud.rcs_m2,
                view.aim_m,
                self.scene.tolerance,
                sample=self.name,
            )
            return Received(echo.signal, echo.cell, arriving_power(echo.signal))
        cells = self.filtered(self.detection)
        chosen = self.chosen(self.detection, cells)
        signal = cells[np.arange(len(cells)), chosen]
        if sampling is not None:
            if regridded := self.only("regridded"):
                signal = regridded(signal, sampling, self.scene.network)
            of_all_symbols = np.full(len(sampling.times_s), -1)
            of_all_symbols[sampling.present] = chosen
            chosen = of_all_symbols
        return Received(signal, chosen, self.power)

    def without_target(self) -> "SceneSample":
        """Return the same sample with a target that reflects nothing.

        Draws and noise level stay the same.
        """
        cloud = self.view.cloud
        dark = replace(cloud, rcs_m2=np.zeros_like(cloud.rcs_m2))
        return SceneSample(self.scene, replace(self.view, cloud=dark), self.clouds, self.power)

    def true_cell(self, view: View) -> np.ndarray:
        """Return the geometric truth: the range cell (K,) of the middle of a view's target.

        There is one at each received symbol.
        """
        ways_m = view.ways_m(view.places.mean(axis=1))
        cells = np.rint(ways_m / (2 * self.scene.network.cell_m)).astype(np.int64)
        return self._present(cells % self.cells.shape[1])

    def observed(self, view: View) -> tuple[np.ndarray, np.ndarray]:
        """Return where the echo of the middle of a view's target appears on the direct path.

        The result is the range cell (K,), with its fraction, at each received symbol, and the
        folded speed (N,) m/s at each symbol.
        """
        displacements = []
        for name, displaced in self.all("displaced").items():
            displacements.append(displaced(view, self.draws(name)))
        cell, speed_mps = truth.observed(view, displacements, self.cells.shape[1])
        return self._present(cell), speed_mps

    def observed_cell(self, view: View) -> np.ndarray:
        """Return the range cell (K,) nearest to where the echo of a view's target appears.

        There is one at each received symbol.
        """
        return np.rint(self.observed(view)[0]).astype(np.int64) % self.cells.shape[1]

    def _present(self, symbols: np.ndarray) -> np.ndarray:
        """The received ones of N symbols, (N, ...) to (K, ...)."""
        if self.view.sampling is None:
            return symbols
        return symbols[self.view.sampling.present]

    @property
    def prefix_s(self) -> float:
        """The length of the cyclic prefix (s).

        It is that of NR's normal prefix, or the length that an effect states.
        """
        prefix_s = self.only("prefix_s") or waveform.normal_prefix_s
        return prefix_s(self.scene.network)

    @property
    def name(self) -> str:
        """The name of the sample in messages."""
        row = self.view.row
        return f"{row['subtype']}, model {row['model']}, station {self.view.station.name}"

    def _data(self, name: str) -> np.ndarray | None:
        """The data (N, M) that the random stream of this name gives, QPSK by default.

        They are None for waveforms but OFDM.
        """
        network = self.scene.network
        if network.waveform != "ofdm":
            return None
        if draw := self.only("data"):
            return draw(network.symbols, network.subcarriers, self.draws(name))
        return waveform.qpsk(self.draws(name), network.symbols, network.subcarriers)

    def on_air(self, name: str) -> np.ndarray | None:
        """Return the subcarriers (N, M) on the air for the data of a random stream.

        name: "waveform" for the symbol itself, "previous waveform" and "next waveform" for the
        symbols beside it, or a stream of another station.
        """
        data = self._data(name)
        for aired in self.all("aired").values():
            data = aired(data)
        return data


@one_blas_thread()
def received_signal(
    scene: Scene,
    station: Station,
    cloud: Cloud,
    row: dict,
    occluders: dict | None = None,
    clouds: Mapping[str, Cloud] | None = None,
) -> Received:
    """Return the signal of a motion model at `station`, with the scene's effects.

    row: of the motion table; occluders: the target's surfaces, where an effect needs them;
    clouds: the clouds of all subtypes, for effects that add other targets.

    Raises: InputError naming the sample that cannot be computed.
    """
    return SceneSample(scene, observe(scene, station, cloud, row, occluders), clouds).received()


def scene_signals(
    scene: Scene,
    name: str,
    clouds: Mapping[str, Cloud],
    rows: list[dict],
    occluders: Mapping[str, dict] | None,
    snrs: list[float] | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Return signals (models, N) complex64 at a station, and reference powers (models,) W.

    name: of the station; rows: of the motion table.

    clouds: by subtype, those of other targets included; occluders: each subtype's surfaces, where
    an effect needs them; snrs (dB): given if the scene itself adds noise at set SNRs; the result
    has one signal per SNR, (models, snrs, N). Raises: InputError naming the sample whose subtype
    has no cloud, or that cannot be computed.
    """
    station = scene.network.station(name)
    occluders = occluders or {}
    levels = [scene]
    if snrs is not None:
        levels = [scene.at_snr(snr) for snr in snrs]
    result = np.empty((len(rows), len(levels), scene.network.symbols), np.complex64)
    power = np.empty(len(rows))
    for index, row in enumerate(reported(rows, len(rows), "models")):
        cloud = cloud_of(clouds, row)
        surfaces = occluders.get(row["subtype"])
        for number, level in enumerate(levels):
            received = received_signal(level, station, cloud, row, surfaces, clouds)
            result[index, number] = received.signal
            power[index] = received.power
    if snrs is None:
        return result[:, 0], power
    return result, power


def arriving_power(signal: np.ndarray) -> float:
    """Return the mean |Y_bin|^2 (W) of a signal (N,) that is rounded to complex64.

    The echo stage rounds it so.

    Without this rounding, the noise level of a scene without effects would differ from that of the
    noise stage.
    """
    return rms(signal.astype(np.complex64)) ** 2
