"""Section: how often other targets are given the first class's name, at thresholds for a wanted detection rate."""

from lowalt.common.classes import listed, plural, word
from lowalt.report.run import ReportedRun

COLUMNS = ("protocol", "scheme", "asked_percent", "threshold")


def values(run: ReportedRun) -> dict | None:
    """Return the rows of the table of false alarms and the words of the classes; None where there are none."""
    wanted, *others = run.shards.classes
    rates = ("detected", *map(word, others))
    columns = (f"{rate}_{end}" for rate in rates for end in ("percent", "low", "high"))
    rows = run.inputs.table("alarms", *COLUMNS, *columns)
    if not rows:
        return None
    names = [plural(name) for name in others]
    return {"rows": rows, "rates": rates, "wanted": wanted, "many": plural(wanted), "others": names,
            "listed": listed(names)}  # fmt: skip
