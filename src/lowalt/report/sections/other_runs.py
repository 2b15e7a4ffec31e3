"""Section: models of other runs on this run's test samples."""

from lowalt.recognition.transfer import COLUMNS
from lowalt.report.reported_run import ReportedRun


def values(run: ReportedRun) -> dict | None:
    """Return the rows averaged over the SNRs; None where the run names no other runs."""
    if "transfer" not in run.inputs:
        return None
    return {
        "rows": [row for row in run.inputs.table("transfer", *COLUMNS) if row["snr_db"] == "avg"]
    }
