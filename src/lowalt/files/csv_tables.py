"""Reads and writes tables as CSV files; all tables are written here. Cells are read as text.

Lines end with a single newline on every system, and equal rows give equal bytes.
"""

import csv
import math
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

from lowalt.files.atomic import replacing, text_file
from lowalt.files.errors import InputError, shown

MOST_COLUMNS = 10_000
MOST_CELLS = 10_000_000
"""Largest numbers of columns and cells of a table; a cell takes some hundred bytes of memory."""

COMPRESSED = {"gzip": b"\x1f\x8b", "zip": b"PK\x03\x04"}
"""First bytes of compressed files."""


def read_csv(path: str | Path, *needed: str, what: str = "table") -> list[dict[str, str]]:
    """Return a CSV file's rows as dicts of text; what: the file in words, for errors.

    Raises: InputError naming the file and the columns that it lacks or has twice, the line whose
    number of cells differs, a compressed file, one whose cells are separated by semicolons, and one
    of more than MOST_COLUMNS or MOST_CELLS.
    """
    _refuse_compressed(path, what)
    with text_file(path, what) as file:
        reader = csv.reader(file)
        columns = next(reader, [])
        if len(columns) == 1 and ";" in columns[0]:
            raise InputError(
                f"{path}: cells are separated by semicolons, expected commas and points in numbers"
            )
        if len(columns) > MOST_COLUMNS:
            raise InputError(
                f"{path}: {len(columns)} columns, expected a {what} of at most {MOST_COLUMNS}"
            )
        if twice := sorted(name for name, count in Counter(columns).items() if count > 1):
            raise InputError(
                f"{path}: column {shown(twice[0])} stands twice, expected every column once"
            )
        missing = set(needed) - set(columns)
        if missing:
            raise InputError(f"{path}: lacks the columns {sorted(missing)}, has {columns}")
        rows = []
        for cells in filter(None, reader):
            if len(cells) != len(columns):
                raise InputError(
                    f"{path} line {reader.line_num}: {len(cells)} cells, expected {len(columns)}"
                )
            rows.append(dict(zip(columns, cells, strict=True)))
            if len(rows) * len(columns) > MOST_CELLS:
                raise InputError(f"{path}: expected a {what} of at most {MOST_CELLS} cells")
        return rows


def _refuse_compressed(path: str | Path, what: str) -> None:
    """Refuse a file that gzip or zip has compressed. Raises: InputError naming it."""
    if not Path(path).is_file():
        return
    with Path(path).open("rb") as file:
        begins = file.read(4)
    for name, mark in COMPRESSED.items():
        if begins.startswith(mark):
            raise InputError(
                f"{path}: {what} is compressed ({name}), expected plain text; unpack it first"
            )


def number(row: Mapping[str, str], column: str, path: str | Path) -> float:
    """Return a cell of a table of texts as a finite number.

    Raises: InputError naming the file, column and cell.
    """
    try:
        value = float(row[column])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"{path}: {column} is {shown(row[column])}, expected a number")
    return value


def write_csv(path: str | Path, columns: Sequence[str], rows: Iterable[Mapping | Sequence]) -> None:
    """Write a header of `columns` and the rows: sequences of cells, or dicts by column.

    A key that a dict lacks becomes an empty cell. Cells are written by `str`, None as an empty
    cell. The file appears only when it is complete.
    Raises: InputError naming the file and the keys of a dict that are no columns.
    """
    with replacing(path) as temporary, temporary.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        for row in rows:
            if isinstance(row, Mapping):
                row = _cells(path, columns, row)
            writer.writerow(row)


def _cells(path: str | Path, columns: Sequence[str], row: Mapping) -> list:
    """Cells of a row given as a dict, in the order of the columns."""
    unknown = [key for key in row if key not in columns]
    if unknown:
        raise InputError(f"{path}: keys {unknown}, expected only the columns {list(columns)}")
    return [row.get(name, "") for name in columns]


def short(value: object) -> object:
    """Return a float as text with six digits, None as an empty cell, and anything else as it is."""
    if value is None:
        return ""
    return f"{value:.6g}" if isinstance(value, float) else value
