"""Section: the run in one sentence."""

from lowalt.common.hardware import describe
from lowalt.report.run import ReportedRun


def values(run: ReportedRun) -> dict:
    """Return the run's size, its seed and the machine."""
    return {
        "run": run.config["run"], "seed": run.config["seed"], "stations": len(run.stations),
        "snrs": len(run.snr_labels), "models": len(run.shards) // len(run.snr_labels),
        "subtypes": len(run.inputs.paths("clouds")), "samples": len(run.shards), "kind": run.shards.kind,
        "sample_bytes": run.sample_bytes, "hardware": describe(),
    }  # fmt: skip
