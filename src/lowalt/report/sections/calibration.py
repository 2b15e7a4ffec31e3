"""Section: whether a probability of the network is the share of samples that it gets right."""

from lowalt.report.figures.accuracy_plots import FEWEST, over_confidence
from lowalt.report.run import ReportedRun

RELIABILITY = ("protocol", "scheme", "confidence_percent", "accuracy_percent", "samples")
CALIBRATION = ("protocol", "scheme", "calibration_error", "brier", "cross_entropy")


def values(run: ReportedRun) -> dict | None:
    """Return the table and the plot; None where nothing was predicted."""
    bands, rows = run.inputs.table("reliability", *RELIABILITY), run.inputs.table("calibration", *CALIBRATION)
    if not any(int(row["samples"]) >= FEWEST for row in bands):
        return None
    return {"rows": rows, "fewest": FEWEST, "plot": over_confidence(bands)}
