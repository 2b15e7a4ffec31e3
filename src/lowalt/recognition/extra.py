"""Samples of other runs that a training sees in addition to its own: images with measured heights, signals or features.

Samples of two runs may have the same key, so each run's files are read on their own, and its heights are joined to its
images before its samples are joined to others. No sample of another run validates or tests anything.
"""

import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from lowalt.common.array_files import UNREADABLE, checked_archive
from lowalt.common.errors import InputError
from lowalt.recognition.samples import ViewSamples, joined_sources
from lowalt.recognition.schemes import Scheme
from lowalt.recognition.slow_time import SlowTimeSamples
from lowalt.recognition.tracked import Tracked


def by_folder(paths: list[str]) -> list[list[Path]]:
    """Return files in lists, one a folder, in the order of first mention; a folder holds files of one run."""
    found: dict[Path, list[Path]] = {}
    for path in map(Path, paths):
        found.setdefault(path.parent, []).append(path)
    return list(found.values())


def opened(paths: list[str], tracks: list[str] | None, scheme: Scheme, pairs: set[tuple[str, str]]) -> list[Any]:
    """Return the samples of other runs, one source a run, as a scheme sees them; pairs: the (group, fold) to keep.

    paths: cache files of images or signals; tracks: measured heights, the same runs and shards in the same order, for a
    scheme with that cue; None for others.
    Raises: InputError where heights are given to a scheme without the cue or the other way round, a file is no such
    cache, or a file of heights is of other samples than its cache file.
    """
    if (tracks is None) == bool(scheme.cues):
        cue = f"the cue {scheme.cues!r}" if scheme.cues else "no cue"
        raise InputError(f"--extra-tracks: scheme {scheme.name!r} has {cue}")
    runs = by_folder(paths)
    heights = by_folder(tracks) if tracks is not None else [[] for _ in runs]
    if len(heights) != len(runs):
        raise InputError(f"--extra-tracks: files in {len(heights)} folders, expected {len(runs)} as of --extra")
    found = []
    for files, measured in zip(runs, heights, strict=True):
        if scheme.cues:
            _refuse_other_shards(files, measured)
        found.append(_source(files, measured, scheme, pairs))
    return found


def joined(
    own: Any, paths: list[str], tracks: list[str] | None, scheme: Scheme, pairs: set[tuple[str, str]]
) -> Any:  # fmt: skip
    """Return a run's own training samples and, behind them, those of other runs: `with_extra` of each of `opened`.

    Raises: InputError as these two.
    """
    for more in opened(paths, tracks, scheme, pairs):
        own = with_extra(own, more)
    return own


def _source(files: list[Path], measured: list[Path], scheme: Scheme, pairs: set[tuple[str, str]]) -> Any:
    """Return the samples of one run, with the heights of the files `measured` where the scheme has that cue."""
    if scheme.sees != "images":
        return SlowTimeSamples(files, scheme.sees, scheme.columns, pairs)
    images = ViewSamples(files, scheme.columns, pairs)
    return Tracked(images, measured, scheme.stations) if scheme.cues else images


def _refuse_other_shards(files: list[Path], measured: list[Path]) -> None:
    """Raise InputError naming the file of heights that is missing or holds other samples than its cache file."""
    of_shard = {path.name: path for path in measured}
    for path in files:
        if path.name not in of_shard:
            raise InputError(f"--extra-tracks: no {measured[0].parent / path.name}, expected the heights of {path}")
        heights = of_shard.pop(path.name)
        if not np.array_equal(_keys(path, "views"), _keys(heights, "tracks")):
            raise InputError(f"{heights}: other samples than {path}, expected the same in the same order")
    if of_shard:
        raise InputError(f"--extra-tracks: {min(of_shard.values())}, expected no heights without a file of --extra")


def _keys(path: Path, what: str) -> np.ndarray:
    """Return the keys (samples,) of a cache file."""
    checked_archive(path, what)
    try:
        with np.load(path, allow_pickle=False) as data:
            return data["key"]
    except UNREADABLE as error:
        raise InputError(f"{path}: not a {what} file ({error})") from error


def with_extra(own: Any, extra: Any) -> Any:
    """Return a run's own samples and those of another run as one source.

    The numbers of the other's motion models continue after the run's own, so no two motion models have the same number:
    an epoch takes only a few SNRs of each number.
    Raises: InputError where the two differ in kind, in the number of stations, or in size.
    """
    if type(own) is not type(extra):
        raise InputError("--extra: expected --views or --signals as well, caches of the same kind of the run itself")
    if isinstance(own, Tracked):
        found = copy.copy(own)
        found.source = with_extra(own.source, extra.source)
        found.height_m = np.concatenate([own.height_m, extra.height_m])
        return found
    stations = own.facts.range_m.shape[1], extra.facts.range_m.shape[1]
    if stations[0] != stations[1]:
        raise InputError(f"--extra: samples of {stations[1]} stations, expected {stations[0]} as the run's own")
    later = copy.copy(extra)
    later.facts = replace(extra.facts, model=extra.facts.model + 1 + own.facts.model.max())
    return joined_sources(own, later)
