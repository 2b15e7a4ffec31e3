"""The table of the benchmark: a row for each track and method, kept as CSV, and its form in documents and reports."""

from pathlib import Path

import numpy as np

from lowalt.extensions.benchmark.definition import REFERENCE
from lowalt.files.csv_tables import number, read_csv
from lowalt.files.shipped import shipped
from lowalt.recognition.intervals import Interval

TABLE = "table.csv"
SHOWN = (("seen", "unseen", "one-station", "few-shot-1", "few-shot-5", "few-shot-20"),
         ("forty", "open-set", "low-snr", "town", "fr2"))  # fmt: skip
"""Tracks of the tables of a document, side by side."""
COLUMNS = (
    "track", "method", "seeds", "percent", "low", "high", "macro_f1_percent", "macro_f1_low", "macro_f1_high", "group",
    "confirmed_percent", "confirmed_low", "confirmed_high", "train_core_s", "test_core_s_per_1000", "hardware",
)  # fmt: skip


def read(folder: str | Path = REFERENCE) -> list[dict]:
    """Return the kept table's rows; numbers as text. Raises: InputError where it is missing or lacks a column."""
    return read_csv(shipped(Path(folder) / TABLE), *COLUMNS, what="table of the benchmark")


def interval(row: dict) -> Interval:
    """Return a row's headline number with its interval. Raises: InputError where a cell is no number."""
    return Interval(*(number(row, name, TABLE) for name in ("percent", "low", "high")))


def words(found: Interval) -> str:
    """Return a value with its interval as text, one digit each."""
    return f"{found.value:.1f} ({found.low:.1f} to {found.high:.1f})"


def result(row: dict) -> str:
    """Return a row's result as text: percent with its interval, the group as a letter, a tick where it is confirmed."""
    return f"{words(interval(row))} {chr(ord('a') + int(row['group']) - 1)}{' ✓' if row['confirmed_percent'] else ''}"


def _mean(rows: list[dict], column: str) -> str:
    """The mean of a column of core-seconds with two digits, over the rows that have it; a dash where none has."""
    found = [number(row, column, TABLE) for row in rows if row[column]]
    return "-" if not found else f"{np.mean(found):.2g}" if np.mean(found) < 10 else f"{np.mean(found):.0f}"


def tables(rows: list[dict]) -> list[list[tuple[str, ...]]]:
    """Return the rows as tables of texts, one for each of SHOWN: names of columns, then a line for each method.

    Methods are sorted by the mean over a table's tracks, best first; costs are means over all tracks.
    """
    by_method: dict[str, dict[str, dict]] = {}
    for row in rows:
        by_method.setdefault(row["method"], {})[row["track"]] = row
    found = []
    for tracks in ([track for track in shown if any(track in one for one in by_method.values())] for shown in SHOWN):
        percents = {name: [number(one[track], "percent", TABLE) for track in tracks if track in one]
                    for name, one in by_method.items()}  # fmt: skip
        lines = [("method", *tracks, "seeds", "training, core-s", "1000 samples, core-s")]
        for name in sorted(by_method, key=lambda name: -np.mean(percents[name] or [0])):
            own = by_method[name]
            results = (result(own[track]) if track in own else "-" for track in tracks)
            seeds = sorted({row["seeds"] for row in own.values()})
            counts = " to ".join(dict.fromkeys((seeds[0], seeds[-1])))
            costs = (_mean(list(own.values()), column) for column in ("train_core_s", "test_core_s_per_1000"))
            lines.append((name, *results, counts, *costs))
        found += [lines] if tracks else []
    return found
