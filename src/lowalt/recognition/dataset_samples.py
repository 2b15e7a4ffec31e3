"""Samples for the network, simulated on access (`lowalt.Dataset`), so that no shards are needed.

Order, metadata and pixels equal those of the shards of the same configuration, so a training sees
the same batches.
"""

import hashlib
import json
import math
from dataclasses import fields
from pathlib import Path

import numpy as np

from lowalt.config.classes import label
from lowalt.files.errors import InputError
from lowalt.machine.progress import reported
from lowalt.recognition import samples
from lowalt.recognition.samples import Facts
from lowalt.recognition.schemes import columns_in
from lowalt.recognition.views import geometry
from lowalt.scene.set_noise import in_all_cells
from lowalt.shards.build import rows_of
from lowalt.shards.dataset import Dataset
from lowalt.shards.maker import Maker
from lowalt.shards.sample_list import sample_key
from lowalt.shards.sample_record import record
from lowalt.shards.write import select
from lowalt.spectra import Spectra
from lowalt.spectra.catalogue import named, of_cells
from lowalt.targets.cloud import Cloud
from lowalt.tiles.resample import resize

CLEAN_BYTES = 2**30
"""Memory limit for cached clean echoes (bytes); if a training's motion models need more, only
recent ones are kept.
"""


def opened(config: str | Path) -> Dataset:
    """Return the data set of a run by its config.yaml, with the clouds and surfaces next to it.

    Raises: InputError naming what is missing or wrong.
    """
    from lowalt.targets.occluders import read_all

    folder = Path(config).parent
    surfaces = sorted((folder / "occluders").glob("*.npz"))
    occluders = read_all(surfaces) if surfaces else None
    return Dataset(config, folder / "clouds", occluders=occluders)


def cloud_sha256(cloud: Cloud) -> str:
    """SHA-256 of all arrays of a cloud, in the order of its fields."""
    digest = hashlib.sha256()
    for field in fields(cloud):
        value = getattr(cloud, field.name)
        if isinstance(value, np.ndarray):
            digest.update(np.ascontiguousarray(value).tobytes())
    return digest.hexdigest()


