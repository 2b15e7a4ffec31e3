"""Samples for the network: index images with their metadata. A `Samples` is a source of them.

There are three sources: caches of views (`ViewSamples`, here), shards (`views.ShardSamples`), and a
data set that simulates samples on access (`dataset_samples.DatasetSamples`).
`sample_sources.Source` chooses one. No torch here.

A cache file (.npz) holds, for the samples of one shard in its order,
    views    (samples, stations spectra, size, size) uint8, station-major, index images averaged
             over areas
    spectra  names of the spectra, in the order of the tiles
    one array (samples,) for every name of FACTS
"""

import copy
import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from lowalt.files.array_files import UNREADABLE, checked_archive
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.recognition.augment import augment
from lowalt.recognition.schemes import columns_in
from lowalt.spectra.catalogue import LISTED


def motion_names(subtype: np.ndarray, model: np.ndarray) -> np.ndarray:
    """Return the name of each sample's motion model, (samples,) text."""
    return np.char.add(np.char.add(subtype, "/"), model.astype(str))


@dataclass(frozen=True)
class Facts:
    """Metadata of samples, one entry each; range_m and aspect_rad have a column per station."""

    key: np.ndarray
    subtype: np.ndarray
    model: np.ndarray
    snr_db: np.ndarray
    group: np.ndarray
    fold: np.ndarray
    label: np.ndarray
    range_m: np.ndarray
    aspect_rad: np.ndarray

    def __len__(self) -> int:
        return len(self.key)

    @property
    def motion(self) -> np.ndarray:
        """Name of each sample's motion model, (samples,) text."""
        return motion_names(self.subtype, self.model)

    def take(self, numbers: np.ndarray) -> "Facts":
        """Return the facts of the samples `numbers` (indices or a mask)."""
        return Facts(*(getattr(self, name)[numbers] for name in FACTS))


FACTS = tuple(entry.name for entry in fields(Facts))
OF_STATIONS = ("range_m", "aspect_rad")
"""Facts with a column per station."""
KINDS = dict(zip(FACTS, ("U", "U", "iu", "fiu", "U", "U", "iu", "f", "f"), strict=True))
"""Kinds of NumPy types that the facts in a file may have."""


def joined(parts: list[Facts]) -> Facts:
    """Return the facts of several sources one after the other."""
    columns = {}
    for name in FACTS:
        columns[name] = np.concatenate([getattr(part, name) for part in parts])
    return Facts(**columns)


def first_models(facts: Facts, share: float) -> np.ndarray:
    """Sample numbers of the first `share` (0..1) of each subtype's motion models, at least one.

    Models are drawn independently, so the first ones are a random sample. The models of a smaller
    share are a subset of those of a larger one.
    """
    chosen = np.zeros(len(facts), dtype=bool)
    for subtype in np.unique(facts.subtype):
        of_subtype = facts.subtype == subtype
        models = np.unique(facts.model[of_subtype])
        first = models[: max(1, round(share * len(models)))]
        chosen |= of_subtype & np.isin(facts.model, first)
    return np.flatnonzero(chosen)


def statement(facts: Facts) -> list[list]:
    """Return what a model states of its samples: [subtype, fold, number of models], sorted."""
    motion = facts.motion
    found = []
    for subtype in np.unique(facts.subtype).tolist():
        of_subtype = facts.subtype == subtype
        for fold in np.unique(facts.fold[of_subtype]).tolist():
            models = np.unique(motion[of_subtype & (facts.fold == fold)])
            found.append([subtype, fold, len(models)])
    return found


def fingerprint(facts: Facts, *content: bytes | memoryview) -> str:
    """Return the SHA-256 of samples' keys, labels, subtypes, models and SNRs, and of `content`."""
    hasher = hashlib.sha256()
    for name in ("key", "label", "subtype", "model", "snr_db"):
        values = np.ascontiguousarray(getattr(facts, name))
        hasher.update(f"{name} {values.dtype.str} {values.shape}".encode())
        hasher.update(values.tobytes())
    for part in content:
        hasher.update(part)
    return hasher.hexdigest()


