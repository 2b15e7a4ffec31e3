"""Section: confusion matrices over all SNRs, and what each class is taken for at each SNR."""

from lowalt.report.figures import accuracy_plots
from lowalt.report.pivots import best_schemes, by_scheme, confusion
from lowalt.report.plots import for_every_width
from lowalt.report.reported_run import ReportedRun
from lowalt.report.sections import accuracy

COLUMNS = ("protocol", "scheme", "snr_db", "category", "predicted", "samples")


def values(run: ReportedRun) -> dict | None:
    """Return both plots, None where nothing was predicted.

    That by SNR is of the best scheme of each protocol.
    """
    rows = run.inputs.table("confusion_by_snr", *COLUMNS)
    classes = run.shards.classes
    if not rows:
        return None
    best = best_schemes(by_scheme(run.inputs.table("accuracy", *accuracy.COLUMNS)))
    chosen = [row for row in rows if row["scheme"] == best[row["protocol"]]]
    return {
        "plot": for_every_width(accuracy_plots.confusion, confusion(rows), classes),
        "by_snr": for_every_width(accuracy_plots.confusion_by_snr, chosen, classes),
    }
