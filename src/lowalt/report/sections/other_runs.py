"""Section: models of other runs on this run's test samples."""

from lowalt.report.reported_run import ReportedRun

COLUMNS = (
    "protocol",
    "scheme",
    "trained_on",
    "snr_db",
    "accuracy_percent",
    "own_percent",
    "difference_points",
    "low",
    "high",
    "seeds",
    "spread_points",
)


def values(run: ReportedRun) -> dict | None:
    """Return the rows averaged over the SNRs; None where the run names no other runs."""
    if "transfer" not in run.inputs:
        return None
    return {
        "rows": [row for row in run.inputs.table("transfer", *COLUMNS) if row["snr_db"] == "avg"]
    }