class Samples:
    """A source of samples: their `facts`, `size` of images, `views` and the `sha256` of all.

    A training calls `changed`, an evaluation `inputs`. A source whose network takes more than
    images overrides both.
    """

    facts: Facts
    size: int

    def keep(self, numbers: np.ndarray) -> None:
        """Drop all samples but those at `numbers`."""
        raise NotImplementedError

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Index images (len(numbers), columns, size, size) uint8 of the samples `numbers`."""
        raise NotImplementedError

    def sha256(self) -> str:
        """Return the SHA-256 of all that a training sees of these samples."""
        raise NotImplementedError

    def inputs(self, numbers: np.ndarray) -> Any:
        """Return what the network takes of the samples `numbers`: an array, or several by name."""
        return self.views(numbers)

    def changed(
        self, numbers: np.ndarray, columns: list[int], block: dict, generator: np.random.Generator
    ) -> Any:
        """Return `inputs` augmented; columns: numbers of the views; block:
        `recognition.augmentation`.
        """
        return augment(self.views(numbers), columns, block, generator)


class ViewSamples(Samples):
    """Samples held in memory, read from cache files; the scheme's columns only."""

    def __init__(
        self, paths: Sequence[str | Path], columns: list[int], folds: set[tuple[str, str]]
    ) -> None:
        """paths: cache files; columns: views to keep; folds: the (group, fold) pairs to keep.

        Raises: InputError naming a file that is no cache, differs in size, or where nothing is
        left.
        """
        images: list[np.ndarray] = []
        facts = []
        for path in sorted(map(Path, paths)):
            of_file, facts_of_file = _load(path, columns, folds)
            if len(facts_of_file):
                images.append(of_file)
                facts.append(facts_of_file)
        if not images:
            raise InputError(
                f"views: none of the {len(paths)} files has samples of {sorted(folds)}"
            )
        sizes = {array.shape[2:] for array in images}
        if len(sizes) > 1:
            raise InputError(f"views: image sizes {sorted(sizes)}, expected one size")
        # Fill one array in place; np.concatenate would temporarily hold every image twice.
        self.images = np.empty((sum(map(len, images)), *images[0].shape[1:]), dtype=np.uint8)
        start = 0
        images.reverse()
        while images:
            array = images.pop()
            self.images[start : start + len(array)] = array
            start += len(array)
        self.facts = joined(facts)
        self.size = self.images.shape[-1]

    def keep(self, numbers: np.ndarray) -> None:
        """Drop all samples but those at `numbers`."""
        self.images = self.images[numbers]
        self.facts = self.facts.take(numbers)

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Index images (len(numbers), columns, size, size) uint8 of the samples `numbers`."""
        return self.images[numbers]

    def sha256(self) -> str:
        """Return the SHA-256 of what a training sees: images, labels, keys and their order."""
        return fingerprint(self.facts, np.ascontiguousarray(self.images).data)


def joined_sources(first: ViewSamples, second: ViewSamples) -> ViewSamples:
    """Return the samples of two sources as one source.

    Raises: InputError where their images differ in size.
    """
    if first.size != second.size:
        raise InputError(f"samples: sizes {first.size} and {second.size}, expected one size")
    both = copy.copy(first)
    both.images = np.concatenate([first.images, second.images])
    both.facts = joined([first.facts, second.facts])
    return both


def _load(path: Path, columns: list[int], folds: set[tuple[str, str]]) -> tuple[np.ndarray, Facts]:
    """Return the images and facts of those samples of a cache file that are in `folds`.

    Raises: InputError naming a file that is no such cache.
    """
    checked_archive(path, "views")
    try:
        with np.load(path, allow_pickle=False) as data:
            facts = Facts(*(data[name] for name in FACTS))
            if any(
                value.dtype.kind not in KINDS[name]
                or value.ndim != 1 + (name in OF_STATIONS)
                or len(value) != len(facts)
                or (name in OF_STATIONS and value.shape != facts.range_m.shape)
                for name, value in vars(facts).items()
            ):
                raise ValueError("facts of other shapes or types than one of each sample")
            pairs = zip(facts.group.tolist(), facts.fold.tolist(), strict=True)
            wanted = np.array([pair in folds for pair in pairs], dtype=bool)
            if not wanted.any():
                return np.empty(0), facts.take(wanted)
            images = data["views"]
            spectra = data["spectra"].tolist()
    except UNREADABLE as error:
        raise InputError(f"{path}: not a views file ({error})") from error
    stations = facts.range_m.shape[1]
    count = len(spectra) * stations
    if images.ndim != 4 or images.shape[:2] != (len(facts), count) or images.dtype != np.uint8:
        raise InputError(
            f"{path}: views {images.dtype} {images.shape}, expected uint8 ({len(facts)}, {count}, "
            "S, S)"
        )
    return images[wanted][:, columns_in(columns, spectra, stations, str(path))], facts.take(wanted)


def write(
    path: str | Path, views: np.ndarray, facts: Facts, spectra: Sequence[str] = LISTED
) -> None:
    """Write a cache file; equal samples give equal bytes.

    spectra: names in the order of the tiles.
    """
    with replacing(path, views.nbytes) as temporary:
        np.savez(
            temporary,
            views=views,
            spectra=np.array(spectra),
            **{name: getattr(facts, name) for name in FACTS},
        )
