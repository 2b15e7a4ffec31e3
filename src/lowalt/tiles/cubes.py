"""The cubes of samples: the noisy range cells of every symbol, of which the receiver chooses one.

The linear filters of the scene's detection, such as a canceller, have been applied to them.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from lowalt.config.command import pick
from lowalt.config.network import Network, Station
from lowalt.noise.awgn import add_noise
from lowalt.numerics.streams import stream
from lowalt.scene.chain import SceneSample
from lowalt.scene.effects import called, every
from lowalt.scene.observe import Scene, observe
from lowalt.scene.set_noise import in_all_cells
from lowalt.scene.truth import geometric
from lowalt.scene.view import View
from lowalt.spectra.cube import Cube
from lowalt.targets.cloud import Cloud, cloud_of


class _Clean(NamedTuple):
    """A sample without the noise of its SNR, unless the scene's effects add that noise.

    cells: (N, M), range cells; chosen: (N,), the cell that the receiver chose; truths: (N, 7) of
    every target; power_w: the power (W) that SNRs refer to.
    """

    cells: np.ndarray
    chosen: np.ndarray
    truths: tuple[np.ndarray, ...]
    power_w: float


def _received_symbols(view: View) -> slice | np.ndarray:
    """The symbols of a look that were received: all, where nothing is said of them."""
    if view.sampling is None:
        return slice(None)
    return view.sampling.present


class Cubes:
    """Makes the cubes of samples and keeps the clean ones of the last motion models and stations."""

    def __init__(
        self,
        scene: Scene,
        clouds: Mapping[str, Cloud],
        occluders: Mapping[str, dict] | None = None,
        every_cell: bool = False,
        empty: bool = False,
        kept: int = 3,
    ) -> None:
        """Take the scene and clouds by subtype.

        occluders: each subtype's surfaces, needed where the scene hides points behind them;
        every_cell: whether noise at the samples' SNRs is an effect of the scene
        (`set_noise.in_all_cells`); empty: whether the targets reflect nothing, so that noise and
        land alone are left; kept: how many clean samples stay in memory.
        """
        self.scene = scene
        self.clouds = clouds
        self.occluders = occluders or {}
        self.every_cell = every_cell
        self.empty = empty
        self.kept = kept
        self._clean: dict[tuple, _Clean] = {}

    @classmethod
    def from_settings(
        cls,
        settings: dict,
        clouds: Mapping[str, Cloud],
        occluders: Mapping[str, dict] | None = None,
        empty: bool = False,
    ) -> "Cubes":
        """Build from a settings object with exactly seed, network, tolerance and effects.

        Raises: InputError naming the key and value that is missing, unknown or out of range.
        """
        seed, network, tolerance, effects = pick(
            settings, "seed", "network", "tolerance", "effects"
        )
        scene = Scene(Network.from_settings(network), seed, tolerance, tuple(called(effects)))
        return cls(scene, clouds, occluders, bool(in_all_cells(effects)), empty)

    def of(
        self, row: dict, snr_db: float, station: Station, signal: np.ndarray | None = None
    ) -> Cube:
        """Return the cube of a row of the motion table at a station and an SNR (dB).

        signal: the sample's noisy signal (N,) complex64 at this station, which is what the chosen
        cells then hold; the noise of the other cells has the same power and a stream of its own for
        each subtype, model, station and SNR.
        Raises: InputError naming the sample that cannot be computed.
        """
        clean = self._seen(row, snr_db, station)
        chosen = clean.chosen
        cells = clean.cells.astype(np.complex64)
        if not self.every_cell and not np.isposinf(snr_db):
            key = (row["subtype"], row["model"], station.name, snr_db)
            rng = stream(self.scene.seed, "cells", *key)
            noise = add_noise(np.zeros(cells.shape), snr_db, rng, clean.power_w)
            for filtered in every(self.scene.effects, "filtered").values():
                noise = filtered(noise)
            cells = (clean.cells + noise).astype(np.complex64)
        cells[chosen < 0] = 0
        if signal is not None:
            there = np.flatnonzero(chosen >= 0)
            cells[there, chosen[there]] = signal[there]
        own_truth, *others = clean.truths
        return Cube(cells, chosen, own_truth, tuple(others))

    def sample(self, row: dict, snr_db: float, station: Station) -> SceneSample:
        """Return a row of the motion table as a station of the scene sees it, at an SNR (dB)."""
        scene = self.scene
        if self.every_cell:
            scene = scene.at_snr(snr_db)
        surfaces = self.occluders.get(row["subtype"])
        view = observe(scene, station, cloud_of(self.clouds, row), row, surfaces)
        return SceneSample(scene, view, self.clouds)

    def _seen(self, row: dict, snr_db: float, station: Station) -> _Clean:
        """Return a sample as `_Clean`, computed or kept."""
        key: tuple = (row["subtype"], row["model"], station.name)
        if self.every_cell:
            key = (*key, snr_db)
        if key not in self._clean:
            while len(self._clean) >= self.kept:
                del self._clean[next(iter(self._clean))]
            self._clean[key] = self._computed(row, snr_db, station)
        return self._clean[key]

    def _computed(self, row: dict, snr_db: float, station: Station) -> _Clean:
        """Compute `_seen`."""
        sample = self.sample(row, snr_db, station)
        received = sample.received()
        reflecting = sample
        if self.empty:
            reflecting = sample.without_target()
        seen = reflecting.filtered(sample.detection)
        cells = np.zeros((len(received.cell), seen.shape[1]), np.complex128)
        cells[_received_symbols(sample.view)] = seen
        truths = tuple(true_columns(sample, target) for target in sample.targets)
        return _Clean(cells, received.cell, truths, received.power)


def true_columns(sample: SceneSample, target: View) -> np.ndarray:
    """Return what is true of the middle of a sample's target at each symbol, (N, 7).

    The columns are `spectra.cube.TRUTH`.
    """
    observed_cell, speed_mps = sample.observed(target)
    cells = np.full((len(speed_mps), 2), -1.0)
    of_received = np.column_stack([sample.true_cell(target), observed_cell])
    cells[_received_symbols(target)] = of_received
    return np.column_stack([geometric(target), cells, speed_mps])
