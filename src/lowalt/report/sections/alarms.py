"""Section: how often other targets are called UAV, at thresholds for a wanted detection rate."""

from lowalt.report.run import Run

RATES = ("detected", "bird", "vehicle", "pedestrian")
COLUMNS = (
    "protocol", "scheme", "asked_percent", "threshold",
    *(f"{rate}_{end}" for rate in RATES for end in ("percent", "low", "high")),
)  # fmt: skip


def values(run: Run) -> dict | None:
    """Return the rows of the table of false alarms; None where there are none."""
    rows = run.inputs.table("alarms", *COLUMNS)
    return {"rows": rows, "rates": RATES} if rows else None
