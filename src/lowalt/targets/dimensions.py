"""Dimension table: every figure of the built-in models with its source or the mark "estimate", as CSV."""

import argparse
from pathlib import Path

from lowalt.common.command import run
from lowalt.common.csv_tables import write_csv
from lowalt.targets.records import load_records

COLUMNS = ("subtype", "category", "figure", "value", "unit", "source")
_PUBLISHED = {
    "size_m": "size",
    "len_m": "length",
    "wid_m": "width",
    "hgt_m": "height",
    "wheel_diam_m": "wheel_diameter",
}


def rows(records: dict[str, dict]) -> list[tuple]:
    """Return the table's rows from merged records: the published sizes first, then each figure as written."""
    result = []
    for name, record in records.items():
        head = (name, record["category"])
        for column, figure in _PUBLISHED.items():
            if record["published"][column] is not None:
                result.append((*head, figure, record["published"][column], "m", "published table"))
        if record["source"] != "builtin":
            continue
        for figure, entry in record["figures"].items():
            source = record.get("sources", {}).get(entry["source"], entry["source"])
            result.append((*head, figure, entry["value"], entry["unit"], source))
    return result


def main(arguments: list[str]) -> None:
    """Write the dimension table of the record files given."""
    line = argparse.ArgumentParser(prog="python -m lowalt.targets.dimensions", description=__doc__)
    line.add_argument("--table", required=True, type=Path, help="table of published targets (CSV)")
    line.add_argument("--records", required=True, nargs="+", type=Path, help="record files (YAML)")
    line.add_argument("--out", required=True, type=Path, help="table to write (.csv)")
    given = line.parse_args(arguments)
    write_csv(given.out, COLUMNS, rows(load_records(given.table, given.records)))


if __name__ == "__main__":
    run(main)
