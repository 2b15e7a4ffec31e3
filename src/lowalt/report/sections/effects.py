"""Section: the time that each effect takes, and its influence on signals, spectra and recognition."""

from lowalt.report.figures import cost_plots
from lowalt.report.figures.style import embedded
from lowalt.report.run import ReportedRun

COLUMNS = (
    "call", "effects", "motion_models", "base_ms", "added_ms", "parts_ms", "signal_change", "pixels_changed_percent",
    "pixel_difference", "cells_changed_percent", "snr_db", "accuracy_without_percent", "accuracy_with_percent",
    "difference_points", "low", "high", "scheme", "protocol", "hardware",
)  # fmt: skip


def values(run: ReportedRun) -> dict | None:
    """Return the rows of the table of effects and their figures; None where the run has no table."""
    if "effects" not in run.inputs:
        return None
    rows = run.inputs.table("effects", *COLUMNS)
    picture = embedded(run.inputs.path("effects_figure").read_bytes())
    return {"own": True, "rows": rows, "plot": cost_plots.effects(rows) if rows[1:] else None, "picture": picture}
