"""Section: confusion matrices."""

from lowalt.report.figures import accuracy_plots
from lowalt.report.pivots import confusion
from lowalt.report.reported_run import ReportedRun

COLUMNS = ("protocol", "scheme", "category", "predicted", "samples")


def values(run: ReportedRun) -> dict | None:
    """Return the plot; None where nothing was predicted."""
    counts = confusion(run.inputs.table("confusion", *COLUMNS))
    return {"plot": accuracy_plots.confusion(counts, run.shards.classes)} if counts else None
