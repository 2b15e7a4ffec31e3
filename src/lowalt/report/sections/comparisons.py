"""Section: paired comparisons of schemes, and whether the paper's orderings hold."""

from lowalt.report.reported_run import ReportedRun

COMPARISONS = (
    "protocol",
    "scheme",
    "over",
    "difference_points",
    "low",
    "high",
    "resampled",
    "seeds",
)
ORDERINGS = ("protocol", "scheme", "over", "claim", "paper_points", "difference_points", "ordering")


def ordering_words(rows: list[dict[str, str]]) -> str:
    """Return in one sentence how many of the paper's orderings hold, and which do not."""
    if all(row["ordering"] == "not ranked" for row in rows):
        return (
            "Whether the paper's orderings hold takes three training seeds (recognition.seeds: "
            "[0, 1, 2])."
        )
    holding = [row for row in rows if row["ordering"] == "holds"]
    words = f"Of {len(rows)} orderings of the paper that this run can test, {len(holding)} hold"
    phrases = {
        "reversed": "the other way round",
        "undecided": "not decided by these samples",
        "not ranked": "not ranked, with fewer than three training seeds",
    }
    for verdict, phrase in phrases.items():
        names = [
            f"{row['scheme']} over {row['over']} ({row['protocol']})"
            for row in rows
            if row["ordering"] == verdict
        ]
        if names:
            words += f"; {phrase}: {', '.join(names)}"
    return words + "."


def values(run: ReportedRun) -> dict | None:
    """Return the paired comparisons and the paper's orderings.

    It is None where no two compared schemes were trained.
    """
    comparisons = run.inputs.table("comparisons", *COMPARISONS)
    orderings = run.inputs.table("orderings", *ORDERINGS)
    if not comparisons:
        return None
    words = ordering_words(orderings) if orderings else ""
    return {
        "comparisons": comparisons,
        "orderings": orderings,
        "words": words,
        "published": "published" in run.inputs,
    }
