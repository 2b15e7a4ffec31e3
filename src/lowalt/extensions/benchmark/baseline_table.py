"""The table of the benchmark, a row per track and method, as CSV and as documents show it."""

import string
from pathlib import Path

import numpy as np

from lowalt.extensions.benchmark.definition import REFERENCE
from lowalt.files.csv_tables import number, read_csv
from lowalt.files.shipped import shipped
from lowalt.recognition.intervals import Interval

TABLE = "table.csv"
SHOWN = (
    ("seen", "unseen", "one-station", "few-shot-1", "few-shot-5", "few-shot-20"),
    ("forty", "open-set", "low-snr", "clutter", "fr2"),
)
"""Tracks of the tables of a document, side by side."""
CONFIRMED = ("confirmed_percent", "confirmed_low", "confirmed_high", "confirmed_sha256")
"""Columns of a confirmed result: accuracy with its interval, and the checksum of what was
confirmed.
"""
HARDEST = ("EH 216 S", "Sparrow")
"""The unseen subtypes on which most errors of every method fall."""
BY_SUBTYPE = ("median_percent", "others_percent")
"""Columns of tracks of unseen subtypes: the median accuracy over subtypes, and the accuracy without
HARDEST.
"""
DECIDES = ("unseen, median subtype", f"unseen without {' and '.join(HARDEST)}")
"""Heads of the columns BY_SUBTYPE of the track `unseen`."""
RESULT = (
    "track",
    "method",
    "seeds",
    "chosen_on",
    "percent",
    "low",
    "high",
    *BY_SUBTYPE,
    "macro_f1_percent",
)
"""Columns of a method's result on a track, of a baseline as of a submission."""
COLUMNS = (
    *RESULT,
    "macro_f1_low",
    "macro_f1_high",
    "group",
    *CONFIRMED,
    "train_core_s",
    "test_core_s_per_1000",
    "hardware",
)


def read(folder: str | Path = REFERENCE) -> list[dict]:
    """Return the kept table's rows; numbers as text.

    Raises: InputError where it is missing or lacks a column.
    """
    return read_csv(shipped(Path(folder) / TABLE), *COLUMNS, what="table of the benchmark")


def interval(row: dict) -> Interval:
    """Return a row's headline number with its interval.

    Raises: InputError where a cell is no number.
    """
    return Interval(*(number(row, name, TABLE) for name in ("percent", "low", "high")))


def words(found: Interval) -> str:
    """Return a value with its interval as text, one digit each."""
    return f"{found.value:.1f} ({found.low:.1f} to {found.high:.1f})"


def result(row: dict) -> str:
    """Return a row's result as text: percent with its interval, the group as a letter.

    A tick follows where the result is confirmed.
    """
    group = string.ascii_lowercase[int(row["group"]) - 1]
    tick = " ✓" if row["confirmed_percent"] else ""
    return f"{words(interval(row))} {group}{tick}"


def by_subtype(values: np.ndarray, weight: np.ndarray, subtypes: np.ndarray) -> dict[str, float]:
    """Return the columns BY_SUBTYPE in percent.

    values (seeds, models): shares of correct samples; weight, subtypes (models,): of the motion
    models.
    """
    shares = values.mean(0)
    accuracy = []
    for name in np.unique(subtypes):
        accuracy.append(np.average(shares[subtypes == name], weights=weight[subtypes == name]))
    others = ~np.isin(subtypes, HARDEST)
    found = {"median_percent": 100 * float(np.median(accuracy))}
    if others.any():
        found["others_percent"] = 100 * float(np.average(shares[others], weights=weight[others]))
    return found


def _mean(rows: list[dict], column: str) -> str:
    """The mean of a column of core-seconds with two digits, over the rows that have it.

    It is a dash where none has.
    """
    found = [number(row, column, TABLE) for row in rows if row[column]]
    if not found:
        return "-"
    mean = np.mean(found)
    return f"{mean:.2g}" if mean < 10 else f"{mean:.0f}"


def _digit(cell: str | None) -> str:
    """A number of the table with one digit; a dash where there is none."""
    if not cell:
        return "-"
    return f"{float(cell):.1f}"


def tables(rows: list[dict]) -> list[list[tuple[str, ...]]]:
    """Return the rows as tables of texts, one for each of SHOWN.

    A table has the names of its columns, then a line for each method.
    Methods are sorted by the mean over a table's tracks, best first; costs are means over all
    tracks. After `unseen` stand its columns BY_SUBTYPE.
    """
    by_method: dict[str, dict[str, dict]] = {}
    for row in rows:
        by_method.setdefault(row["method"], {})[row["track"]] = row
    with_rows = {row["track"] for row in rows}
    found = []
    for shown in SHOWN:
        tracks = [track for track in shown if track in with_rows]
        if tracks:
            found.append(_table(tracks, by_method))
    return found


def _table(tracks: list[str], by_method: dict[str, dict[str, dict]]) -> list[tuple[str, ...]]:
    """One table of texts; by_method: the rows of each method by track."""
    heads = ["method"]
    for track in tracks:
        heads.append(track)
        if track == "unseen":
            heads += DECIDES
    heads += ["chosen on", "seeds", "training, core-s", "1000 samples, core-s"]

    def worse(name: str) -> float:
        """Minus the mean percent of a method over the tracks that it has."""
        own = by_method[name]
        percents = [number(own[track], "percent", TABLE) for track in tracks if track in own]
        return -float(np.mean(percents or [0]))

    lines: list[tuple[str, ...]] = [tuple(heads)]
    for name in sorted(by_method, key=worse):
        own = by_method[name]
        cells = [name]
        for track in tracks:
            cells.append(result(own[track]) if track in own else "-")
            if track == "unseen":
                cells += [_digit(own.get(track, {}).get(column)) for column in BY_SUBTYPE]
        cells.append(next(iter(own.values()))["chosen_on"])
        seeds = sorted({row["seeds"] for row in own.values()})
        cells.append(" to ".join(dict.fromkeys((seeds[0], seeds[-1]))))
        cells.append(_mean(list(own.values()), "train_core_s"))
        cells.append(_mean(list(own.values()), "test_core_s_per_1000"))
        lines.append(tuple(cells))
    return lines
