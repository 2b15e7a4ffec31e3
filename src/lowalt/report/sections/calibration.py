"""Section: whether a probability of the network is the share of samples that it gets right."""

from lowalt.report.figures.bands import FEWEST
from lowalt.report.figures.reliability import reliability_figure
from lowalt.report.figures.style import embedded
from lowalt.report.run import Run

RELIABILITY = ("protocol", "scheme", "confidence_percent", "accuracy_percent", "samples")
CALIBRATION = ("protocol", "scheme", "calibration_error", "brier", "cross_entropy")


def values(run: Run) -> dict | None:
    """Return the table and the figure; None where nothing was predicted."""
    bands, rows = run.inputs.table("reliability", *RELIABILITY), run.inputs.table("calibration", *CALIBRATION)
    if not bands:
        return None
    return {"rows": rows, "fewest": FEWEST, "picture": embedded(reliability_figure(bands))}
