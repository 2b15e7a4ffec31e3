"""Section: accuracy of every subtype, and the subtype nearest to it that was trained on."""

from lowalt.report.run import ReportedRun

ACCURACY = ("protocol", "scheme", "subtype", "category", "accuracy_percent")
DISTANCES = ("category", "subtype", "nearest_trained", "trained_distance", "trained_size_ratio")


def subtype_table(rows: list[dict[str, str]]) -> tuple[list[str], list[tuple[str, str, dict[str, str]]]]:
    """Return (columns, rows) of accuracy by subtype: a column a protocol and scheme, a row a subtype."""
    columns: dict[str, None] = {}
    table: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        column = f"{row['protocol']} {row['scheme']}"
        columns[column] = None
        table.setdefault((row["subtype"], row["category"]), {})[column] = f"{float(row['accuracy_percent']):.1f}"
    return list(columns), [(name, category, values) for (name, category), values in table.items()]


def values(run: ReportedRun) -> dict | None:
    """Return the pivoted table, the worst subtype first, and the distances; None where nothing was predicted."""
    columns, rows = subtype_table(run.inputs.table("subtypes", *ACCURACY))
    distances = {row["subtype"]: row for row in run.inputs.table("distances", *DISTANCES)}
    rows.sort(key=lambda row: min(map(float, row[2].values())))
    return {"columns": columns, "rows": rows, "distances": distances} if rows else None
