"""Index images at the training size, read from shards one by one or cached for a whole shard.

Decoding and shrinking 256 x 256 images takes longer than a step of a small network, so a cache pays
as soon as two runs share it. Large trainings read the shards directly, with the same pixels. For
sizes to which the tiles stage has reduced its images, the cache is made without decoding.
"""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from lowalt.config.network import Network, station_names
from lowalt.files.errors import InputError
from lowalt.motion import read_table
from lowalt.recognition import samples
from lowalt.recognition.samples import Facts
from lowalt.recognition.schemes import columns_in
from lowalt.shards import ShardSet
from lowalt.shards.sample_list import slug_of
from lowalt.tiles import reduced


def geometry(record: dict, network: Network) -> tuple[list[float], list[float]]:
    """Range (m) and aspect (rad) of a sample at every station.

    Aspect is the angle, seen from above, between the target's front and the direction to the
    station: 0 head-on, pi from behind, NaN without a yaw.
    """
    motion = record["motion"]
    # Without an attitude there is no aspect.
    yaw = math.nan if motion["yaw_rad"] is None else motion["yaw_rad"]
    front = np.array([-math.sin(yaw), math.cos(yaw)])
    ranges = []
    aspects = []
    for station in network.stations:
        distance = record["geometry"][station.name]["range_m"]
        # In a recording the target's position is unknown.
        if distance is None:
            ranges.append(math.nan)
            aspects.append(math.nan)
            continue
        ranges.append(distance)
        towards = np.array(station.position_m[:2]) - [motion["x_m"], motion["y_m"]]
        length = float(np.hypot(*towards))
        cosine = 1.0
        if length:
            cosine = float(front @ towards) / length
        # Without a yaw the cosine is NaN, and so is the aspect.
        aspect = math.nan
        if math.isfinite(cosine):
            aspect = math.acos(max(-1.0, min(1.0, cosine)))
        aspects.append(aspect)
    return ranges, aspects


def facts_of(shards: ShardSet, numbers: np.ndarray, placed: bool = True) -> Facts:
    """Return the metadata of the samples `numbers` from the shards.

    placed: read ranges and aspects from the records too; without it they are NaN and only one
    record of each subtype is read, which is enough for a training on a million samples.
    """
    ends = np.cumsum([shard["samples"] for shard in shards.shards])
    owner = np.searchsorted(ends, numbers, side="right")
    keys = np.array([key.decode() for key in shards.keys[numbers]])
    network = Network.from_settings(shards.index["render"]["network"])
    ranges = np.full((len(numbers), len(network.stations)), math.nan)
    aspects = ranges.copy()
    names: dict[str, str] = {}
    subtypes = []
    for sample, number in enumerate(numbers):
        slug = slug_of(keys[sample])
        if placed or slug not in names:
            record = shards.record(number)
            names[slug] = record["subtype"]
        if placed:
            ranges[sample], aspects[sample] = geometry(record, network)
        subtypes.append(names[slug])
    return Facts(
        key=keys,
        subtype=np.array(subtypes),
        model=shards.models[numbers],
        snr_db=shards.snrs_db[numbers],
        group=np.array([shards.shards[index]["group"] for index in owner]),
        fold=np.array([shards.shards[index]["fold"] for index in owner]),
        label=shards.labels[numbers],
        range_m=ranges,
        aspect_rad=aspects,
    )


@dataclass(frozen=True)
class Reduced:
    """Images of a whole chunk that the tiles stage has reduced, a file of `lowalt.tiles.reduced`.

    motion: the chunk's motion table; snrs_db: the SNRs of every motion model, in the order of the
    chunk's signals.
    """

    path: Path
    motion: Path
    snrs_db: tuple[float, ...]

    def images(self, facts: Facts, size: int) -> np.ndarray:
        """Return the images (len(facts), views, size, size) uint8 of these samples.

        Raises: InputError where the chunk has no such motion model or SNR, or the file does not fit
        them.
        """
        rows = {}
        for number, row in enumerate(read_table(self.motion)):
            rows[row["subtype"], row["model"]] = number
        levels = {snr: number for number, snr in enumerate(self.snrs_db)}
        names = zip(
            facts.subtype.tolist(), facts.model.tolist(), facts.snr_db.tolist(), strict=True
        )
        numbers = []
        try:
            for subtype, model, snr in names:
                numbers.append(rows[subtype, model] * len(levels) + levels[snr])
        except KeyError as error:
            raise InputError(
                f"{self.motion}: no motion model or SNR {error}, expected those of {self.path}"
            ) from None
        images = reduced.read(self.path, size, len(rows) * len(levels))
        return images[np.array(numbers, np.int64)]


