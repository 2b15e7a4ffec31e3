"""Section: the time and the size of each training."""

from lowalt.report.run import ReportedRun

COLUMNS = (
    "protocol", "scheme", "seed", "accuracy_percent", "backbone", "weights", "parameters", "steps", "train_s",
    "train_processor_s", "samples_per_s", "precision", "ranks", "hardware",
)  # fmt: skip


def values(run: ReportedRun) -> dict | None:
    """Return the rows of the table of trainings; None where there are none."""
    rows = run.inputs.table("seeds", *COLUMNS)
    return {"rows": rows} if rows else None
