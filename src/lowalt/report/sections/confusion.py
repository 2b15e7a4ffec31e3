"""Section: confusion matrices."""

from lowalt.report.figures.confusion import confusion_matrices
from lowalt.report.figures.style import embedded
from lowalt.report.run import Run
from lowalt.report.tables import confusion

COLUMNS = ("protocol", "scheme", "category", "predicted", "samples")


def values(run: Run) -> dict | None:
    """Return the figure; None where nothing was predicted."""
    counts = confusion(run.inputs.table("confusion", *COLUMNS))
    return {"picture": embedded(confusion_matrices(counts, run.shards.classes))} if counts else None
