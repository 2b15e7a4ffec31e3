"""Section: recognition accuracy by scheme and SNR, with the values that the paper prints."""

from pathlib import Path

from lowalt.files.csv_tables import read_csv
from lowalt.report.figures.accuracy_plots import over_snr
from lowalt.report.pivots import by_scheme, macro_f1, spreads
from lowalt.report.plots import for_every_width
from lowalt.report.reported_run import ReportedRun

COLUMNS = ("protocol", "scheme", "snr_db", "accuracy_percent")


def network_words(block: dict) -> str:
    """Return the network and its training in words, from the block `recognition`."""
    network = block["network"]
    training = block["training"]
    start = {"none": "random initial weights", "hub": "ImageNet weights from the hub"}
    weights = start.get(
        network["weights"], f"weights from the file {Path(network['weights']).name}"
    )
    seeds = len(block["seeds"])
    return (
        f"{network['backbone']} at {block['size']} pixels, {weights}, at most {training['steps']} "
        f"steps of {training['batch']} samples, {seeds} training seed{'s' if seeds > 1 else ''}"
    )


def values(run: ReportedRun) -> dict:
    """Return accuracies of this run and of the paper, their figure, and the network in words."""
    measured = run.inputs.table("accuracy", *COLUMNS, "seeds", "spread_points")
    ours = by_scheme(measured)
    paper = {}
    if "published" in run.inputs:
        paper = by_scheme(read_csv(run.inputs.path("published"), *COLUMNS))
    return {
        "classes": len(run.shards.classes),
        "ours": ours,
        "published": paper,
        "spreads": spreads(measured),
        "snrs": run.snr_labels,
        "macro_f1": macro_f1(measured),
        "network": network_words(run.config["recognition"]),
        "plot": for_every_width(over_snr, ours, paper) if ours else None,
    }
