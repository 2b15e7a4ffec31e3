"""What is kept of the baselines: one value per motion model and training seed of each, for paired differences.

`TRACK.npz` holds an array (seeds, models) per baseline, in the order of the motion models' names: the numbers of
correct samples (uint8), or in the track open-set the values of `scoring.values_of` (float16). The study
`studies/benchmark` writes them.
"""

from pathlib import Path

import numpy as np

from lowalt.extensions.benchmark import baseline_table
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS, Track
from lowalt.extensions.benchmark.definition import REFERENCE, VERSION
from lowalt.extensions.benchmark.scoring import Values, difference, models_of
from lowalt.files.array_files import UNREADABLE, checked_archive
from lowalt.files.errors import InputError, instead
from lowalt.files.shipped import shipped
from lowalt.recognition.intervals import Interval


def path_of(track: Track) -> Path:
    """Return the file of a track's baselines."""
    return shipped(Path(REFERENCE) / f"{track.name}.npz")


def kept(track: Track) -> dict[str, np.ndarray]:
    """Return the values (seeds, models) of a track's kept baselines by name; none where the track has none.

    Raises: InputError for a file that is damaged.
    """
    path = path_of(track)
    if not path.is_file():
        return {}
    checked_archive(path, "baselines")
    count = models_of(track, *track.samples())[0]
    try:
        with np.load(path, allow_pickle=False) as data:
            found = {name: data[name] for name in data.files}
    except UNREADABLE as error:
        raise InputError(f"{path}: not a file of baselines ({error})") from error
    return {name: array / count if array.dtype == np.uint8 else array.astype(float) for name, array in found.items()}


def compared(first: str, second: str) -> dict[str, dict[str, Interval]]:
    """Return {track: {first, second, difference}} of two methods of the table, in percent with 95 % intervals.

    The difference is paired: both methods answered the same samples. Raises: InputError for an unknown method.
    """
    rows = {(row["track"], row["method"]): row for row in baseline_table.read()}
    known = list(dict.fromkeys(method for _, method in rows))
    if unknown := [name for name in (first, second) if name not in known]:
        wanted = instead(unknown, known, "one that `lowalt benchmark table` lists")
        raise InputError(f"{unknown[0]!r}: neither a folder nor a method of {VERSION}'s table, expected {wanted}")
    found = {}
    for track in (track for track in TRACKS.values() if {(track.name, first), (track.name, second)} <= set(rows)):
        one, other = (baseline_table.interval(rows[track.name, name]) for name in (first, second))
        arrays = kept(track)
        lead = difference(track, Values(arrays[first], *models_of(track, *track.samples())), arrays[second])
        found[track.name] = {"first": one, "second": other, "difference": lead}
    return found
