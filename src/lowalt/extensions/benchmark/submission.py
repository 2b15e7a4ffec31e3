"""A submission: a CSV file with `key` and each class's probability for a track's test samples.

Other columns are ignored, so a prediction file of a training is one as it stands. Its rows of other
parts, marked in the column `part`, and rows of samples that the track does not test on are ignored
too.
"""

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lowalt.extensions.benchmark.benchmark_tracks import Track
from lowalt.files.csv_tables import read_csv, write_csv
from lowalt.files.errors import InputError, shown
from lowalt.recognition.predictions import probability_columns

if TYPE_CHECKING:
    from lowalt.extensions.benchmark.part_samples import TrackSamples

TOLERANCE = 1e-3
"""Largest deviation from one of a row's sum."""


def _shares(row: dict, columns: tuple[str, ...], where: str) -> list[float]:
    """The probabilities of a row. Raises: InputError naming what is no probability."""
    values = []
    for name in columns:
        try:
            values.append(float(row[name]))
        except ValueError:
            values.append(math.nan)
        if not 0 <= values[-1] <= 1 + TOLERANCE:
            raise InputError(
                f"{where}: {name} is {shown(row[name])}, expected a number from 0 to 1"
            )
    if round(abs(sum(values) - 1), 6) > TOLERANCE:
        raise InputError(
            f"{where}: the probabilities sum to {sum(values):.6g}, expected 1 within {TOLERANCE:g}"
        )
    return values


def read(path: str | Path, track: Track) -> np.ndarray:
    """Return the probabilities (samples, classes) of a submission, in the order of the track.

    Raises: InputError in one sentence for a missing column, a value that is no probability, a row
    that does not sum to one, and a key that is unknown, stands twice, or is missing.
    """
    tested = track.samples().facts.key.tolist()
    facts, classes = track.truth()
    columns = probability_columns(classes)
    known = set(facts.key.tolist())
    found = {}
    for line, row in enumerate(read_csv(path, "key", *columns, what="submission"), start=2):
        key = row["key"]
        where = f"{path} line {line}"
        if row.get("part", "test") != "test":
            continue
        if key not in known:
            raise InputError(
                f"{where}: key {shown(key)} is no sample of the track {track.name}, such as "
                f"{tested[0]}"
            )
        if key in found:
            raise InputError(f"{where}: key {key} stands twice, expected one row per sample")
        found[key] = _shares(row, columns, where)
    missing = [key for key in tested if key not in found]
    if missing:
        raise InputError(
            f"{path}: {len(missing)} of the {len(tested)} test samples of the track {track.name} "
            f"are missing, the first is {missing[0]}"
        )
    return np.array([found[key] for key in tested])


def write(path: str | Path, samples: "TrackSamples", probabilities: np.ndarray) -> None:
    """Write a submission.

    probabilities: (n, classes), in the order of the samples and of their classes.
    Raises: InputError for another shape, and for a row that `read` would refuse, such as one of
    logits.
    """
    checked(probabilities, samples.key, samples.classes)
    rows = []
    for key, shares in zip(
        samples.key.tolist(), np.asarray(probabilities, float).tolist(), strict=True
    ):
        rows.append([key, *(f"{share:.6f}" for share in shares)])
    write_csv(path, ("key", *probability_columns(samples.classes)), rows)


def checked(probabilities: np.ndarray, keys: np.ndarray, classes: tuple[str, ...]) -> None:
    """Refuse probabilities (n, classes) that are none; keys (n,): of the samples that they answer.

    Raises: InputError for another shape, a value that is no probability, and a row that does not
    sum to one.
    """
    wanted = (len(keys), len(classes))
    if np.shape(probabilities) != wanted:
        raise InputError(f"probabilities: shape {np.shape(probabilities)}, expected {wanted}")
    columns = probability_columns(classes)
    for key, values in zip(keys.tolist(), np.asarray(probabilities, float).tolist(), strict=True):
        _shares(dict(zip(columns, values, strict=True)), columns, f"row {key}")
