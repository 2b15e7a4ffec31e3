"""Tables of the study: measured-NAME.csv, with floats of five significant digits."""

import math
from pathlib import Path

from lowalt.files.csv_tables import write_csv


def write_measured(folder: Path, name: str, columns: tuple[str, ...], rows: list[list]) -> None:
    """Write rows as measured-NAME.csv into a folder; NaN becomes an empty cell."""
    cells = ([_cell(value) for value in row] for row in rows)
    write_csv(folder / f"measured-{name}.csv", columns, cells)


def _cell(value: object) -> object:
    """A cell of a table."""
    if isinstance(value, float):
        return "" if math.isnan(value) else f"{value:.5g}"
    return value
