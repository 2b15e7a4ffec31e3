"""What is kept of each baseline for paired differences: a value per motion model and seed.

`TRACK.npz` holds an array (seeds, models) per baseline, in the order of the motion models' names:
the numbers of correct samples (uint8), or in the track open-set the values of `scoring.values_of`
(float16). The study `studies/benchmark` writes them.
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
    """Return the values (seeds, models) of a track's kept baselines by name, if it has any.

    Raises: InputError for a file that is damaged.
    """
    path = path_of(track)
    if not path.is_file():
        return {}
    checked_archive(path, "baselines")
    samples_of_model, *_ = models_of(track, *track.samples())
    try:
        with np.load(path, allow_pickle=False) as data:
            found = {name: data[name] for name in data.files}
    except UNREADABLE as error:
        raise InputError(f"{path}: not a file of baselines ({error})") from error
    values = {}
    for name, array in found.items():
        # Correct samples are kept as whole numbers, the values of the track open-set as they are.
        if array.dtype == np.uint8:
            values[name] = array / samples_of_model
        else:
            values[name] = array.astype(float)
    return values


def compared(first: str, second: str) -> dict[str, dict[str, Interval]]:
    """Return {track: {first, second, difference}} of two methods of the table.

    They are in percent with 95 % intervals.
    The difference is paired: both methods answered the same samples. Raises: InputError for an
    unknown method.
    """
    rows = {(row["track"], row["method"]): row for row in baseline_table.read()}
    known = list(dict.fromkeys(method for _, method in rows))
    unknown = [name for name in (first, second) if name not in known]
    if unknown:
        wanted = instead(unknown, known, "one that `lowalt benchmark table` lists")
        raise InputError(
            f"{unknown[0]!r}: neither a folder nor a method of {VERSION}'s table, expected {wanted}"
        )
    found = {}
    for track in TRACKS.values():
        if (track.name, first) not in rows or (track.name, second) not in rows:
            continue
        arrays = kept(track)
        of_first = Values(arrays[first], *models_of(track, *track.samples()))
        found[track.name] = {
            "first": baseline_table.interval(rows[track.name, first]),
            "second": baseline_table.interval(rows[track.name, second]),
            "difference": difference(track, of_first, arrays[second]),
        }
    return found
