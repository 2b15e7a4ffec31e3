"""The table of the benchmark: a row for each track and method, kept as CSV, and its form in a document.

Methods are sorted by their headline number. Going down, a method belongs to the group of the one that opened the group
unless the interval of their difference excludes zero; otherwise it opens the next group.
"""

from pathlib import Path

import numpy as np

from lowalt.benchmark.benchmark_tracks import TRACKS, Track
from lowalt.benchmark.definition import REFERENCE
from lowalt.benchmark.scoring import Values, difference
from lowalt.files.csv_tables import number, read_csv, write_csv
from lowalt.files.shipped import shipped

TABLE = "table.csv"
COLUMNS = (
    "track", "method", "seeds", "percent", "low", "high", "macro_f1_percent", "macro_f1_low", "macro_f1_high", "group",
    "confirmed_percent", "confirmed_low", "confirmed_high", "train_core_s", "test_core_s_per_1000", "hardware",
)  # fmt: skip


def groups(track: Track, weight: np.ndarray, subtypes: np.ndarray, values: dict[str, np.ndarray]) -> dict[str, int]:
    """Return the number of each method's group, from 1, best methods first.

    weight, subtypes (models,): of the motion models; values: (seeds, models) by method.
    """
    average = {name: float(np.average(array.mean(0), weights=weight)) for name, array in values.items()}
    found: dict[str, int] = {}
    opener, count = "", 0
    for name in sorted(values, key=lambda name: -average[name]):
        lead = difference(track, Values(values[opener], weight, subtypes), values[name]) if opener else None
        if lead is None or lead.low > 0:
            opener, count = name, count + 1
        found[name] = count
    return found


def write(rows: list[dict], folder: str | Path) -> None:
    """Write the table, rows as dicts of COLUMNS, sorted by track and then by percent."""
    order = list(TRACKS)
    rows = sorted(rows, key=lambda row: (order.index(row["track"]), -row["percent"], row["method"]))
    plain = [
        {name: f"{value:.6g}" if isinstance(value, float) else value for name, value in row.items()} for row in rows
    ]
    write_csv(Path(folder) / TABLE, COLUMNS, plain)


def read(folder: str | Path = REFERENCE) -> list[dict]:
    """Return the kept table's rows; numbers as text. Raises: InputError where it is missing or lacks a column."""
    return read_csv(shipped(Path(folder) / TABLE), *COLUMNS, what="table of the benchmark")


def _cell(row: dict | None) -> str:
    """One result: percent with its interval, the group as a letter, a tick where it is confirmed."""
    if row is None:
        return "-"
    value, low, high = (number(row, name, TABLE) for name in ("percent", "low", "high"))
    letter = chr(ord("a") + int(row["group"]) - 1)
    return f"{value:.1f} ({low:.1f} to {high:.1f}) {letter}{' ✓' if row['confirmed_percent'] else ''}"


def _costs(rows: list[dict]) -> tuple[str, str]:
    """Core-seconds of a training and of 1000 samples' inference, the mean over a method's rows that have them."""
    means = []
    for name in ("train_core_s", "test_core_s_per_1000"):
        found = [number(row, name, TABLE) for row in rows if row[name]]
        means.append(
            f"{np.mean(found):.2g}" if found and np.mean(found) < 10 else f"{np.mean(found):.0f}" if found else "-"
        )
    return means[0], means[1]


def markdown(rows: list[dict], tracks: list[str]) -> str:
    """Return the table of these tracks: a line for each method, sorted by the mean over the tracks, best first."""
    by_method: dict[str, dict[str, dict]] = {}
    for row in rows:
        by_method.setdefault(row["method"], {})[row["track"]] = row
    mean = {
        name: np.mean([number(one[track], "percent", TABLE) for track in tracks if track in one] or [0])
        for name, one in by_method.items()
    }
    lines = [f"| method | {' | '.join(tracks)} | training, core-s | 1000 samples, core-s |",
             "|---|" + "---|" * (len(tracks) + 2)]  # fmt: skip
    for name in sorted(by_method, key=lambda name: -mean[name]):
        cells = [_cell(by_method[name].get(track)) for track in tracks]
        lines.append(f"| {name} | {' | '.join(cells)} | {' | '.join(_costs(list(by_method[name].values())))} |")
    return "\n".join(lines)
