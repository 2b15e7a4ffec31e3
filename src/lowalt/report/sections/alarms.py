"""Section: how often other targets are called UAV, at thresholds for a wanted detection rate."""

from lowalt.report.run import Run

COLUMNS = (
    "protocol", "scheme", "asked_percent", "detected_percent", "bird_percent", "vehicle_percent", "pedestrian_percent",
)  # fmt: skip


def values(run: Run) -> dict | None:
    """Return the rows of the table of false alarms; None where there are none."""
    rows = run.inputs.table("alarms", *COLUMNS)
    return {"rows": rows} if rows else None
