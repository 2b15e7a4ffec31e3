"""Samples with the heights that stations measured next to their images, read from cache files of `track.py`."""

import hashlib
from pathlib import Path
from typing import Any

import numpy as np

from lowalt.common.array_files import UNREADABLE, checked_archive
from lowalt.common.errors import InputError
from lowalt.recognition.samples import Facts
from lowalt.recognition.schemes import Scheme


class Tracked:
    """Samples of another source, and next to their images the heights that the scheme's stations measured."""

    def __init__(self, source: Any, paths: list[str | Path], stations: tuple[int, ...]) -> None:
        """source: samples with facts and views; paths: cache files with all of them; stations: numbers to keep.

        Raises: InputError naming a file that is no such cache or is another run's, or a sample without a height.
        """
        self.source, self.size = source, source.size
        self.height_m = _of_samples(self.facts, [Path(path) for path in paths], stations)

    @property
    def facts(self) -> Facts:
        """Known facts of each sample."""
        return self.source.facts

    def keep(self, numbers: np.ndarray) -> None:
        """Drop all samples but those at `numbers`."""
        self.source.keep(numbers)
        self.height_m = self.height_m[numbers]

    def views(self, numbers: np.ndarray) -> np.ndarray:
        """Index images (len(numbers), columns, size, size) uint8 of the samples `numbers`."""
        return self.source.views(numbers)

    def sha256(self) -> str:
        """Return the SHA-256 of all that a training sees of these samples, heights included."""
        return hashlib.sha256(self.source.sha256().encode() + self.height_m.tobytes()).hexdigest()


def with_heights(source: Any, paths: list[str] | None, scheme: Scheme) -> Tracked:
    """Return samples with the heights of a scheme's stations; paths: those of `--tracks`, None where there are none.

    Raises: InputError where files are named and the scheme has no cue, or the other way round; as `Tracked`.
    """
    if paths is None or not scheme.cues:
        raise InputError(
            f"--tracks: scheme {scheme.name!r} has {f'the cue {scheme.cues!r}' if scheme.cues else 'no cue'}"
        )
    return Tracked(source, paths, scheme.stations)


def _of_samples(facts: Facts, paths: list[Path], stations: tuple[int, ...]) -> np.ndarray:
    """Return the heights (samples, len(stations)) float32 (m) of some samples, by their keys, from cache files.

    Raises: InputError for a sample that no file or more than one file has, or whose measured target stood elsewhere.
    """
    parts = [_load(path, stations) for path in paths]
    keys, heights, ranges = (np.concatenate([part[number] for part in parts]) for number in range(3))
    files = np.repeat(np.arange(len(paths)), [len(part[0]) for part in parts])
    order = np.argsort(keys, kind="stable")
    twice = np.flatnonzero(keys[order[1:]] == keys[order[:-1]])
    if len(twice):
        first, second = (paths[files[order[twice[0] + step]]] for step in (0, 1))
        raise InputError(
            f"{second}: sample {str(keys[order[twice[0]]])!r} stands in {first} too, expected files of one run"
        )
    found = order[np.minimum(np.searchsorted(keys, facts.key, sorter=order), len(order) - 1)]
    lacking = np.flatnonzero(keys[found] != facts.key)
    if len(lacking):
        raise InputError(
            f"--tracks: no height of sample {str(facts.key[lacking[0]])!r} in {paths[0]}"
            f"{f' and {len(paths) - 1} more files' if len(paths) > 1 else ''}, expected one of each of the samples"
        )
    # Samples read straight from shards do not say where they stand.
    told = facts.range_m[:, list(stations)]
    moved = np.flatnonzero((np.isfinite(told) & (told != ranges[found])).any(1))
    if len(moved):
        raise InputError(
            f"{paths[files[found[moved[0]]]]}: sample {str(facts.key[moved[0]])!r} at ranges of "
            f"{ranges[found[moved[0]]].tolist()} m, in training at {told[moved[0]].tolist()} m; expected heights of "
            "these samples: make `tracks` of their run again"
        )
    return heights[found].astype(np.float32)


def _load(path: Path, stations: tuple[int, ...]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the keys (samples,), heights and ranges (samples, len(stations)) (m) of a cache file."""
    checked_archive(path, "tracks")
    try:
        with np.load(path, allow_pickle=False) as data:
            keys, heights, ranges = data["key"], data["height_m"], data["range_m"]
    except UNREADABLE as error:
        raise InputError(f"{path}: not a tracks file ({error})") from error
    if keys.ndim != 1 or keys.dtype.kind != "U" or any(
        array.ndim != 2 or len(keys) != len(array) or array.dtype != np.float64 for array in (heights, ranges)
    ):  # fmt: skip
        raise InputError(f"{path}: {keys.shape} keys, heights {heights.dtype} {heights.shape}, ranges {ranges.dtype} "
                         f"{ranges.shape}, expected a row of each")  # fmt: skip
    if heights.shape != ranges.shape or max(stations) >= heights.shape[1] or not np.isfinite(heights).all():
        raise InputError(f"{path}: heights of {heights.shape[1]} stations, expected finite ones of {1 + max(stations)}")
    chosen = list(stations)
    return keys, heights[:, chosen], ranges[:, chosen]