def cache_shard(
    index: str | Path, name: str, size: int, out: str | Path, source: Reduced | None = None
) -> int:
    """Write the cache file of the shard `name` and return its number of samples.

    source: images of the shard's chunk at this size, if the tiles stage has made them. Otherwise
    every image of the shard is decoded (or rendered) and reduced, with the same bytes.
    Raises: InputError where the index has no such shard, the size is wrong, or the shard is
    damaged.
    """
    if isinstance(size, bool) or not isinstance(size, int) or size < 8:
        raise InputError(f"settings: size is {size!r}, expected a whole number of pixels >= 8")
    shards = ShardSet(index)
    names = [shard["name"] for shard in shards.shards]
    if name not in names:
        raise InputError(f"{index}: no shard {name!r}, expected one of {names}")
    ends = np.cumsum([shard["samples"] for shard in shards.shards])
    end = ends[names.index(name)]
    count = shards.shards[names.index(name)]["samples"]
    numbers = np.arange(end - count, end)
    # Decoding verifies the images, so skip the check when reading the records.
    facts = facts_of(ShardSet(index, check=False), numbers)
    if source:
        views = source.images(facts, size)
    else:
        views = np.empty((count, len(shards.columns()), size, size), dtype=np.uint8)
        for row, number in enumerate(numbers):
            views[row] = shards.images(number, size)
    samples.write(out, views, facts, shards.spectra)
    return count


class ShardSamples(samples.Samples):
    """Samples read from shards on access; same methods and pixels as `ViewSamples`."""

    def __init__(
        self, index: str | Path, columns: list[int], folds: set, size: int, placed: bool
    ) -> None:
        """Read the facts of the samples in `folds`, which are (group, fold) pairs.

        index: index file of the shards; columns: views to keep, some spectra of some stations;
        size: pixels; placed: whether facts carry ranges and aspects (reads every record).
        Raises: InputError where nothing is left.
        """
        groups = sorted({group for group, _ in folds})
        self.shards = ShardSet(index, groups, sorted({fold for _, fold in folds}))
        self.size = size
        known = station_names(self.shards.index["render"]["network"])
        names = self.shards.spectra
        # Images of a tile are counted station by station.
        images = columns_in(columns, names, len(known), str(index))
        stations = sorted({image // len(names) for image in images})
        spectra = sorted({image % len(names) for image in images})
        self.stations = [known[number] for number in stations]
        self.spectra = [names[number] for number in spectra]
        shards = self.shards.shards
        wanted = np.array([(shard["group"], shard["fold"]) in folds for shard in shards], bool)
        counts = np.array([shard["samples"] for shard in shards], np.int64)
        self.numbers = np.flatnonzero(np.repeat(wanted, counts))
        if not len(self.numbers):
            raise InputError(f"{index}: no samples of {sorted(folds)}")
        self.facts = facts_of(self.shards, self.numbers, placed)

    def keep(self, numbers: np.ndarray) -> None:
        """Drop all samples but those at `numbers`."""
        self.numbers = self.numbers[numbers]
        self.facts = self.facts.take(numbers)

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Index images (len(numbers), columns, size, size) uint8 of the samples `numbers`."""
        chosen = (self.size, self.stations, self.spectra)
        return np.stack([self.shards.images(self.numbers[number], *chosen) for number in numbers])

    def sha256(self) -> str:
        """Return the SHA-256 of all that a training uses of these samples.

        The shards' checksums stand for the images.
        Reading checks the shards against these. The same samples from a cache have another sum.
        """
        render = {
            "size": self.size,
            "stations": self.stations,
            "spectra": self.spectra,
            **self.shards.index["render"],
        }
        sums = sorted(shard["table_sha256"] for shard in self.shards.shards)
        return samples.fingerprint(self.facts, json.dumps([render, sums], sort_keys=True).encode())
