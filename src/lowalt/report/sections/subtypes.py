"""Section: accuracy of every subtype, the worst first with what their errors have in common."""

import numpy as np

from lowalt.recognition.predictions import Predictions, read, record
from lowalt.recognition.protocols import folds
from lowalt.report.reported_run import ReportedRun

ACCURACY = ("protocol", "scheme", "subtype", "category", "accuracy_percent")
DISTANCES = ("category", "subtype", "nearest_trained", "trained_distance", "trained_size_ratio")


WORST = 6
"""Subtypes that are shown with a reason."""


def subtype_table(rows: list[dict[str, str]]) -> tuple[list[str], list[tuple[str, str, dict[str, str]]]]:
    """Return (columns, rows) of accuracy by subtype: a column a protocol and scheme, a row a subtype."""
    columns: dict[str, None] = {}
    table: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        column = f"{row['protocol']} {row['scheme']}"
        columns[column] = None
        table.setdefault((row["subtype"], row["category"]), {})[column] = f"{float(row['accuracy_percent']):.1f}"
    return list(columns), [(name, category, values) for (name, category), values in table.items()]


def reasons(predictions: Predictions, classes: tuple[str, ...]) -> dict[str, str]:
    """Return by subtype what its wrong samples have in common, in a sentence; "" where none is wrong."""
    sentences = {}
    for subtype in np.unique(predictions.subtype):
        of_subtype = predictions.take(predictions.subtype == subtype)
        wrong = of_subtype.take(~of_subtype.correct)
        if not len(wrong):
            continue
        called = classes[np.bincount(wrong.guesses).argmax()]
        models = np.unique(of_subtype.motion)
        always = sum(not of_subtype.correct[of_subtype.motion == model].any() for model in models)
        along = np.abs(np.cos(np.radians(of_subtype.aspect_deg)))
        words = f"called {called} in {np.mean(wrong.guesses == classes.index(called)):.0%} of its errors; "
        words += f"{always} of {len(models)} motion models are wrong at every SNR"
        if np.isfinite(along).all():
            apart = along[~of_subtype.correct].mean() - along.mean()
            if abs(apart) > 0.1:
                words += f"; wrong more often seen {'from the front or rear' if apart > 0 else 'from the side'}"
        sentences[str(subtype)] = words
    return sentences


def values(run: ReportedRun) -> dict | None:
    """Return the pivoted table, the worst subtype of the last column first, distances and reasons; None without any."""
    columns, rows = subtype_table(run.inputs.table("subtypes", *ACCURACY))
    distances = {row["subtype"]: row for row in run.inputs.table("distances", *DISTANCES)}
    rows.sort(key=lambda row: float([*row[2].values()][-1]))
    files = run.inputs.paths("predictions")
    # The last training is of the protocol and the scheme that the configuration names last.
    in_common = {}
    if files:
        tested = folds(record(files[-1])["protocol"], "test")
        in_common = reasons(read(files[-1], run.shards.classes).of(tested), run.shards.classes)
    return (
        {"columns": columns, "rows": rows, "distances": distances, "reasons": in_common, "worst": WORST}
        if rows
        else None
    )
