"""What the study keeps in results/reference: the table with its groups, and what each method got
right.

Methods are sorted by their headline number. Going down, a method belongs to the group of the one
that opened the group unless the interval of their difference excludes zero; otherwise it opens the
next group.
"""

from itertools import combinations
from pathlib import Path

import numpy as np
from scipy.stats import kendalltau

from lowalt.extensions.benchmark.baseline_table import COLUMNS, TABLE, read
from lowalt.extensions.benchmark.benchmark_tracks import TRACKS, Track
from lowalt.extensions.benchmark.scoring import Values, difference, values_of
from lowalt.files.atomic import replacing
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.recognition.predictions import Predictions


def groups(
    track: Track, weight: np.ndarray, subtypes: np.ndarray, values: dict[str, np.ndarray]
) -> dict[str, int]:
    """Return the number of each method's group, from 1, best methods first.

    weight, subtypes (models,): of the motion models; values: (seeds, models) by method.
    """
    average = {
        name: float(np.average(array.mean(0), weights=weight)) for name, array in values.items()
    }
    found: dict[str, int] = {}
    opener = ""
    count = 0
    for name in sorted(values, key=lambda name: -average[name]):
        lead = (
            difference(track, Values(values[opener], weight, subtypes), values[name])
            if opener
            else None
        )
        if lead is None or lead.low > 0:
            opener = name
            count = count + 1
        found[name] = count
    return found


def alike(rows: list[dict], count: int = 5) -> list[str]:
    """Return a line for each of the `count` pairs of tracks that rank the methods of a table's rows
    most alike.

    Source: Kendall, Biometrika 30, 1938 (tau: 1 for equal orders, 0 for unrelated ones).
    """
    percent: dict[str, dict[str, float]] = {}
    for row in rows:
        percent.setdefault(row["track"], {})[row["method"]] = float(row["percent"])
    pairs = [
        (
            float(
                kendalltau(
                    *(
                        [percent[track][method] for method in percent[first]]
                        for track in (first, second)
                    )
                )[0]
            ),
            f"{first} and {second}",
        )
        for first, second in combinations(percent, 2)
    ]
    return [
        f"order of the methods: {words}, tau {tau:.2f}"
        for tau, words in sorted(pairs, reverse=True)[:count]
    ]


def write_table(rows: list[dict], folder: str | Path) -> None:
    """Write the table, rows as dicts of COLUMNS, sorted by track and then by percent.

    Raises: InputError where a row of the table that is already there is not among them.
    """
    order = list(TRACKS)
    path = Path(folder) / TABLE
    there = {(row["track"], row["method"]) for row in read(folder)} if path.is_file() else set()
    if lost := sorted(there - {(row["track"], row["method"]) for row in rows}):
        raise InputError(
            f"{path}: would lose the rows of {lost[:3]}, {len(lost)} in all; expected a table with"
            " them"
        )
    rows = sorted(rows, key=lambda row: (order.index(row["track"]), -row["percent"], row["method"]))
    plain = [
        {name: f"{value:.6g}" if isinstance(value, float) else value for name, value in row.items()}
        for row in rows
    ]
    write_csv(Path(folder) / TABLE, COLUMNS, plain)


def packed(track: Track, parts: list[Predictions], classes: tuple[str, ...]) -> np.ndarray:
    """Return what is kept of a method: counts (seeds, models) uint8, or values float16; parts: of
    each seed.
    """
    found: Values = values_of(track, parts, classes)
    if track.headline != "accuracy":
        return found.values.astype(np.float16)
    return np.rint(found.values * found.weight).astype(np.uint8)


def unpacked(array: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Return the values (seeds, models) of what is kept of a method, as `packed` returns it."""
    return array / weight if array.dtype == np.uint8 else array.astype(float)


def read_values(track: Track, folder: str | Path) -> dict[str, np.ndarray]:
    """Return what is kept of a track's baselines by their names, as `write_values` wrote it; {}
    without a file.
    """
    path = Path(folder) / f"{track.name}.npz"
    if not path.is_file():
        return {}
    with np.load(path, allow_pickle=False) as data:
        return {name: data[name] for name in data.files}


def write_values(track: Track, arrays: dict[str, np.ndarray], folder: str | Path) -> None:
    """Write the arrays of a track's baselines by their names."""
    with replacing(Path(folder) / f"{track.name}.npz") as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, **arrays)
