"""Dimension table: every figure of the built-in models with its source or the mark "estimate", as CSV."""

import argparse
from pathlib import Path

from lowalt.config.command import run
from lowalt.files.csv_tables import write_csv
from lowalt.targets.records import load_records

COLUMNS = ("subtype", "category", "figure", "value", "unit", "source")
SIZES = {"size_m": "size", "len_m": "length", "wid_m": "width", "hgt_m": "height", "wheel_diam_m": "wheel_diameter"}
"""Columns of sizes (m) in the table of targets, and the figures' names."""
RATES = {
    "freq_lo_hz": ("lowest rate", "Hz"), "freq_hi_hz": ("highest rate", "Hz"),
    "vx_abs_max": ("highest speed along x", "m/s"), "vy_abs_max": ("highest speed along y", "m/s"),
    "vz_abs_max": ("highest vertical speed", "m/s"), "speed_lo": ("lowest speed", "m/s"),
    "speed_hi": ("highest speed", "m/s"),
}  # fmt: skip
"""Columns for which a row of one's own has a source each; those of published rows are all published."""


def own_cells(record: dict) -> list[tuple[str, float, str, str]]:
    """Return name, value, unit and source of the sizes, rates and speeds in a merged record's own row.

    A published row gives none, nor does a record without a row. A cell that the record's `row_from` does not name is
    an estimate.
    """
    row, sources = record.get("published"), record.get("row_from", {})
    if row is None or row["idx"] is not None:
        return []
    names = {column: (figure, "m") for column, figure in SIZES.items()} | RATES
    return [(figure, row[column], unit, sources.get(column, "estimate"))
            for column, (figure, unit) in names.items() if row[column] is not None]  # fmt: skip


def estimates(record: dict) -> tuple[int, int]:
    """Return how many figures and cells of a merged record are estimates, and how many there are."""
    sources = [source for *_, source in own_cells(record)]
    sources += [entry["source"] for entry in record.get("figures", {}).values()]
    return sources.count("estimate"), len(sources)


def rows(records: dict[str, dict]) -> list[tuple]:
    """Return the table's rows from merged records: the row's sizes first, then each figure as written."""
    result = []
    for name, record in records.items():
        row, sources = record["published"], record.get("sources", {})
        cells = (
            own_cells(record)
            if row["idx"] is None
            else [
                (figure, row[column], "m", "published table")
                for column, figure in SIZES.items()
                if row[column] is not None
            ]
        )
        if record["source"] == "builtin":
            cells += [(figure, entry["value"], entry["unit"], sources.get(entry["source"], entry["source"]))
                      for figure, entry in record["figures"].items()]  # fmt: skip
        result += [(name, record["category"], *cell) for cell in cells]
    return result


def main(arguments: list[str]) -> None:
    """Write the dimension table of the record files given."""
    line = argparse.ArgumentParser(prog="python -m lowalt.targets.dimensions", description=__doc__)
    line.add_argument("--table", required=True, type=Path, help="table of published targets (CSV)")
    line.add_argument("--records", required=True, nargs="+", type=Path, help="record files (YAML)")
    line.add_argument("--out", required=True, type=Path, help="table to write (.csv)")
    options = line.parse_args(arguments)
    write_csv(options.out, COLUMNS, rows(load_records(options.table, options.records)))


if __name__ == "__main__":
    run(main)
