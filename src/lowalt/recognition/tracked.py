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

        Raises: InputError naming a file that is no such cache, or a sample without a height.
        """
        self.source, self.size = source, source.size
        known = dict(pair for path in paths for pair in _load(Path(path), stations))
        lacking = [key for key in self.facts.key.tolist() if key not in known]
        if lacking:
            raise InputError(f"--tracks: no height of sample {lacking[0]!r}, expected one of each of the samples")
        self.height_m = np.array([known[key] for key in self.facts.key.tolist()], dtype=np.float32)

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


def _load(path: Path, stations: tuple[int, ...]) -> list[tuple[str, np.ndarray]]:
    """Return the key and the heights (len(stations),) of each sample of a cache file."""
    checked_archive(path, "tracks")
    try:
        with np.load(path, allow_pickle=False) as data:
            keys, heights = data["key"], data["height_m"]
    except UNREADABLE as error:
        raise InputError(f"{path}: not a tracks file ({error})") from error
    if keys.ndim != 1 or heights.ndim != 2 or len(keys) != len(heights) or heights.dtype != np.float64:
        raise InputError(f"{path}: {keys.shape} keys, heights {heights.dtype} {heights.shape}, expected a row of each")
    if max(stations) >= heights.shape[1] or not np.isfinite(heights).all():
        raise InputError(f"{path}: heights of {heights.shape[1]} stations, expected finite ones of {1 + max(stations)}")
    return list(zip(keys.tolist(), heights[:, list(stations)], strict=True))