def stations_of(maker: Maker, columns: list[int]) -> list[int] | None:
    """Return the numbers of the stations that the images show; None for all.

    Images of range cells need all stations.
    """
    spectra = Spectra.from_settings(maker.render["spectra"])
    if of_cells(spectra):
        return None
    return sorted({number // len(spectra) for number in columns})


def views_of(
    maker: Maker,
    row: dict,
    snr_db: float,
    columns: list[int],
    size: int,
    stations: list[int] | None = None,
) -> np.ndarray:
    """Return a sample's index images (len(columns), size, size) uint8.

    row: of a motion table, at the SNR snr_db (dB); stations: the stations to compute, as
    `stations_of` returns them; all by default.
    """
    return images_of(maker, row, snr_db, maker.signal(row, snr_db, stations), columns, size)


def images_of(
    maker: Maker, row: dict, snr_db: float, signal: np.ndarray, columns: list[int], size: int
) -> np.ndarray:
    """Return the index images (len(columns), size, size) uint8 of a signal (stations, symbols)."""
    images = maker.renderer.some(signal, columns, maker.late(row), maker.shown(row, snr_db, signal))
    if images.shape[-1] == size:
        return images
    return resize(images, size)


class DatasetSamples(samples.Samples):
    """Samples simulated on access; same methods, order and pixels as `ShardSamples`."""

    def __init__(
        self, dataset: Dataset, columns: list[int], folds: set, size: int, placed: bool
    ) -> None:
        """Take a data set and choose views and folds of it.

        columns: views to keep; folds: (group, fold) pairs; size: pixels; placed: whether facts
        carry ranges and aspects.

        The clean echoes of all motion models are computed here, once, if they fit into CLEAN_BYTES.
        Forked workers inherit them, so that a training step only adds noise and renders images.
        Raises: InputError where nothing is left, or a station or spectrum is missing.
        """
        self.dataset = dataset
        self.size = size
        stations = len(dataset.maker.network.stations)
        self.columns = columns_in(
            columns, named(dataset.maker.render["spectra"]), stations, "dataset"
        )
        self.stations = stations_of(dataset.maker, self.columns)
        self.rows: list[dict] = []
        self.chosen: list[tuple[int, float]] = []
        of_shards = []
        for name in sorted(dataset.plan.shards, key=lambda shard: f"{shard}.tar"):
            group, fold, number = name.split("-")
            if (group, fold) in folds:
                of_shards.append(self._shard(f"{group}-{number}", fold, placed))
        if not self.chosen:
            raise InputError(f"dataset: no samples of {sorted(folds)}")
        self.facts = samples.joined(of_shards)
        self._prepare()

    def _shard(self, chunk: str, fold: str, placed: bool) -> Facts:
        """Note the samples of one shard in its order; return their facts."""
        plan = self.dataset.plan
        network = self.dataset.maker.network
        rows = rows_of(self.dataset, chunk)
        first = len(self.rows)
        levels = plan.chunk(chunk).snrs
        chosen = select(rows, list(levels), plan.split, plan.seed, fold)
        self.rows += rows
        self.chosen += [(first + number, levels[level]) for number, level in chosen]
        models = []
        snrs = []
        keys = []
        ranges = np.full((len(chosen), len(network.stations)), math.nan)
        aspects = ranges.copy()
        for sample, (number, level) in enumerate(chosen):
            row = rows[number]
            snr_db = levels[level]
            models.append(row)
            snrs.append(snr_db)
            keys.append(sample_key(row["subtype"], row["model"], snr_db))
            if placed:
                text = record(row, snr_db, fold, plan.seed, network, self.dataset.classes)
                ranges[sample], aspects[sample] = geometry(json.loads(text), network)
        return Facts(
            key=np.array(keys),
            subtype=np.array([row["subtype"] for row in models]),
            model=np.array([row["model"] for row in models], np.int64),
            snr_db=np.array(snrs, float),
            group=np.array([row["group"] for row in models]),
            fold=np.array([fold] * len(models)),
            label=np.array([label(self.dataset.classes, row) for row in models], np.int64),
            range_m=ranges,
            aspect_rad=aspects,
        )

    def _prepare(self) -> None:
        """Compute the clean echoes of all motion models if they fit into memory."""
        maker = self.dataset.maker
        if in_all_cells(maker.echo["effects"]):
            # The echoes of such a scene hold the noise of one SNR, so other SNRs cannot use them.
            return
        used = sorted({number for number, _ in self.chosen})
        stations = len(maker.network.stations)
        if self.stations is not None:
            stations = len(self.stations)
        echo_bytes = np.dtype(np.complex64).itemsize * stations * maker.network.symbols
        if echo_bytes * len(used) <= CLEAN_BYTES:
            maker.kept = max(maker.kept, len(used))
            for number in reported(used, len(used), "models"):
                maker.received(self.rows[number], stations=self.stations)

    def keep(self, numbers: np.ndarray) -> None:
        """Drop all samples but those at `numbers`."""
        self.chosen = [self.chosen[number] for number in numbers]
        self.facts = self.facts.take(numbers)

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Index images (len(numbers), columns, size, size) uint8 of the samples `numbers`."""
        maker = self.dataset.maker
        images = []
        for number in numbers:
            index, snr_db = self.chosen[number]
            row = self.rows[index]
            images.append(views_of(maker, row, snr_db, self.columns, self.size, self.stations))
        return np.stack(images)

    def sha256(self) -> str:
        """Return the SHA-256 of all that a training uses of these samples.

        Clouds, rows and settings stand for the images.
        The same samples from shards or a cache have another sum.
        """
        maker = self.dataset.maker
        rows = [self.rows[index] for index, _ in self.chosen]
        sums = {}
        for name in sorted({row["subtype"] for row in rows}):
            sums[name] = cloud_sha256(self.dataset.clouds[name])
        rows_sha256 = hashlib.sha256(json.dumps(rows, sort_keys=True).encode()).hexdigest()
        settings = {
            "size": self.size,
            "columns": self.columns,
            "render": maker.render,
            "echo": maker.echo,
        }
        seed = self.dataset.plan.seed
        described = json.dumps([settings, seed, sums, rows_sha256], sort_keys=True)
        return samples.fingerprint(self.facts, described.encode())
