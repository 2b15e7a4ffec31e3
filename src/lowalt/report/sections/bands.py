"""Section: accuracy over distance and aspect."""

from lowalt.report.figures.accuracy_plots import FEWEST, over_bands
from lowalt.report.run import ReportedRun

COLUMNS = ("protocol", "scheme", "from", "to", "accuracy_percent", "samples")


def values(run: ReportedRun) -> dict | None:
    """Return the plot; None where every band has fewer than FEWEST samples."""
    bands = {
        "distance to the nearest station used (m)": run.inputs.table("ranges", *COLUMNS),
        "aspect seen from it (°)": run.inputs.table("aspects", *COLUMNS),
    }
    if not any(int(row["samples"]) >= FEWEST for rows in bands.values() for row in rows):
        return None
    return {"plot": over_bands(bands), "fewest": FEWEST}
