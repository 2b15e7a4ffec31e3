"""Section: recognition accuracy against time, from this run's table or the stored reference."""

from lowalt.report.figures import cost_plots
from lowalt.report.plots import for_every_width
from lowalt.report.reported_run import ReportedRun

SHOWN = (
    *cost_plots.PRESET,
    "pixels",
    "train_samples",
    "steps",
    "seen_percent",
    "inference_ms_1",
    "inference_ms_64",
    "hardware",
)


def values(run: ReportedRun) -> dict | None:
    """Return the plot, the presets and all rows; None where neither has the table."""
    name = run.inputs.own_or_kept("accuracy_cost")
    if name is None:
        return None
    rows = run.inputs.table(name, *cost_plots.RECOGNITION, *SHOWN)
    presets = sorted((row for row in rows if row["preset"]), key=cost_plots.seconds)
    return {
        "own": name == "accuracy_cost",
        "rows": rows,
        "presets": presets,
        "hardware": rows[0]["hardware"],
        "plot": for_every_width(cost_plots.recognition, rows),
    }
