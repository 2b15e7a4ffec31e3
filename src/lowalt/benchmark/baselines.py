"""What is kept of the baselines: one value per motion model and training seed of each, for paired differences.

`TRACK.npz` holds an array (seeds, models) per baseline, in the order of the motion models' names: the numbers of
correct samples (uint8), or in the track open-set the values of `scoring.values_of` (float16).
"""

from pathlib import Path

import numpy as np

from lowalt.benchmark.benchmark_tracks import Track
from lowalt.benchmark.definition import REFERENCE
from lowalt.benchmark.scoring import Values, values_of
from lowalt.files.array_files import UNREADABLE, checked_archive
from lowalt.files.atomic import replacing
from lowalt.files.errors import InputError
from lowalt.files.shipped import shipped
from lowalt.recognition.intervals import model_shares
from lowalt.recognition.predictions import Predictions


def path_of(track: Track, folder: str | Path = REFERENCE) -> Path:
    """Return the file of a track's baselines."""
    return shipped(Path(folder) / f"{track.name}.npz")


def samples_per_model(track: Track) -> np.ndarray:
    """Return the number of test samples of each motion model, (models,), in the order of the models' names."""
    facts = track.truth().facts.take(track.numbers("test"))
    motion = np.char.add(np.char.add(facts.subtype, "/"), facts.model.astype(str))
    return model_shares(motion, [np.zeros(len(facts))])[1]


def packed(track: Track, parts: list[Predictions], classes: tuple[str, ...]) -> np.ndarray:
    """Return what is kept of a method: counts (seeds, models) uint8, or values float16; parts: of each seed."""
    found: Values = values_of(track, parts, classes)
    if track.headline != "accuracy":
        return found.values.astype(np.float16)
    return np.rint(found.values * found.weight).astype(np.uint8)


def write(track: Track, arrays: dict[str, np.ndarray], folder: str | Path) -> None:
    """Write the arrays of a track's baselines by their names."""
    with replacing(Path(folder) / f"{track.name}.npz") as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)


def kept(track: Track) -> dict[str, np.ndarray]:
    """Return the values (seeds, models) of a track's kept baselines by name; none where the track has none.

    Raises: InputError for a file that is damaged.
    """
    path = path_of(track)
    if not path.is_file():
        return {}
    checked_archive(path, "baselines")
    count = samples_per_model(track)
    try:
        with np.load(path, allow_pickle=False) as data:
            found = {name: data[name] for name in data.files}
    except UNREADABLE as error:
        raise InputError(f"{path}: not a file of baselines ({error})") from error
    return {name: array / count if array.dtype == np.uint8 else array.astype(float) for name, array in found.items()}
