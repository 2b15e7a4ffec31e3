"""Section: recognition accuracy over its time, from this run's table or the kept reference."""

from lowalt.report.figures import cost_plots
from lowalt.report.figures.accuracy_cost import FIDELITY, NEEDED
from lowalt.report.run import ReportedRun

SHOWN = ("backbone", "pixels", "inference_ms_1", "hardware")


def values(run: ReportedRun) -> dict | None:
    """Return the rows averaged over the SNRs and their figure; None where neither run nor reference has them."""
    name = run.inputs.own_or_kept("accuracy_cost")
    if name is None:
        return None
    table = run.inputs.table(name, *NEEDED, *FIDELITY, *SHOWN)
    rows = [row for row in table if row["snr_db"] == "avg" and row["kind"] != "fidelity"]
    return {"own": name == "accuracy_cost", "rows": rows, "hardware": table[0]["hardware"],
            "plot": cost_plots.recognition(table)}  # fmt: skip
