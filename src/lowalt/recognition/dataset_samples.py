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
    """Return the data set of a run by its config.yaml, with the clouds and surfaces that stand next
    to it.

    Raises: InputError naming what is missing or wrong.
    """
    from lowalt.targets.occluders import read_all

    folder = Path(config).parent
    surfaces = sorted((folder / "occluders").glob("*.npz"))
    return Dataset(config, folder / "clouds", occluders=read_all(surfaces) if surfaces else None)


def cloud_sha256(cloud: Cloud) -> str:
    """SHA-256 of all arrays of a cloud, in the order of its fields."""
    digest = hashlib.sha256()
    for field in fields(cloud):
        value = getattr(cloud, field.name)
        if isinstance(value, np.ndarray):
            digest.update(np.ascontiguousarray(value).tobytes())
    return digest.hexdigest()


def stations_of(maker: Maker, columns: list[int]) -> list[int] | None:
    """Return the numbers of the stations that the images show; None (all) where they show range
    cells.
    """
    spectra = Spectra.from_settings(maker.render["spectra"])
    shown = sorted({number // len(spectra) for number in columns})
    return None if of_cells(spectra) else shown


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
    """Return the index images (len(columns), size, size) uint8 of a sample's signal (stations,
    symbols).
    """
    images = maker.renderer.some(signal, columns, maker.late(row), maker.shown(row, snr_db, signal))
    return images if images.shape[-1] == size else resize(images, size)


class DatasetSamples(samples.Samples):
    """Samples simulated on access; same methods, order and pixels as `ShardSamples`."""

    def __init__(
        self, dataset: Dataset, columns: list[int], folds: set, size: int, placed: bool
    ) -> None:
        """columns: views to keep; folds: (group, fold) pairs; size: pixels; placed: whether facts
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
        self.rows = []
        self.chosen = []
        parts = []
        for name in sorted(dataset.plan.shards, key=lambda shard: f"{shard}.tar"):
            group, fold, part = name.split("-")
            if (group, fold) in folds:
                parts.append(self._shard(f"{group}-{part}", fold, placed))
        if not self.chosen:
            raise InputError(f"dataset: no samples of {sorted(folds)}")
        self.facts = samples.joined(parts)
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
        blank = [math.nan] * len(network.stations)
        places = []
        for number, level in chosen if placed else ():
            entry = json.loads(
                record(rows[number], levels[level], fold, plan.seed, network, self.dataset.classes)
            )
            places.append(geometry(entry, network))
        places = places or [(blank, blank)] * len(chosen)
        models = [rows[number] for number, _ in chosen]
        snrs = [levels[level] for _, level in chosen]
        keys = [
            sample_key(row["subtype"], row["model"], snr)
            for row, snr in zip(models, snrs, strict=True)
        ]
        return Facts(
            key=np.array(keys),
            subtype=np.array([row["subtype"] for row in models]),
            model=np.array([row["model"] for row in models], np.int64),
            snr_db=np.array(snrs, float),
            group=np.array([row["group"] for row in models]),
            fold=np.array([fold] * len(models)),
            label=np.array([label(self.dataset.classes, row) for row in models], np.int64),
            range_m=np.array([place[0] for place in places]).reshape(len(models), -1),
            aspect_rad=np.array([place[1] for place in places]).reshape(len(models), -1),
        )

    def _prepare(self) -> None:
        """Compute the clean echoes of all motion models if they fit into memory."""
        maker = self.dataset.maker
        if in_all_cells(maker.echo["effects"]):
            # The echoes of such a scene hold the noise of one SNR, so other SNRs cannot use them.
            return
        used = sorted({number for number, _ in self.chosen})
        heard = len(maker.network.stations if self.stations is None else self.stations)
        if 8 * heard * maker.network.symbols * len(used) <= CLEAN_BYTES:
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
            place, snr_db = self.chosen[number]
            images.append(
                views_of(maker, self.rows[place], snr_db, self.columns, self.size, self.stations)
            )
        return np.stack(images)

    def sha256(self) -> str:
        """Return the SHA-256 of all that a training uses of these samples: clouds, rows and
        settings instead of images.

        The same samples from shards or a cache have another sum.
        """
        maker = self.dataset.maker
        subtypes = sorted({self.rows[place]["subtype"] for place, _ in self.chosen})
        clouds = {name: self.dataset.clouds[name] for name in subtypes}
        sums = {name: cloud_sha256(cloud) for name, cloud in clouds.items()}
        rows = hashlib.sha256(
            json.dumps([self.rows[place] for place, _ in self.chosen], sort_keys=True).encode()
        )
        settings = {
            "size": self.size,
            "columns": self.columns,
            "render": maker.render,
            "echo": maker.echo,
        }
        described = json.dumps(
            [settings, self.dataset.plan.seed, sums, rows.hexdigest()], sort_keys=True
        )
        return samples.fingerprint(self.facts, described.encode())
