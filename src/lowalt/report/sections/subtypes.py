"""Section: accuracy of every subtype, the worst first with what their errors have in common."""

from collections.abc import Mapping

import numpy as np

from lowalt.recognition.predictions import Predictions, read, record
from lowalt.recognition.protocols import folds
from lowalt.report.reported_run import ReportedRun
from lowalt.shards import ShardSet

ACCURACY = ("protocol", "scheme", "subtype", "category", "accuracy_percent")
DISTANCES = ("category", "subtype", "nearest_trained", "trained_distance", "trained_size_ratio")

WORST = 6
"""Subtypes that are shown with a reason."""
TRAITS = {
    "speed": ("faster", "slower", " m/s"),
    "distance": ("farther away", "nearer", " m"),
    "height": ("higher up", "lower down", " m"),
    "rate": ("with quicker parts", "with slower parts", " Hz"),
    "aspect": (
        "seen more from the side",
        "seen more from the front or rear",
        "° from nose or tail",
    ),
}
"""What may set motion models apart: words where it is larger and where it is smaller, and its unit.
"""
FEWEST = 5
CHANCE = 0.05
"""Fewest motion models of a kind that are compared; how often chance alone may name a trait."""


def subtype_table(
    rows: list[dict[str, str]],
) -> tuple[list[str], list[tuple[str, str, dict[str, str]]]]:
    """Return the columns and rows of accuracy by subtype.

    There is one column per protocol and scheme, and one row (subtype, category, cells by column)
    per subtype.
    """
    columns: dict[str, None] = {}
    table: dict[tuple[str, str], dict[str, str]] = {}
    for row in rows:
        column = f"{row['protocol']} {row['scheme']}"
        columns[column] = None
        table.setdefault((row["subtype"], row["category"]), {})[column] = (
            f"{float(row['accuracy_percent']):.1f}"
        )
    return list(columns), [(name, category, values) for (name, category), values in table.items()]


def reasons(
    predictions: Predictions, classes: tuple[str, ...], traits: Mapping[str, dict[str, float]]
) -> dict[str, str]:
    """Return for each subtype with wrong samples what these have in common, in one sentence.

    traits: numbers of TRAITS by the name of a motion model, as `Predictions.motion` gives it.
    """
    sentences = {}
    for subtype in np.unique(predictions.subtype):
        of_subtype = predictions.take(predictions.subtype == subtype)
        wrong = of_subtype.take(~of_subtype.correct)
        if not len(wrong):
            continue
        called = classes[np.bincount(wrong.guesses).argmax()]
        models = np.unique(of_subtype.motion).tolist()
        sometimes = set(of_subtype.take(of_subtype.correct).motion.tolist())
        always = [model for model in models if model not in sometimes]
        words = (
            f"called {called} in {np.mean(wrong.guesses == classes.index(called)):.0%} of its "
            "errors; "
        )
        words += f"{len(always)} of {len(models)} motion models are wrong at every SNR"
        sentences[str(subtype)] = words + _apart(always, sorted(sometimes), traits)
    return sentences


def _apart(always: list[str], sometimes: list[str], traits: Mapping[str, dict[str, float]]) -> str:
    """Words for the trait that tells models that are `always` wrong from those `sometimes` right.

    "" where there are too few of either, or where chance may well be the cause.
    """
    wrong = [traits[model] for model in always if model in traits]
    right = [traits[model] for model in sometimes if model in traits]
    if min(len(wrong), len(right)) < FEWEST:
        return ""
    # Of all that the page imports only matplotlib takes longer, and most runs are too small for it.
    from scipy.stats import mannwhitneyu

    chances = {}
    for name in TRAITS:
        test = mannwhitneyu([of[name] for of in wrong], [of[name] for of in right])
        chances[name] = test.pvalue
    name = min(chances, key=chances.__getitem__)
    if not chances[name] < CHANCE / len(TRAITS):
        return ""
    of_wrong = np.median([of[name] for of in wrong])
    of_right = np.median([of[name] for of in right])
    larger, smaller, unit = TRAITS[name]
    words = larger if of_wrong > of_right else smaller
    return f", most of them {words} (median {of_wrong:.3g} against {of_right:.3g}{unit})"


def traits_of(shards: ShardSet, predictions: Predictions) -> dict[str, dict[str, float]]:
    """Return the numbers of TRAITS by motion model, seen from the first station.

    A model is left out where nothing says its motion.
    """
    numbers = {key.decode(): number for number, key in enumerate(shards.keys.tolist())}
    result = {}
    names, rows = np.unique(predictions.motion, return_index=True)
    for name, first in zip(names.tolist(), rows.tolist(), strict=True):
        motion = shards.record(numbers[str(predictions.key[first])])["motion"]
        if motion.get("x_m") is not None:
            result[name] = {
                "speed": float(np.linalg.norm([motion[f"v{axis}_mps"] for axis in "xyz"])),
                "distance": float(predictions.range_m[first]),
                "height": motion["z_m"],
                "rate": motion.get("rate_hz") or 0.0,
                "aspect": float(90 - abs(90 - predictions.aspect_deg[first])),
            }
    return result


def values(run: ReportedRun) -> dict | None:
    """Return the pivoted table, the worst subtype of the last column first; None without any.

    Distances and reasons stand beside it.
    """
    columns, rows = subtype_table(run.inputs.table("subtypes", *ACCURACY))
    distances = {row["subtype"]: row for row in run.inputs.table("distances", *DISTANCES)}

    def last_accuracy(row: tuple[str, str, dict[str, str]]) -> float:
        """The accuracy in a row's last column."""
        _, _, cells = row
        return float(list(cells.values())[-1])

    rows.sort(key=last_accuracy)
    files = run.inputs.paths("predictions")
    # The last training is of the protocol and the scheme that the configuration names last.
    in_common = {}
    if files:
        tested = folds(record(files[-1])["protocol"], "test")
        predictions = read(files[-1], run.shards.classes).of(tested)
        in_common = reasons(predictions, run.shards.classes, traits_of(run.shards, predictions))
    if not rows:
        return None
    return {
        "columns": columns,
        "rows": rows,
        "distances": distances,
        "reasons": in_common,
        "worst": WORST,
    }
