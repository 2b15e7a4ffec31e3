"""The samples of a track's part as arrays: images and complex signals, read from finished runs."""

from collections.abc import Callable
from functools import cached_property
from pathlib import Path

import numpy as np

from lowalt.config.network import Network
from lowalt.extensions.benchmark.benchmark_tracks import Track, named
from lowalt.extensions.benchmark.definition import MAIN, config_of, overlays, run_name
from lowalt.files.errors import InputError
from lowalt.machine.progress import announced, reported
from lowalt.motion import read_table
from lowalt.recognition.samples import Samples, ViewSamples, fingerprint
from lowalt.recognition.schemes import Scheme
from lowalt.tiles.signals import load_signals

VIEWS = (0, 1, 2)
"""Indices of VRP, TRP and VT among the known spectra."""


def of_unit_power(signals: np.ndarray) -> np.ndarray:
    """Return signals (..., symbols) complex64 divided by the root of their mean power.

    Zeros stay zeros.
    """
    power = np.mean(np.abs(signals).astype(float) ** 2, axis=-1, keepdims=True)
    return (signals / np.sqrt(np.where(power > 0, power, 1))).astype(np.complex64)


def columns_of(track: Track) -> list[int]:
    """Return the numbers of the images that a track shows: VRP, TRP and VT of its stations."""
    return Scheme("all spectra", track.stations, VIEWS).columns


class TrackSamples(Samples):
    """The samples of one part of a track, also a source for trainings of `lowalt.recognition`.

    `key`, `labels` (n,) and `classes`; `images` (n, stations * 3, 24, 24) uint8 index values,
    station by station, each VRP, TRP, VT; `signals` (n, stations, 400) complex64, of mean power one
    at each station.
    """

    def __init__(self, track: Track, part: str, folder: str | Path, split: str = "") -> None:
        """track: which samples; part, split: as in `load`; folder: where the runs' folders are.

        Raises: InputError for another part, or where the data have not been made.
        """
        self.track = track
        source = track.part if part == "test" else MAIN
        self.facts, self.classes = track.samples(part, split)
        self.config = config_of(source)
        self.run = Path(folder) / run_name(source)
        self.size = self.config["recognition"]["size"]
        if not self.run.is_dir():
            raise InputError(
                f"{self.run}: no data, expected those that `lowalt benchmark make --track "
                f"{track.name}` makes ({' and '.join(overlays(source))})"
            )

    def __len__(self) -> int:
        return len(self.facts)

    @property
    def key(self) -> np.ndarray:
        """Keys of the samples, (n,) text."""
        return self.facts.key

    @property
    def labels(self) -> np.ndarray:
        """Labels of the samples, (n,) int64 indices into `classes`."""
        return self.facts.label

    @cached_property
    def images(self) -> np.ndarray:
        """Index images (n, stations * 3, size, size) uint8.

        Raises: InputError where a sample has none.
        """
        pairs = set(zip(self.facts.group.tolist(), self.facts.fold.tolist(), strict=True))
        columns = columns_of(self.track)
        stored = [
            path
            for path in (self.run / f"views/{self.size}").glob("*.npz")
            if tuple(path.stem.split("-")[:2]) in pairs
        ]
        numbers: dict[str, int] = {}
        if stored:
            with announced(f"{self.run}: reading images"):
                found = ViewSamples(stored, columns, pairs)
            numbers = {key: number for number, key in enumerate(found.facts.key.tolist())}
        keys = self.key.tolist()
        for key in keys:
            if key not in numbers:
                raise InputError(
                    f"{self.run}/views: no image of {key}, expected one of every sample; "
                    f"`lowalt benchmark make --track {self.track.name}` makes them"
                )
        return found.images[[numbers[key] for key in keys]]

    @cached_property
    def signals(self) -> np.ndarray:
        """Noisy signals (n, stations, symbols) complex64 of mean power one.

        Raises: InputError where a sample has none.

        The level is taken out because it counts the points of the target's cloud; see
        docs/benchmark-rules.md.
        """
        network = Network.from_settings(self.config["network"])
        return self.of_chunks(lambda path: of_unit_power(load_signals(path, network)))

    def of_chunks(self, values: Callable[[Path], np.ndarray]) -> np.ndarray:
        """Return what `values` computes for samples and the track's stations, (n, stations, ...).

        values: a function from a chunk's noisy signals (.npy) to an array (models, SNRs, stations,
        ...).
        Raises: InputError where a sample has no signal.
        """
        wanted: dict[tuple, list[int]] = {}
        models = zip(self.facts.subtype.tolist(), self.facts.model.tolist(), strict=True)
        for number, model in enumerate(models):
            wanted.setdefault(model, []).append(number)
        levels = {float(snr): index for index, snr in enumerate(self.config["noise"]["snr_db"])}
        level = [levels[snr] for snr in self.facts.snr_db.tolist()]
        result: np.ndarray | None = None
        paths = sorted((self.run / "noisy").glob("*.npy"))
        for path in reported(paths, len(paths), "files"):
            chunk = values(path)
            if result is None:
                shape = (len(self), len(self.track.stations), *chunk.shape[3:])
                result = np.empty(shape, chunk.dtype)
            for row, entry in enumerate(read_table(self.run / f"motion/{path.stem}.csv")):
                for number in wanted.pop((entry["subtype"], entry["model"]), []):
                    result[number] = chunk[row, level[number]][list(self.track.stations)]
        if wanted or result is None:
            raise InputError(
                f"{self.run}/noisy: no signal of {next(iter(wanted))}, expected one of every sample"
            )
        return result

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Index images (len(numbers), columns, size, size) uint8 of the samples `numbers`."""
        return self.images[numbers]

    def sha256(self) -> str:
        """Return the SHA-256 of all that a training on images sees of these samples."""
        return fingerprint(self.facts, np.ascontiguousarray(self.images).data)


def load(
    track: str, part: str = "train", folder: str | Path = "results", split: str = ""
) -> TrackSamples:
    """Return the samples of a track's part, "train", "validation" or "test".

    folder: where the runs' folders are.
    split: in tracks of unseen subtypes the name of an inner split, "inner-1" to "inner-5". One
    subtype of each class is then absent from "train", and "validation" has these subtypes only.
    Raises: InputError for an unknown track, part or split, or where the data have not been made.
    """
    return TrackSamples(named(track), part, folder, split)
