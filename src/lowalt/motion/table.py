"""The motion table: one row per motion model, a CSV file that is read back exactly."""

import csv
import math
from collections.abc import Collection
from pathlib import Path

from lowalt.config.classes import refuse_subtype
from lowalt.files.atomic import text_file
from lowalt.files.csv_tables import write_csv
from lowalt.files.errors import InputError
from lowalt.targets.cloud import MOST_TURNING_PARTS

PHASES = MOST_TURNING_PARTS
"""Columns for phases: one each for the most turning parts that a cloud may have."""

TEXTS = ("subtype", "category", "group")
NUMBERS = (
    "x_m",
    "y_m",
    "z_m",
    "vx_mps",
    "vy_mps",
    "vz_mps",
    "yaw_rad",
    "pitch_rad",
    "roll_rad",
    "rate_hz",
    *(f"phase_{index}_rad" for index in range(PHASES)),
    "start_s",
    "playback",
)
COLUMNS = (*TEXTS, "model", *NUMBERS)
TRACK = ("track", "look")
PATH = ("ax_mps2", "ay_mps2", "az_mps2", "jx_mps3", "jy_mps3", "jz_mps3", "turn_radps")
"""Further columns of tables with tracks.

They are the number of the track in its subtype and of the look in its track; acceleration at the
first symbol, its rate of change (jerk), and heading rate.
"""
SCALE = "scale"
"""A further column of tables with random sizes: size of the target relative to its cloud."""


def write_table(path: str | Path, rows: list[dict]) -> None:
    """Write rows (one dict per motion model, NaN where a column does not apply) as CSV.

    Equal rows give equal bytes. Rows of targets with random sizes have the key SCALE, those of
    tracks the keys TRACK and PATH.
    """
    further: tuple[str, ...] = ()
    if rows:
        further = _further(rows[0])
    numbers = (*NUMBERS, *further)
    write_csv(path, (*COLUMNS, *further), (_cells(row, numbers) for row in rows))


def _further(names: Collection[str]) -> tuple[str, ...]:
    """The columns after COLUMNS of a table that has these names."""
    columns: tuple[str, ...] = ()
    if SCALE in names:
        columns += (SCALE,)
    if TRACK[0] in names:
        columns += (*TRACK, *PATH)
    return columns


def _cells(row: dict, names: tuple[str, ...]) -> list:
    """Return the cells of a row: texts, the model's number, then numbers, empty where NaN."""
    cells = [*(row[name] for name in TEXTS), int(row["model"])]
    for name in names:
        if name in TRACK:
            cells.append(int(row[name]))
        elif math.isnan(row[name]):
            cells.append("")
        else:
            cells.append(repr(float(row[name])))  # Its shortest text that is read back exactly.
    return cells


def read_table(path: str | Path) -> list[dict]:
    """Read a motion table: dicts of floats, NaN where a cell is empty.

    `model`, `track` and `look` are ints, the columns TEXTS are strings.
    Raises: InputError naming the file, line and column that is wrong.
    """
    with text_file(path, "motion table") as file:
        reader = csv.reader(file)
        header = tuple(next(reader, ()))
        if header != (*COLUMNS, *_further(header)):
            raise InputError(
                f"{path}: columns {sorted(set(header) ^ set(COLUMNS))} missing, unknown or out of "
                "order"
            )
        return [_row(path, line, header, cells) for line, cells in enumerate(reader, start=2)]


def _row(path: str | Path, line: int, header: tuple[str, ...], cells: list[str]) -> dict:
    """Return a row from the cells of one line. Raises: InputError naming file, line and column."""
    if len(cells) != len(header):
        raise InputError(f"{path}, line {line}: {len(cells)} cells, expected {len(header)}")
    row: dict = dict(zip(header, cells, strict=True))
    refuse_subtype(row["subtype"], f"{path}, line {line}")
    for name in header[len(TEXTS) :]:
        text = row[name]
        try:
            if name in ("model", *TRACK):
                row[name] = int(text)
            else:
                row[name] = float(text) if text else math.nan
            infinite = math.isinf(row[name])
        except (ValueError, OverflowError):
            raise InputError(
                f"{path}, line {line}, column {name}: {text!r}, expected a number"
            ) from None
        if infinite:
            raise InputError(
                f"{path}, line {line}, column {name}: {text!r}, expected a finite number"
            )
    if SCALE in row and not row[SCALE] > 0:
        raise InputError(
            f"{path}, line {line}, column {SCALE}: {row[SCALE]}, expected a positive number"
        )
    return row
